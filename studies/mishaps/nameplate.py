# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of the drive file: factors on its constants, units, pole pairs, timing."""

from __future__ import annotations

import math

from studies.mishaps.log import Mishap, scaled, stated, then
from studies.scored.truth import Cause

FACTORS = {"a half": 0.5, "two thirds": 2 / 3, "1.3": 1.3, "1.5": 1.5, "three": 3.0}
RL = ("resistance_ohm", "inductance_d_h", "inductance_q_h")
SCALES = ("current_scale", "udc_gain", "magnet_flux", "resistance", "inductance_d", "inductance_q")
READ = r"currents_|voltages_|bus_|machine_line|resistance_line|inductances_line|psi_"
TIMES = r"sample_time|sample time|time (step|between)"


def _times(keys, factor):
    return stated(**dict.fromkeys(keys, factor))


MISHAPS = (
    *(Mishap(f"R and L times {n}", "phases", _times(RL, f), may=SCALES, may_read=READ) for n, f in FACTORS.items()),
    *(Mishap(f"psi times {n}", "dq", _times(("magnet_flux_wb",), f), may=SCALES, may_read=READ)
      for n, f in FACTORS.items()),
    *(Mishap(f"R times {n}", "phases", _times(("resistance_ohm",), f)) for n, f in FACTORS.items()),
    Mishap("R and L times 1.5 slow", "slow", _times(RL, 1.5), may=SCALES, may_read=READ),
    Mishap("R and L times two thirds table", "table", _times(RL, 2 / 3), may=SCALES, may_read=READ),
    Mishap("L_d and L_q at 1.5", "dq", _times(RL[1:], 1.5), may=SCALES),
    Mishap("L_d and L_q exchanged and 0.6", "phases", stated(inductance_d_h=0.6, inductance_q_h=1.4)),
    Mishap("psi in mWb", "phases", _times(("magnet_flux_wb",), 1e3), reading="mWb|psi_milli", limit="mWb|magnet_flux"),
    Mishap("L in mH", "dq", _times(RL[1:], 1e3), reading="mH|inductances_milli", limit="mH|inductance"),
    Mishap("R in milliohm", "phases", _times(RL[:1], 1e3), reading="milliohm|resistance_milli",
           limit="milliohm|resistance"),
    Mishap("psi line to line", "dq", _times(("magnet_flux_wb",), math.sqrt(3)), reading=r"psi_line\b", may=SCALES,
           may_read=READ),
    Mishap("pole pairs twice with electrical angle", "phases", stated(pole_pairs=2), limit="pole_pairs|pole pairs",
           readings="pole.pairs"),
    Mishap("pole pairs one more with rpm", "slow",
           then(scaled(30 / math.pi, "omega_e"), lambda log: log.having(
               **{"n [rpm]": log.columns["omega_e"] / log.drive["machine"]["pole_pairs"]}).without("omega_e"),
               lambda log: log.driven("machine", pole_pairs=log.drive["machine"]["pole_pairs"] + 1)),
           causes=(Cause(reading=r"pole.pairs", may=("magnet_flux", "inductance_d", "inductance_q")),), ignored=True),
    Mishap("rated current ten times", "phases", stated(rated_current_a=10.0), limit="rated_current"),
    Mishap("bus of the file half", "phases", lambda log: log.driven("inverter", dc_bus_v=log.drive["inverter"]
           ["dc_bus_v"] / 2), readings="bus|dc_bus_v|u_dc", limit="dc_bus_v|u_dc"),
    Mishap("sample time twice", "phases", lambda log: log.driven("control", sample_time_s=log.drive["control"]
           ["sample_time_s"] * 2), readings=TIMES, limit=TIMES),
    Mishap("sample time not stated", "phases", lambda log: log.driven("control", sample_time_s=None),
           readings=TIMES, limit=TIMES),
    Mishap("duties stated to act at once", "phases", lambda log: log.driven("control", duty_applied_after_samples=0),
           causes=(Cause(("delay",), words="delay|late", reading="duty_applied"),)),
    Mishap("dead time stated that is not there", "phases",
           lambda log: log.driven("inverter", dead_time_s=2e-6), readings="dead_time"),
)  # fmt: skip
