"""The board: front ends, timing and limits of a drive from its pins, as figures with targets."""
