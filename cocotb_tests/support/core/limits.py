# SPDX-License-Identifier: BSD-3-Clause
"""The golden core on the switching plant, set up wrongly or asked for too much: the bench of the limits."""

from __future__ import annotations

import numpy as np

from cocotb_tests.support.drives import PAPER
from fluxproof.cosim.closed_loop import cosimulate, run_now
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.scenarios import RPM
from golden_model import drive as drives
from golden_model.io.fault_latch import NAMES
from golden_model.registers import registers
from golden_model.units import from_si

DRIVE = drives.with_carrier(drives.load(PAPER), 64)
SET = registers(DRIVE)
QUARTER = 1 << 16  # of an electrical turn


def play(periods, rpm=0.0, i_d=0.0, i_q=None, load=0.0, changes=None, start_rpm=0.0, off=0, sensors=None, events=None):
    """The golden core's run; rpm, load and i_d numbers or arrays; i_q: torque mode; ``off``: periods before enable."""
    ones = np.ones(periods)
    omega = np.broadcast_to(rpm, periods) * RPM * DRIVE.machine.pole_pairs
    enable = (np.arange(periods) >= off).astype(np.int64)
    scenario = Scenario(
        omega_ref=np.array([from_si("omega_ref", w, DRIVE) for w in omega]),
        load=ones * load,
        u_dc=ones * DRIVE.inverter.dc_bus_v,
        i_d_ref=np.array([from_si("i_d_ref", i, DRIVE) for i in np.broadcast_to(i_d, periods)]),
        i_q_ext=np.full(periods, from_si("i_q_ext", i_q or 0.0, DRIVE)),
        speed_mode=np.full(periods, int(i_q is None)),
        enable=enable,
        omega_m=start_rpm * RPM,
        changes=events or {},
    )
    used = SET._replace(values=SET.values._replace(**(changes or {})))
    return run_now(cosimulate(None, DRIVE, used, scenario, sensors=sensors))


def first(result):
    """Names of the faults that stopped first."""
    word = result.flags[-1][1]
    return [name for bit, name in enumerate(NAMES) if word >> bit & 1]


def told(result):
    word = result.flags[-1][0]
    return [name for bit, name in enumerate(NAMES) if word >> bit & 1]
