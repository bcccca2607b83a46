# SPDX-License-Identifier: BSD-3-Clause
"""The next recording: operating points that separate tied explanations best, also after a rival is refitted."""

from __future__ import annotations

import itertools
from dataclasses import fields

import numpy as np

from fluxproof.diagnosis.balance.cells import Projector, voltage_level
from fluxproof.diagnosis.balance.joined import stayed_cold
from fluxproof.diagnosis.balance.view import View
from fluxproof.diagnosis.effects import Drift
from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.plan.bench_point import on_the_bench
from fluxproof.diagnosis.plan.candidates import grid, new_axes, steady_view, within_limits
from fluxproof.diagnosis.plan.experiment import BENDS, best_points, rivalry
from fluxproof.diagnosis.plan.planned import Difference, Planned

BLOCKS = 20  # independent blocks assumed in a dwell of half a second
MOST_REQUESTS = 3
# Share of D^2 that is given up to avoid an axis without current so far, whose parameters are unknown, and to avoid
# full speed and rated current, since unmodelled effects grow with both.
NEW_AXIS, STRAIN = 0.2, 0.2
SAME_PREDICTION = 1e-3  # of a prediction: what is left of it where two sets of formulas are the same


def columns_at(p, view, effect) -> dict:
    """Rows {coefficient: (r,)} of an effect's core and free columns at the blocks of a view."""
    return {key: p.rows(column) for key, column in effect.columns(view).items()}


def known_of(fit, columns) -> np.ndarray:
    """Information matrix (k, k) of the recording about a set's coefficients, in its effects' freest form.

    columns: {(effect, coefficient): rows at the candidates}, which bound coefficients that the recording does not
    determine.
    """
    problem = fit.problem
    p = problem.p
    place = {(n, key): j for j, (n, key) in enumerate(problem.keys)}
    weight = 1.0 / np.sqrt(fit.variance)
    x = p.x * weight[:, None]
    length = np.linalg.norm(x, axis=0)
    c = determined(fit)
    out = np.zeros((len(columns),) * 2)
    for a, key_a in enumerate(columns):
        mine = [key for key in columns if key[0] == key_a[0]]
        seen = {key: length[place[key]] for key in mine if key in place and length[place[key]] > 1e-9}
        # Within the recorded range at most as large as the effect itself; beyond it a curve over speed may be larger.
        shown = seen.get(key_a, 0.0) > constants.SHOWN * max(seen.values(), default=0.0)
        size = seen if shown else {key: np.linalg.norm(columns[key]) for key in mine}
        own = sum(abs(c[n].get(key, 0.0)) * size[n, key] for n, key in size)
        out[a, a] += (size[key_a] / (BENDS * own + 1e-12 * size[key_a] + 1e-30)) ** 2
        for b, key_b in enumerate(columns):
            if key_a in place and key_b in place:
                out[a, b] += x[:, place[key_a]] @ x[:, place[key_b]]
    return out


def determined(fit) -> dict:
    """{effect: {coefficient: value}} of a fit without the free coefficients that the recording does not show.

    At a locked rotor the share of a resistance that rises with speed is noise, which no speed may multiply.
    """
    problem, out = fit.problem, {n: dict(c) for n, c in fit.c.items()}
    length = np.linalg.norm(problem.p.x / np.sqrt(fit.variance)[:, None], axis=0)
    for n, c in out.items():
        mine = {key: length[j] for j, (name, key) in enumerate(problem.keys) if name == n}
        least = constants.SHOWN * max(mine.values(), default=0.0)
        for key in [k for k, size in mine.items() if (n, k) in problem.cells.free and size <= least]:
            c.pop(key, None)
    return out


def wants_cold(names, effects, view) -> bool:
    """Whether a cold machine separates the names: a drift then vanishes, and the other effects do not.

    Two drifts would both vanish; they are separated by the load on the warm machine.  If the winding stayed cold while
    something drifted, its temperature cannot show that the drift has vanished.
    """
    drifting = [isinstance(effects[n], Drift) for n in names]
    return any(drifting) and not all(drifting) and not stayed_cold(view)


