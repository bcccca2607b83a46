# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof fleet``: many recordings on all cores or a cluster, and what they say together.

manifest  which recordings, of which drives
work      one recording becomes one row; any failure becomes a row with its reason
engine    dask.distributed: cores or a cluster, progress, workers that die
table     rows on disk, each written whole; what is done is not done again
session   the whole
page      fleet.html
"""
