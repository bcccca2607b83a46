# SPDX-License-Identifier: BSD-3-Clause
"""SimpleFOC's monitor, under the names of its documentation: target, voltage q and d, current q and d, velocity, angle.

Source: github.com/simplefoc/Arduino-FOC, FOCMotor::monitor: currents in mA, velocity in rad/s and angle in rad of the
shaft.  The monitor prints no header and no time; a logger adds them.
"""

import re

NAME = "SimpleFOC monitor"
SIGNATURE = {"voltageq", "voltaged", "currentq", "currentd", "velocity"}
COLUMNS = {
    "t": ("t", "s"),
    "time": ("t", "s"),
    "timestamp": ("t", "s"),
    "voltageq": ("u_q_ref", "V"),
    "voltaged": ("u_d_ref", "V"),
    "currentq": ("i_q", "mA"),
    "currentd": ("i_d", "mA"),
    "velocity": ("omega_e", "rad/s mech"),
}
SHAFT = ("velocity",)  # whose unit, if a header states it, is that of the shaft
SAMPLE_TIME_S = 0.01  # of a log without a time: a serial line prints no faster, and steady points need no more
NOTES = [
    "SimpleFOC: currents without a unit are taken in mA, as its monitor prints them; rows without a time are taken as "
    "10 ms apart"
]


def KEY(name: str) -> str:
    """The name in lower case without spaces and dashes."""
    return re.sub(r"[\s_-]", "", name.lower())
