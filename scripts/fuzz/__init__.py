"""`make fuzz`: hostile and damaged inputs, drawn and made smaller by Hypothesis; nothing may escape but one clear line."""
