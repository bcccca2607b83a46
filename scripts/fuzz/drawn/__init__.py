# SPDX-License-Identifier: BSD-3-Clause
"""Strategies of Hypothesis: damage to bytes, hostile text, and files that only their own library can write."""
