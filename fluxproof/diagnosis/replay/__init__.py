# SPDX-License-Identifier: BSD-3-Clause
"""The digital part: the golden model over the core's recorded inputs, and the cause of the first difference.

telemetry.py  dumps and streams of the core; digital.py replays them; cause.py, flow.py, local.py explain a difference
"""
