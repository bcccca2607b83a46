# SPDX-License-Identifier: BSD-3-Clause
"""One generative model of the misfit and one posterior over sets of effects.

y = sum over effects A_e c_e + discrepancy d + noise

points      the rows of the balance, condensed to one mean per operating point and what varies within it
model       rows, columns and prior of one set of effects
evidence    the marginal likelihood of one set of effects, with the sizes of effects and discrepancy learnt
problem     the columns of all effects at one linearisation
fit         the most probable sizes of a set of effects on a problem; fitted_set: what is found
converge    a set on its own linearisation, until both agree
search      which sets are judged: a loop over moves/, one a file, each with the case that needs it
posterior   what the search leaves, read-only: probabilities of sets and effects
"""
