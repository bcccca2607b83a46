# SPDX-License-Identifier: BSD-3-Clause
"""An angle that fails in steps: a magnet that slipped, an index on another edge, counts that are lost or too many.

Only what changes within a stretch of one speed and one current counts (flux_angle.py), at once (a step), with every
turn of the shaft (a drift) or within each electrical turn (uneven sectors), and is taken away.  A constant error is
left to the catalogue's encoder_offset, one that repeats with the shaft to encoder_eccentricity.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import wrapped
from fluxproof.diagnosis.checks.flux_angle import GAP, SHORTEST, changes, seen_flux, turn, width_of
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
DEGREE = np.pi / 180.0
LEAST_ROWS = 400
STEP, CLEAR = 3.0, 8.0  # degrees electrical; times the usual change between two sides
SHARP = 0.3  # of a step: most change within one side
MOST_STEPS = 4
DRIFT, MOST_DRIFT = 2.0, 30.0  # degrees electrical in the whole recording; in a turn: more is another number of poles
PARTS, ALIKE = 4, 0.35  # of the recording, whose drifts differ by at most this share
TWELFTHS = 12  # of a turn of the shaft
BINS, LIKE = 24, 0.9  # of an electrical turn; correlation of its course in the parts
UNEVEN = 1.0  # degrees electrical, rms, of orders that only sectors have
SECTORS, OF_EMF = (3, 4, 5), (0, 6, 12)  # orders 1 and 2 have other causes too, and 6 is that of the EMF


def check(recording, nominal) -> None:
    if recording.slow or recording.points or not recording.has("theta_e", "omega_e") or "angle" in recording.lacks:
        return
    if nominal.machine.magnet_flux_wb <= 0.0 or len(recording) < LEAST_ROWS or not recording.usable.any():
        return
    seen = seen_flux(recording, nominal)
    if seen is None:
        return
    _drift(recording, nominal, *changes(recording, nominal, *seen))
    _uneven(recording, nominal, *(seen_flux(recording, nominal) or seen))
    for _ in range(MOST_STEPS):
        flux, current = seen_flux(recording, nominal) or seen
        if not _step(recording, flux, changes(recording, nominal, flux, current)[0]):
            return


def _drift(recording, nominal, change, turns) -> None:
    """Take away an error that grows with every turn of the shaft, in both directions."""
    known = np.flatnonzero(np.isfinite(change))
    if len(known) < LEAST_ROWS:
        return
    shaft = np.append(0.0, np.cumsum(recording["omega_e"][:-1] * np.diff(recording["t"])))
    shaft = shaft / (2 * np.pi * nominal.machine.pole_pairs)
    each, part = change[known] / turns[known], np.floor(np.mod(shaft[known], 1.0) * TWELFTHS).astype(int) % TWELFTHS
    if (np.bincount(part, minlength=TWELFTHS) == 0).any():
        return
    # All parts of a turn count alike: an eccentric encoder that rises slowly and falls fast is falling in few rows.
    rate = float(np.mean([np.median(each[part == n]) for n in range(TWELFTHS)]))
    rates = [float(np.median(piece)) for piece in np.array_split(each, PARTS)]
    total = abs(rate) * np.abs(np.diff(shaft)).sum()
    if total < DRIFT * DEGREE or abs(rate) > MOST_DRIFT * DEGREE or max(abs(r / rate - 1.0) for r in rates) > ALIKE:
        return
    turn(recording, -rate * shaft)
    per_turn, bits = rate / DEGREE, nominal.sensors.position_bits
    turns = abs(per_turn) / (360.0 * nominal.machine.pole_pairs) * nominal.sensors.position_pole_pairs
    counts = turns * (2**bits if bits else 1.0)
    size = f"{counts:.2g} counts of {2**bits}" if bits else f"{1e6 * counts:.0f} ppm of the counts"
    message = (
        f"the angle {'gains' if rate > 0 else 'loses'} {abs(per_turn):.3g} degrees electrical with every turn of the "
        f"shaft ({size}): counts are lost or too many, or the counts of a turn are no multiple of the pole pairs"
    )
    recording.problems.append(Problem("angle_drift", message, "theta_e", 0, len(recording), "corrected"))


def _uneven(recording, nominal, flux: Complex, current: Complex) -> None:
    """Take away an error that depends on the angle alone, as that of Hall sensors in wrong places."""
    known = np.flatnonzero(np.isfinite(changes(recording, nominal, flux, current)[0]) & np.isfinite(flux))
    if len(known) < LEAST_ROWS:
        return
    width = width_of(recording["omega_e"], nominal.sample_time_s)[known]
    total = np.append(0.0, np.cumsum(np.where(np.isfinite(flux), flux, 0.0)))
    first, last = np.maximum(known - width, 0), np.minimum(known + width, len(flux))
    around = total[last] - total[first]  # over a turn
    bins = np.floor(np.mod(recording["theta_e"][known], 2 * np.pi) / (2 * np.pi) * BINS).astype(int) % BINS
    seen = flux[known] * np.conj(around)
    shapes = []
    for part in np.array_split(np.arange(len(known)), PARTS):
        sums = np.bincount(bins[part], seen[part].real, BINS) + 1j * np.bincount(bins[part], seen[part].imag, BINS)
        if not (np.abs(sums) > 0.0).all():
            return
        waves = np.fft.rfft(-np.angle(sums))
        waves[list(OF_EMF)] = 0.0
        shapes.append(waves)
    mean = np.mean(shapes, axis=0)
    rms = np.sqrt(2.0) * np.abs(mean) / BINS
    alike = min(np.real(np.vdot(x, mean)) / (np.linalg.norm(x) * np.linalg.norm(mean) + 1e-30) for x in shapes)
    if np.sqrt(np.sum(rms[list(SECTORS)] ** 2)) < UNEVEN * DEGREE or alike < LIKE:
        return
    shape = _between(mean, np.linspace(0.0, 2 * np.pi, 10 * BINS))
    turn(recording, -_between(mean, recording["theta_e"]))
    message = (
        f"the angle is uneven within the electrical turn, by {shape.min() / DEGREE:.3g} to {shape.max() / DEGREE:.3g} "
        "degrees electrical and alike in all turns: edges of Hall sensors, or what is interpolated between them"
    )
    recording.problems.append(Problem("angle_uneven", message, "theta_e", 0, len(flux), "corrected"))


def _between(waves, theta) -> np.ndarray:
    """The course at angles (n,) from the spectrum of its means over BINS, each of which weakens an order k by sinc."""
    order = np.arange(1, BINS // 2)
    whole = waves[order] / np.sinc(order / BINS) * np.exp(-1j * order * np.pi / BINS)  # from the middle of a bin
    unit, turned, course = np.exp(1j * theta), np.ones(len(theta), complex), np.zeros(len(theta))
    for wave in whole:
        turned *= unit
        course += 2.0 / BINS * np.real(wave * turned)
    return course


def _step(recording, flux, change) -> bool:
    """Take away the largest step of the error, in the shorter part of the recording; whether there is one."""
    known = np.isfinite(change)
    if known.sum() < LEAST_ROWS // 4:
        return False
    least = max(STEP * DEGREE, CLEAR * float(np.median(np.abs(change[known]))))
    left = np.where(known, np.abs(change), 0.0)
    while left.max() > least:
        at = int(np.argmax(left))
        size = float(change[at])
        jump = _jump(recording["theta_e"], at, size)
        if jump is not None and _sharp(flux, at, size):
            _take(recording, *jump)
            return True
        left[max(at - SHORTEST, 0) : at + SHORTEST] = 0.0
    return False


def _jump(theta, at: int, size: float) -> tuple[int, float] | None:
    """(row, exact size) of a jump of the recorded angle itself near ``at``, as no rotor makes; None without one."""
    near = np.arange(max(at - 2 * GAP, 1), min(at + 2 * GAP, len(theta)))
    ahead = wrapped(theta[near] - theta[near - 1])
    excess = ahead - np.median(ahead)
    if abs(excess.sum() - size) > SHARP * abs(size):
        return None
    return int(near[np.argmax(np.sign(size) * excess)]), float(excess.sum())


def _take(recording, at: int, size: float) -> None:
    """Turn the shorter part back; rows about the step are not used."""
    theta = recording["theta_e"]
    later = np.arange(len(theta)) >= at
    turned = later if later.sum() <= len(later) / 2 else ~later
    turn(recording, np.where(turned, -size if turned[-1] else size, 0.0))
    recording.usable[max(at - GAP, 0) : at + GAP] = False
    message = (
        f"at {recording['t'][at]:.6g} s the angle jumps by {size / DEGREE:.3g} degrees electrical against the "
        "voltages: the magnet or the coupling of the sensor slipped, or an index was taken on another edge"
    )
    recording.problems.append(Problem("angle_step", message, "theta_e", at, int(turned.sum()), "corrected"))


def _sharp(flux, at, size) -> bool:
    """Whether the change happens at once: a current that settles changes within the sides, too."""
    quarter = [flux[at + a : at + b] for a, b in ((-SHORTEST, -SHORTEST // 2), (-SHORTEST // 2, -GAP),
                                                  (GAP, SHORTEST // 2), (SHORTEST // 2, SHORTEST))]  # fmt: skip
    if any(not np.isfinite(part).any() for part in quarter):
        return False
    first, second, third, fourth = (np.nanmean(part) for part in quarter)
    within = max(abs(np.angle(first * np.conj(second))), abs(np.angle(third * np.conj(fourth))))
    return bool(within < SHARP * abs(size) and abs(np.angle(second * np.conj(third)) - size) < SHARP * abs(size))
