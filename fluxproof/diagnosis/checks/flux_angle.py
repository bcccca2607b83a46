# SPDX-License-Identifier: BSD-3-Clause
"""Where the flux of the machine is, seen from the recorded angle (not itself a check).

The active flux psi + (L_d - L_q) i_d lies on the d axis, and the voltage shows where it is,

    (u - R i - L_q di/dt) / (j omega) = [psi + (L_d - L_q) i_d] exp(-j delta)

with the error delta of the angle.  Wrong constants turn it too, but alike before and after at one operating point.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import wrapped
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.plant.transforms import space_vector

FAST = 0.2  # of the largest speed: below it the voltage shows little of the flux
SIDE, SHORTEST, LONGEST = 0.5, 24, 400  # electrical turns on either side of a row; the same in rows
GAP = 4  # rows between the two sides
WHOLE = 0.9  # share of the rows of a side that are usable
SAME_SPEED, SAME_CURRENT = 0.03, 0.08  # of the largest speed, of rated current


def seen_flux(recording, nominal) -> tuple[Complex, Complex] | None:
    """(active flux [Wb], current [A]) of each row (n,) as seen from the recorded angle; nan where it is unknown."""
    columns, m, period = recording.columns, nominal.machine, nominal.sample_time_s
    delay, n = nominal.control.duty_applied_after_samples, len(recording)
    theta = columns["theta_e"]
    axis = np.exp(1j * theta)
    if recording.has("i_a", "i_b", "d_a", "d_b", "d_c", "u_dc"):
        i_c = columns.get("i_c", -columns["i_a"] - columns["i_b"])
        current: Complex = space_vector(np.stack([columns["i_a"], columns["i_b"], i_c], axis=1))
        duties = np.stack([columns[name] for name in ("d_a", "d_b", "d_c")], axis=1)
        voltage, stator = columns["u_dc"] * space_vector(np.roll(duties, delay, axis=0)), True
    elif recording.has("i_d", "i_q", "u_d_ref", "u_q_ref"):
        current = (columns["i_d"] + 1j * columns["i_q"]) * axis
        voltage, stator = np.roll(columns["u_d_ref"] + 1j * columns["u_q_ref"], delay), False
    else:
        return None
    after = np.append(np.arange(1, n), n - 1)
    middle = np.exp(1j * (theta + 0.5 * wrapped(theta[after] - theta)))
    voltage = voltage / middle if stator else voltage
    inductive = m.inductance_q_h * (current[after] - current) / period
    left = voltage - (0.5 * m.resistance_ohm * (current[after] + current) + inductive) / middle
    omega = columns["omega_e"]
    good = recording.usable & recording.joined & (np.abs(omega) > FAST * np.percentile(np.abs(omega), 98))
    good[:delay] = False
    flux = np.where(good, left / np.where(good, 1j * omega, 1.0), np.nan)
    return flux, np.where(good, current / axis, np.nan)


def changes(recording, nominal, flux: Complex, current: Complex) -> tuple[np.ndarray, np.ndarray]:
    """(change of delta [rad] from before each row to behind it, nan where the operating point changes too, turns)."""
    n, omega, m = len(flux), recording["omega_e"], nominal.machine
    width = width_of(omega, nominal.sample_time_s)
    rows = np.arange(n)
    ends = [np.clip(x, 0, n) for x in (rows - GAP - width, rows - GAP, rows + GAP, rows + GAP + width)]
    known = np.isfinite(flux)

    def means(values) -> np.ndarray:
        total = np.append(0.0, np.cumsum(np.where(known, values, 0.0)))
        return np.stack([total[ends[1]] - total[ends[0]], total[ends[3]] - total[ends[2]]]) / width

    share = means(1.0)
    some = np.maximum(share, 0.5)
    before, behind = means(flux) / some
    i_before, i_behind = i = means(current) / some
    change = np.angle(before * np.conj(behind))  # the error delta turns the flux back
    # The control holds the current that it sees, or that of the machine stays.
    moved = np.minimum(np.abs(i_behind - i_before), np.abs(i_behind - i_before * np.exp(-1j * change)))
    spread = np.sqrt(np.maximum(means(np.abs(current) ** 2) / some - np.abs(i) ** 2, 0.0)).max(axis=0)
    speed = means(omega) / some
    same = (share > WHOLE).all(axis=0) & (np.maximum(moved, spread) < SAME_CURRENT * m.rated_current_a)
    same &= np.abs(speed[1] - speed[0]) < SAME_SPEED * np.abs(omega).max()
    turns = speed.mean(axis=0) * nominal.sample_time_s * (width + 2 * GAP) / (2 * np.pi * m.pole_pairs)
    return np.where(same, change, np.nan), turns


def width_of(omega, period) -> np.ndarray:
    """Rows (n,) of a side."""
    whole = 2 * np.pi / np.maximum(np.abs(omega) * period, 1e-9)
    return np.clip(np.round(SIDE * whole), SHORTEST, LONGEST).astype(int)


def turn(recording, by) -> None:
    """Add by (n,) [rad] to the angle, and turn what is recorded in its frame."""
    columns = recording.columns
    columns["theta_e"] = columns["theta_e"] + by
    for real, imaginary in (("i_d", "i_q"), ("i_d_ref", "i_q_ref"), ("u_d_ref", "u_q_ref")):
        if recording.has(real, imaginary):
            turned: Complex = (columns[real] + 1j * columns[imaginary]) * np.exp(-1j * by)
            columns[real], columns[imaginary] = turned.real, turned.imag
