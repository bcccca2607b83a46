# SPDX-License-Identifier: BSD-3-Clause
"""The drive as described and the improved one, simulated in closed loop over the recording (compare.py)."""
