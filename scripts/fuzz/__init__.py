"""`make fuzz`: hostile and damaged inputs, drawn and made smaller by Hypothesis."""
