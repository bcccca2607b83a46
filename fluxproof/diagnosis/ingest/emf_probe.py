# SPDX-License-Identifier: BSD-3-Clause
"""EMF runs with one probe, or with few samples of an electrical turn: a sine fit in place of the samples.

Without current a terminal voltage is the speed times a periodic function of the rotor's angle,

    u = omega Re sum_k c_k exp(j k phi),   k = 1, 5, 7, 11, 13 (of a phase also 3, 9),   d phi / dt = |omega|

so that samples of many turns, folded on the angle, show a turn in full, also at two and a half samples a turn.  phi
follows from the recording alone: the largest line of its spectrum in short segments, then the phase of the
fundamental.  The c_k are fitted anew in windows of TURNS turns, so that their scatter is what noise does; a window is
one observation, of which one block is enough.  Orders that the samples show at the same frequency as a lower one are
not fitted: what a wandering speed leaves of the fundamental would be told as a harmonic.  Phases that were not probed
are those that were, a third of a turn later: of a machine whose phases are alike the same, of any other its mean.
"""

from __future__ import annotations

from itertools import compress

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.ingest.demand import LINE_VOLTAGES, PHASE_VOLTAGES
from fluxproof.plant.transforms import AXES

LEAST_PER_TURN = 2.5  # samples of an electrical turn: at two the amplitude and the phase cannot be told apart
TURNS = 8  # of a window in which the shape is fitted
SHORTEST = 3.0  # turns of a stretch that is fitted
SEGMENT = 64  # least samples of a spectrum
ROWS = 3.0  # samples per fitted number
APART = 0.5  # orders between the frequencies at which the samples show two harmonics; nearer ones are aliases
DENSE = 8  # samples of a period of the highest order that are made
ORDERS = {LINE_VOLTAGES: (1, 5, 7, 11, 13), PHASE_VOLTAGES: (1, 3, 5, 7, 9, 11, 13)}
LEFT = 0.5  # of the voltage that a fit may leave: with more there is no sine wave
POOR = 2.0  # times what the median window leaves: the speed jumps in it
LEAST_LEFT = 0.01  # of the voltage: what less is left is no reason to drop a window
REFINED = 3  # times that the phase is corrected
QUIET = 0.2  # of the largest amplitude: what is smaller is standstill, or a speed that changes within few turns


def probed(columns: dict) -> tuple[str, ...]:
    """The terminal voltages among the columns: those of the lines if there are any."""
    for names in (LINE_VOLTAGES, PHASE_VOLTAGES):
        if found := tuple(name for name in names if name in columns):
            return found
    return ()


def from_fit(path, columns: dict, pieces: list[tuple[int, int]]) -> tuple[dict, np.ndarray]:
    """(columns at a dense time with all three voltages from fits, times (w,) at which a window begins).

    columns: canonical arrays (n,) with t; pieces: (begin, end) of the parts without a gap.
    Raises RecordingError if no piece has SHORTEST turns with LEAST_PER_TURN samples.
    """
    found = probed(columns)
    names = LINE_VOLTAGES if found[0] in LINE_VOLTAGES else PHASE_VOLTAGES
    backward = "omega_e" in columns and float(np.nanmedian(columns["omega_e"])) < 0.0
    parts, per_turn = [], []
    first = columns[found[0]]
    stretches = [(a + c, a + d) for a, b in pieces for c, d in _turning(first[a:b])]
    runs = [(a + c, a + d) for a, b in stretches for c, d in _steady(columns["t"][a:b], first[a:b], ORDERS[names])]
    for a, b in runs:
        t, u = columns["t"][a:b], np.stack([columns[name][a:b] for name in found])
        phi = _phase(t, u[0] - u[0].mean())
        if phi is None or phi[-1] - phi[0] < 2 * np.pi * SHORTEST:
            continue
        per_turn.append(2 * np.pi * len(t) / (phi[-1] - phi[0]))
        if per_turn[-1] >= LEAST_PER_TURN:
            parts.append(_made(t, u, phi, ORDERS[names], [names.index(name) for name in found], backward))
    parts = [part for part in parts if part is not None]
    if not parts:
        raise RecordingError(f"{path}: {_too_little(per_turn, found)}")
    made = {"t": np.concatenate([p[0] for p in parts])}
    values = np.concatenate([p[1] for p in parts], axis=1)
    made |= {name: values[k] for k, name in enumerate(names)}
    others = [name for name in columns if name not in (*LINE_VOLTAGES, *PHASE_VOLTAGES, "t")]
    made |= {name: np.interp(made["t"], columns["t"], columns[name]) for name in others}
    return made, np.concatenate([p[2] for p in parts])


