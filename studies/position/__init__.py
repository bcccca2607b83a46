# SPDX-License-Identifier: BSD-3-Clause
"""Position mode: following error, rest with friction, stops, change of modes, and the RTL beside the golden core."""
