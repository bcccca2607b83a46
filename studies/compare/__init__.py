# SPDX-License-Identifier: BSD-3-Clause
"""Alternatives to the diagnosis, on the same sealed cases.

Three established methods: sparse regression (pySINDy), NARMAX selection (SysIdentPy) and a joint least-squares fit of
all parameters of a drive model.  Each gets the same data as the diagnosis (data.py): checked rows in steady blocks,
smoothed currents, the exact sampled flux balance.  The comparison is therefore about the naming, and not about reading
files or differentiating noise.
"""
