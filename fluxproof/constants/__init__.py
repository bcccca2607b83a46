# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof constants``: the [machine] of a drive file from the numbers of a data sheet, checked against each other.

statements  what a data sheet can state: names, units, and what each may mean
agree       which meanings are consistent with each other, and which statement contradicts the rest
command     arguments, text, the file
"""