def _too_little(per_turn: list[float], found: tuple[str, ...]) -> str:
    if not per_turn or max(per_turn) >= LEAST_PER_TURN:
        return f"{' and '.join(found)}: no sine wave of {SHORTEST:g} turns is seen: record longer, at a steady speed"
    return (
        f"{max(per_turn):.3g} samples of an electrical turn of the terminal voltages, {LEAST_PER_TURN:g} are needed: "
        "record more often, or spin more slowly"
    )


def _turning(u) -> list[tuple[int, int]]:
    """(begin, end) of the stretches of u (n,) in which the machine turns fast enough to be seen."""
    if len(u) < SEGMENT:
        return []
    length = min(len(u), max(SEGMENT, int(TURNS / _peak(u))))
    power = np.convolve((u - u.mean()) ** 2, np.ones(length) / length, "same")
    loud = np.concatenate([[False], power > QUIET**2 * power.max(), [False]])
    begins, ends = np.flatnonzero(loud[1:] & ~loud[:-1]), np.flatnonzero(~loud[1:] & loud[:-1])
    return [(a, b) for a, b in zip(begins, ends, strict=True) if b - a >= SEGMENT]


def _steady(t, u, orders) -> list[tuple[int, int]]:
    """(begin, end) of the runs of windows that a fit describes: a jump of the speed spoils the phase on both sides."""
    phi = _phase(t, u - u.mean())
    if phi is None or phi[-1] - phi[0] < 2 * np.pi * SHORTEST:
        return [(0, len(t))]
    omega, windows = np.gradient(phi, t), _windows(phi, TURNS)
    left = np.array([_fit(phi[a:b], omega[a:b], u[a:b], orders)[1] for a, b in windows])
    good = np.concatenate([[False], _described(left), [False]])
    begins, ends = np.flatnonzero(good[1:] & ~good[:-1]), np.flatnonzero(~good[1:] & good[:-1])
    return [(windows[a][0], windows[b - 1][1]) for a, b in zip(begins, ends, strict=True)] or [(0, len(t))]


def _described(left) -> np.ndarray:
    """Whether windows whose fits leave the share ``left`` (w,) of the voltage are no worse than usual, (w,) bool."""
    return left <= max(POOR * float(np.median(left)), LEAST_LEFT)


