# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof project``: the files of a Vivado project and its software from one drive.toml.

Everything that depends on the clock, the converters or the PWM frequency comes from the same file, so that hardware,
constraints and software cannot tell different stories.
"""
