# SPDX-License-Identifier: BSD-3-Clause
"""EMF runs with one probe between two terminals of a machine that another one turns, as an oscilloscope saves them.

u_ab = sqrt(3) omega psi cos(theta + pi/6),    and the harmonics of the phases with it
"""

from __future__ import annotations

import numpy as np

from studies.brought.drives import Made, case, drive_of, true_machine
from studies.scored.truth import Case, Cause, Truth

DRIVES = ("hub_36v", "servo_24v", "spindle_400v", "paper001")
RPM, TURNS = 240.0, 40  # electrical turns that are seen
SAMPLES = {"scope": 200, "few": 7}  # of a turn
LEVELS = 200  # of the probe's range: eight bits
WOBBLE = 2e-3  # of the speed
FIFTH = 0.03  # of the fundamental of a phase's EMF
KINDS = ("healthy", "flux", "fifth")


def _run(kind: str, rate: str, name: str, rng) -> Made:
    drive = drive_of(name)
    machine, causes = true_machine(drive, **({"magnet_flux_wb": 0.93} if kind == "flux" else {}))
    fifth = FIFTH if kind == "fifth" else 0.0
    if fifth:
        causes = [Cause(("emf_harmonics",))]
    omega = machine["pole_pairs"] * RPM * np.pi / 30.0
    count = TURNS * SAMPLES[rate]
    t = np.arange(count) * 2.0 * np.pi / omega / SAMPLES[rate]
    speed = omega * (1.0 + WOBBLE * np.sin(omega / machine["pole_pairs"] * t))
    theta = rng.uniform(0.0, 2.0 * np.pi) + np.cumsum(speed) * (t[1] - t[0])
    phase = lambda angle: speed * machine["magnet_flux_wb"] * (np.sin(angle) + fifth * np.sin(5.0 * angle))  # noqa: E731
    u = phase(theta) - phase(theta - 2.0 * np.pi / 3.0)
    step = 2.0 * np.abs(u).max() / LEVELS
    u = step * np.round((u + 0.3 * step * rng.standard_normal(count)) / step)
    text = "\n".join(["t [s],u_ab [V]", *(f"{a:.7g},{b:.5g}" for a, b in zip(t, u, strict=True))]) + "\n"
    return Made(text, drive, Truth(tuple(causes)))


def cases() -> list[Case]:
    """A fifth harmonic needs more samples of a turn than the least."""
    return [
        case("emf", f"{drive}_{kind}_{rate}", lambda rng, k=kind, r=rate, d=drive: _run(k, r, d, rng))
        for drive in DRIVES
        for kind in KINDS
        for rate in SAMPLES
        if (kind, rate) != ("fifth", "few")
    ]
