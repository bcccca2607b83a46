# SPDX-License-Identifier: BSD-3-Clause
"""What every part of the scaling yields: the value of one register with its unit, its scale and where it comes from."""

from typing import NamedTuple


class Entry(NamedTuple):
    """The value for one register: SI value, unit, SI value of 1.0 in its format, keys it is derived from."""

    name: str
    si: float
    unit: str
    scale: float
    keys: str


def base_keys(drive, *names):
    """The keys that determine the bases: those of [bases], or the defaults of bases that are not given."""
    origin = {
        "current_a": "[sensors] current_range_a",
        "voltage_v": "[sensors] u_dc_range_v",
        "omega_me_rad_s": "[machine] pole_pairs, rated_speed_rad_s",
    }
    given = {name: f"[bases] {name}" for name in names if getattr(drive.base_choice, name) is not None}
    return "; ".join({**origin, **given}[name] for name in names)


def leg_loss_v(drive):
    """Leg voltage loss by dead time and device drops, calculated from the drive's data [V]."""
    i = drive.inverter
    return i.dead_time_s * i.pwm_frequency_hz * i.dc_bus_v + (i.v_switch_v + i.v_diode_v) / 2.0