def _phase(t, u) -> np.ndarray | None:
    """Phase of the fundamental of u (n,) at each sample, rising [rad]; None without one."""
    length = min(len(t), max(SEGMENT, int(TURNS / _peak(u))))
    begins = np.arange(0, len(t) - length + 1, max(length // 4, 1))
    step = np.median(np.diff(t))
    speed = np.interp(t, t[begins + length // 2], [2 * np.pi * _peak(u[k : k + length]) / step for k in begins])
    phi = np.concatenate([[0.0], np.cumsum(np.diff(t) * 0.5 * (speed[1:] + speed[:-1]))])
    for _ in range(REFINED):
        phi = phi + _correction(phi, u)
    return phi if (np.diff(phi) > 0.0).all() else None


def _peak(u) -> float:
    """Frequency of the largest line of a spectrum, in cycles per sample; between lines by a parabola."""
    size = 4 * len(u)
    line = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(len(u)), size))
    line[: 4 * 2] = 0.0  # the mean, and what is slower than two turns of the segment
    k = int(np.clip(np.argmax(line), 1, len(line) - 2))
    a, b, c = line[k - 1 : k + 2]
    bend = a - 2 * b + c
    return (k + (0.5 * (a - c) / bend if bend else 0.0)) / size


def _correction(phi, u) -> np.ndarray:
    """What the phase of the fundamental in windows of TURNS / 2 turns differs by, (n,) [rad]."""
    windows = _windows(phi, TURNS / 2)
    turned = []
    for a, b in windows:
        basis = np.stack([np.cos(phi[a:b]), -np.sin(phi[a:b]), np.ones(b - a)], axis=1)
        re, im, _ = np.linalg.lstsq(basis, u[a:b], rcond=None)[0]
        turned.append(complex(re, im))
    centre = [0.5 * (phi[a] + phi[b - 1]) for a, b in windows]
    return np.interp(phi, centre, np.unwrap(np.angle(turned)))


def _windows(phi, turns: float) -> list[tuple[int, int]]:
    """(begin, end) of windows of about ``turns`` turns that cover all samples."""
    count = max(1, round((phi[-1] - phi[0]) / (2 * np.pi * turns)))
    edges = np.searchsorted(phi, np.linspace(phi[0], phi[-1], count + 1))
    edges[0], edges[-1] = 0, len(phi)
    return [(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if b - a >= 2 * ROWS]


def _made(t, u, phi, orders, places, backward: bool):
    """(times (m,), three voltages (3, m), beginnings of the windows (w,)) of the fits of u (count, n).

    Windows whose fit is poor are left out, so that there is a gap in their place; None if the median one is no sine.
    """
    omega = np.gradient(phi, t)
    step = min(float(np.median(np.diff(t))), 2 * np.pi / (DENSE * orders[-1]) / float(omega.max()))
    at = t[0] + step * np.arange(int((t[-1] - t[0]) / step) + 1)
    angle, fast = np.interp(at, t, phi), np.interp(at, t, omega)
    third = float(np.angle(AXES[1])) * (-1 if backward else 1)
    windows = _windows(phi, TURNS)
    fits = [[_fit(phi[a:b], omega[a:b], one[a:b], orders) for one in u] for a, b in windows]
    left = np.array([max(rest for _, rest in window) for window in fits])
    if np.median(left) > LEFT:
        return None
    good = _described(left)
    out = np.full((3, len(at)), np.nan)
    for (a, b), window in zip(compress(windows, good), compress(fits, good), strict=True):
        inside = (at >= t[a]) & ((at < t[b]) if b < len(t) else True)
        for k in range(3):
            shape = window[places.index(k) if k in places else 0][0]
            later = 0.0 if k in places else third * (k - places[0])
            out[k, inside] = _value(shape, angle[inside] - later) * fast[inside]
    known = np.isfinite(out[0])
    return at[known], out[:, known], t[[a for a, _ in windows]]


def _fit(phi, speed, u, orders) -> tuple[dict[int, complex], float]:
    """({order: c [V s]}, share that is left) of one window, of as many orders as its samples can tell apart."""
    orders = _told_apart(orders, 2 * np.pi * (len(phi) - 1) / (phi[-1] - phi[0]))
    orders = orders[: max(int((len(phi) / ROWS - 1) / 2), 1)]
    waves = np.exp(1j * np.outer(phi, orders)) * speed[:, None]
    basis = np.concatenate([waves.real, -waves.imag, np.full((len(phi), 1), speed.mean())], axis=1)
    c = np.linalg.lstsq(basis, u, rcond=None)[0]
    m, free = len(orders), max(len(u) - basis.shape[1], 1)
    rest = float(np.linalg.norm(u - basis @ c) / np.sqrt(free) / max(np.std(u), 1e-30))
    return {order: complex(c[k], c[m + k]) for k, order in enumerate(orders)}, rest


def _told_apart(orders, per_turn: float) -> list[int]:
    """The orders that ``per_turn`` samples of a turn show at another frequency than the mean and every lower order."""
    kept, seen = [], [0.0]
    for order in orders:
        at = abs(order - per_turn * round(order / per_turn))
        if order == 1 or all(abs(at - other) >= APART for other in seen):
            kept.append(order)
            seen.append(at)
    return kept


def _value(shape: dict[int, complex], phi) -> np.ndarray:
    return np.sum([(c * np.exp(1j * order * phi)).real for order, c in shape.items()], axis=0)
