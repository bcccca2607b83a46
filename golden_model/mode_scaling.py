# SPDX-License-Identifier: BSD-3-Clause
"""The registers of voltage mode and of the changes between modes, see docs/modes.md."""

import math

from golden_model.formats import PU
from golden_model.scale_entry import Entry, base_keys


def modes(drive):
    """The registers of mode_change and mode_references."""
    c, b, t_s = drive.control, drive.bases, drive.sample_time_s
    volts, amperes = base_keys(drive, "voltage_v"), base_keys(drive, "current_a")
    yield Entry("voltage_mode", 0, "1", 1.0, "none: 1 for voltage mode")
    yield Entry("u_d_ext", 0.0, "V", b.voltage_v, "none: the voltage of voltage mode")
    yield Entry("u_q_ext", 0.0, "V", b.voltage_v, "none: the voltage of voltage mode")
    circle = drive.inverter.dc_bus_v / math.sqrt(3.0)
    keys = "[control] mode_change_s; [inverter] dc_bus_v, pwm_frequency_hz"
    # A step below one LSB would never end
    step = max(circle * min(t_s / c.mode_change_s, 1.0), PU.lsb * b.voltage_v)
    yield Entry("u_step", step, "V", b.voltage_v, f"{keys}; {volts}")
    step = max(drive.current_limit_a * min(t_s / c.mode_change_s, 1.0), PU.lsb * b.current_a)
    yield Entry("i_step", step, "A", b.current_a, f"[control] mode_change_s, current_limit_a; {amperes}")
