"""Sealed blind benchmark of the diagnosis: generator, truth under seal, scorer.

The simulator in here shares no code with plant/ and none with diagnosis/, so that the benchmark is not the
estimator's own model.
"""
