# SPDX-License-Identifier: BSD-3-Clause
"""Many recordings: what one says for a population, and what the population says.

hypotheses  what a recording holds beside the spread of manufacture, each set of effects with its evidence
row         one recording as a row of fleet.parquet, whose columns schema.py declares
rates       how frequent each effect is in the fleet, and what that makes of each recording
population  mean, spread and shrunk value of each parameter
outliers    drives that differ from the rest, and why
drift       change over time of one serial number
groups      recordings with the same unexplained remainder
prior       the population as prior of the next diagnosis
"""