def requests(setup, fits, noise_v, cold=False) -> tuple[Planned, ...]:
    """Up to MOST_REQUESTS operating points that together separate the sets of ``fits`` best, the best one first.

    cold: points of a machine that has cooled down are candidates too.
    """
    solutions, effects = fits, setup.effects
    view = View(**{f.name: getattr(setup.view, f.name) for f in fields(View)}).replace(mean_duty=None)
    omega, i = grid(view)
    if cold:  # each point is a candidate warm and cold
        omega, i = np.tile(omega, 2), np.tile(i, 2)
    cooled = np.arange(len(omega)) >= len(omega) // 2 if cold else np.zeros(len(omega), bool)
    made = steady_view(view, omega, i, cooled)
    p = Projector(made)
    drive = view.nominal.inverter.dc_bus_v
    balance = constants.BALANCE_U * voltage_level(made) + constants.BALANCE_DC * drive
    own = np.hypot(noise_v, balance)[p.block] / np.sqrt(BLOCKS)
    sigma = np.where(p.ok & (p.channel == "u"), own, np.inf)
    of = {n: columns_at(p, made, effects[n]) for s in solutions for n in s.names}
    predictions: list[np.ndarray] = []
    knows: list[tuple[np.ndarray, np.ndarray]] = []
    for s in solutions:
        parts = (v * of[n][k] for n, c in determined(s).items() for k, v in c.items() if k in of[n])
        predictions.append(sum(parts, np.zeros(len(p.ok))))
        columns = {(n, k): column for n in sorted(s.names) for k, column in of[n].items() if column.any()}
        stack = np.array(list(columns.values())).reshape(len(columns), len(p.ok))
        knows.append((stack, known_of(s, columns)))
    formulas = [_formulas(s, of) for s in solutions]
    seen, pairs = np.isfinite(sigma), list(itertools.permutations(range(len(solutions)), 2))
    pairs = [(a, b) for a, b in pairs if any(_differ(formulas[m], formulas[n], seen) for m, n in ((a, b), (b, a)))]
    if not pairs:
        return ()
    rivals = [rivalry(predictions[a], predictions[b], *knows[b], sigma, p.block, len(omega)) for a, b in pairs]
    effort = (omega / np.abs(omega).max()) ** 2 + np.abs(i / view.machine.rated_current_a) ** 2
    chosen = best_points(rivals, MOST_REQUESTS, NEW_AXIS * new_axes(view, i), STRAIN * effort)
    out, within = [], within_limits(view)
    for k in chosen:
        each = [r.left([k]) for r in rivals]
        worst = pairs[int(np.argmax(each))]
        first, second = (set(solutions[n].names) for n in worst)
        names = tuple(sorted(first ^ second) or sorted(first | second))
        speed, current = on_the_bench(float(omega[k]), complex(i[k]), view.machine, within)
        only = tuple(sorted(first - second)), tuple(sorted(second - first))
        why = _difference(p, k, predictions[worst[0]] - predictions[worst[1]], only, drive)
        temperature = float(view.machine.temperature_ref_c) if cooled[k] else None
        out.append(Planned(speed, current, names, why, float(drive), temperature))
    return tuple(out)


def _formulas(fit, of) -> tuple[np.ndarray, np.ndarray]:
    """(prediction (r,), columns (k, r)) at the candidates of a set's formulas without their free curves."""
    used = {(n, key): v for n, c in fit.c.items() for key, v in c.items()
            if v and key in of[n] and (n, key) not in fit.problem.cells.free}  # fmt: skip
    rows = len(next(iter(next(iter(of.values())).values())))
    columns = np.array([of[n][key] for n, key in used]).reshape(len(used), rows)
    return np.array(list(used.values())) @ columns, columns


def _differ(first, second, seen) -> bool:
    """Whether no size of the second set's formulas predicts what the first predicts at the rows ``seen``.

    A factor on all currents and one on R, L_d and L_q predict the same everywhere: no point separates them.
    """
    wanted, columns = first[0][seen], second[1][:, seen].T
    left = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return bool(np.linalg.norm(left) > SAME_PREDICTION * np.linalg.norm(wanted))


def _difference(p, k, difference, only, most) -> Difference:
    """What differs most at candidate k; difference: (r,) of two predictions [V].

    most: the bus voltage [V]; a prediction above it is beyond the drive, so that its size is left out.
    """
    at = p.ok & (p.block == k) & (p.channel == "u")
    sizes = np.where(at, np.abs(difference), 0.0)
    row = int(np.argmax(sizes))
    size = float(sizes[row])
    return Difference(float(abs(p.order[row])), int(p.part[row]), size if size <= most else None, only)
