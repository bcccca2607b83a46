# SPDX-License-Identifier: BSD-3-Clause
"""The drive above base speed: the torque table in the golden core on the switching plant, and in the RTL."""
