# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis of recordings of real drives, and of a measured flux map driven in closed loop (``make real``)."""
