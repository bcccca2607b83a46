# SPDX-License-Identifier: BSD-3-Clause
"""Made-up slow logs: a drive known to the last digit behind a CAN bus that holds every value until its next message.

The machine is written down here once more, from its equations, so that nothing rests on how the diagnosis makes them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import Recording

DRIVE = ROOT / "docs" / "drives" / "emrax228.toml"
NOMINAL = load_nominal(DRIVE)
ROW_S = 0.029
MESSAGE_S = {"i": 0.5, "u": 0.2, "omega": 0.2}
HOLD_S, RAMP_S = 4.0, 1.0
LEVELS = [(w, q) for w in (-500.0, -900.0, -1400.0, -1800.0) for q in (0.0, -60.0, -120.0, -180.0)]


@dataclass(frozen=True)
class Truth:
    """What the log's drive has beyond the nominal one; ``noise_v`` and ``noise_a`` are those of a message."""

    v_dead: float = 0.0
    psi_m: float = NOMINAL.machine.magnet_flux_wb
    l_q: float = NOMINAL.machine.inductance_q_h
    offset: float = 0.0
    noise_v: float = 0.05
    noise_a: float = 0.1


def voltage(truth: Truth, i, omega):
    """Requested dq voltage [V] in the drive's own frame, which is ``offset`` ahead of the rotor."""
    m = NOMINAL.machine
    turned = i * np.exp(1j * truth.offset)
    psi = m.inductance_d_h * turned.real + truth.psi_m + 1j * truth.l_q * turned.imag
    u = (m.resistance_ohm * turned + 1j * omega * psi) * np.exp(-1j * truth.offset)
    # The fundamental of a square wave of v_dead in phase with each phase's current.
    return u + 4 / np.pi * truth.v_dead * np.where(np.abs(i) > 1.0, np.exp(1j * np.angle(i)), 0.0)


def log(truth: Truth = Truth(), levels=LEVELS, hold_s=HOLD_S, seed=0) -> Recording:
    """A slow recording that goes through the levels (speed [rad/s], i_q [A]) once, with ramps between."""
    generator = np.random.default_rng(seed)
    corners, points = [0.0], [levels[0]]
    for k, level in enumerate(levels):
        if k:
            corners.append(corners[-1] + RAMP_S)
            points.append(level)
        corners.append(corners[-1] + hold_s)
        points.append(level)
    t = np.arange(0.0, corners[-1], ROW_S)
    speed, load = (np.interp(t, corners, x) for x in zip(*points, strict=True))
    current = 1j * load
    u = voltage(truth, current, speed)
    columns = {"t": t, "u_dc": np.full(len(t), 400.0)}

    def sent(values, group, noise, late):
        number = np.floor((t + late) / MESSAGE_S[group]).astype(int)
        first = np.searchsorted(number, np.arange(number.max() + 1))
        heard = values[np.minimum(first, len(t) - 1)] + noise * generator.standard_normal(len(first))
        return heard[number]

    columns["i_d"] = sent(0.0 * load, "i", truth.noise_a, 0.0)
    columns["i_q"] = sent(load, "i", truth.noise_a, 0.0)
    columns["u_d_ref"] = sent(u.real, "u", truth.noise_v, 0.07)
    columns["u_q_ref"] = sent(u.imag, "u", truth.noise_v, 0.07)
    columns["omega_e"] = sent(speed, "omega", 0.02, 0.11)
    n = len(t)
    return Recording("made-up CAN log", columns, np.ones(n, bool), np.append(np.ones(n - 1, bool), False), slow=True)
