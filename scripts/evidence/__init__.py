# SPDX-License-Identifier: BSD-3-Clause
"""Figures of docs/evidence.md and docs/benchmark.md, renewed from the results that the commands wrote."""
