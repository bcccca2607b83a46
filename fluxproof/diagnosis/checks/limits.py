# SPDX-License-Identifier: BSD-3-Clause
"""Impossible values: duties outside 0 to 1, a bus voltage at or below zero or far from drive.toml's."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem

STAGE = "channels"
ROUNDING = 0.005  # tolerance for the rounding of 12-bit duties
FAR = 2.0  # largest factor, up or down, from the nominal bus voltage


def check(recording, nominal) -> None:
    for name in ("d_a", "d_b", "d_c"):
        if name in recording.columns:
            duty = recording[name]
            if duty.min() < 0.0 or duty.max() > 1.0:
                out = (duty < -ROUNDING) | (duty > 1.0 + ROUNDING)
                recording.columns[name] = np.clip(duty, 0.0, 1.0)
                _set_aside(recording, out, "duty_range", name, "duties outside 0 to 1", "limited; rows not used")
    if "u_dc" in recording.columns:
        u_dc, bus = recording["u_dc"], nominal.inverter.dc_bus_v
        out = (u_dc <= 0.02 * bus) | (u_dc > 20.0 * bus)
        _set_aside(
            recording,
            out,
            "u_dc_range",
            "u_dc",
            f"bus voltages are implausible for dc_bus_v = {bus:g} V",
            "rows not used",
        )
        middle = float(np.median(u_dc[recording.usable])) if recording.usable.any() else float(np.median(u_dc))
        if not bus / FAR <= middle <= bus * FAR:
            message = f"the median of u_dc is {middle:.4g} V, but dc_bus_v = {bus:g} V"
            recording.problems.append(
                Problem("u_dc_range", message, "u_dc", 0, len(u_dc), "the recorded value is used")
            )


def _set_aside(recording, out, code, name, message, action) -> None:
    count = int(np.count_nonzero(out))
    if count:
        recording.usable &= ~out
        recording.problems.append(Problem(code, f"{count} {message}", name, int(np.argmax(out)), count, action))
