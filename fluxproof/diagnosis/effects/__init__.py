"""What an effect is (effect.py), and what its contributions do to each other (with catalogue/ and suspects/).

corrections.py   measurement errors are removed from the data in turn
flux_surface.py  a flux map from a co-energy; flux_splines.py, its basis
"""
