# SPDX-License-Identifier: BSD-3-Clause
"""Position from a board's pins: incremental encoders, Hall sensors, serial absolute encoders; twins of rtl/encoders."""
