# SPDX-License-Identifier: BSD-3-Clause
"""One generative model of the misfit and one posterior over sets of effects.

y = sum over effects A_e c_e + discrepancy d + noise

points      the rows of the balance, condensed to one mean per operating point and what varies within it
model       rows, columns and prior of one set of effects
evidence    the marginal likelihood of one set of effects, with the sizes of effects and discrepancy learnt
posterior   the posterior over sets: names, ambiguities, confidence
"""
