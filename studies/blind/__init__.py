# SPDX-License-Identifier: BSD-3-Clause
"""Sealed blind benchmark of the diagnosis: generator, sealed ground truth, scorer.

The simulator shares no code with plant/ or diagnosis/, so that the benchmark does not use the estimator's own model.
"""
