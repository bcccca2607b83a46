# SPDX-License-Identifier: BSD-3-Clause
"""The next recording: operating points that separate tied explanations best, also after a rival is refitted."""

from __future__ import annotations

import itertools
from dataclasses import fields

import numpy as np

from fluxproof.diagnosis.answer.bench_point import on_the_bench
from fluxproof.diagnosis.answer.experiment import BENDS, best_points, rivalry
from fluxproof.diagnosis.answer.phrases import SIGNALS, joined, title_of
from fluxproof.diagnosis.balance.cells import Projector, voltage_level
from fluxproof.diagnosis.balance.joined import stayed_cold
from fluxproof.diagnosis.balance.view import View
from fluxproof.diagnosis.effects import LEAST_CURRENT, Drift
from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.nominal import flux_level
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.ground.result import Request
from fluxproof.plant.transforms import linear_limit

ROWS = 200
SHOWN = 0.06  # share of an effect's longest column below which the recording does not show a coefficient
BLOCKS = 20  # independent blocks assumed in a dwell of half a second
MOST_REQUESTS = 3
# Share of D^2 that is given up to avoid an axis without current so far, whose parameters are unknown, and to avoid
# full speed and rated current, since unmodelled effects grow with both.
NEW_AXIS, STRAIN = 0.2, 0.2


def steady_view(view: View, omega, i_dq, cold: bool | np.ndarray = False, rows=ROWS) -> View:
    """A simulated view of steady operating points of the nominal drive: omega (b,) [rad/s], i_dq (b,) complex [A].

    cold: (b,) bool, points of a machine that has cooled down; at the others drifts keep their final values.
    """
    omega, i_dq = np.asarray(omega, float), np.asarray(i_dq, complex)
    period, b = view.sample_time_s, len(omega)
    cold = np.broadcast_to(cold, (b,))
    theta = 0.1 + omega[:, None] * period * np.arange(-1, rows + 2)
    steady = lambda x, n: np.repeat(np.asarray(x)[:, None], n, axis=1)  # noqa: E731
    i = steady(i_dq, rows + 1)
    u_dq = steady_voltage(view.machine, i_dq, omega, view.inductances(i_dq) + view.machine.magnet_flux_wb)
    middle = 0.5 * (theta[:, 1:] + theta[:, :-1])
    inner = theta[:, 1:-1]
    return view.replace(
        theta=inner,
        omega=steady(omega, rows + 1),
        i=i,
        i_raw=i * np.exp(1j * inner),
        i_abc=None,
        u=u_dq[:, None] * np.exp(1j * middle),
        u_dc=np.full((b, rows), float(view.nominal.inverter.dc_bus_v)),
        t=np.full(b, view.span_s),
        course=np.where(cold, 0.0, 1.0),
        temp=np.where(cold, _temperature(view, True), _temperature(view, False)),
        torque=np.full((b, rows), np.nan),
        slope_m=np.zeros((b, rows)),
        shaft=np.full(b, ""),
        psi_extra=0.0,
        memo={**view.memo, "top_speed": view.top_speed},
        run=np.arange(b),
        rows=np.zeros(b, int),
        lacks=None,
    )


def _temperature(view, cold):
    """Winding temperature of a further recording [degC], nan if none was recorded."""
    if not np.isfinite(view.temp).any():
        return np.nan
    return float(view.machine.temperature_ref_c if cold else view.temp[np.argmax(view.course)])


SPEEDS = (0.0, *(s * x for x in (0.1, 0.3, 0.6, 1.0, 1.2) for s in (1.0, -1.0)))  # of the highest recorded one
CURRENTS = (0.0, *(r * np.exp(1j * np.pi / 6 * n) for r in (0.25, 0.6, 1.0) for n in range(12)))  # of the rated one
REACHED = 0.5  # of the speed at which the EMF takes the available voltage: a speed that any drive can reach


def grid(view):
    """Candidate operating points (omega, i_dq) within the drive's voltage and near the recorded range."""
    _, top = limits(view)
    omega, i = np.meshgrid(top * np.array(SPEEDS), view.machine.rated_current_a * np.array(CURRENTS))
    omega, i = omega.ravel(), i.ravel()
    kept = within_limits(view)(omega, i)
    return omega[kept], i[kept]


def limits(view) -> tuple[float, float]:
    """(largest voltage [V], speed to which SPEEDS refer [rad/s])."""
    linear = linear_limit(view.nominal.inverter.dc_bus_v)
    u_max = np.clip(float(voltage_level(view).max()), 0.74 * linear, 0.9 * linear)
    return u_max, max(view.top_speed, REACHED * u_max / flux_level(view.machine))


def within_limits(view):
    """A function of (omega, i_dq), numbers or arrays: whether such points are within voltage, speed and current."""
    m, (u_max, top) = view.machine, limits(view)
    top, rated = 1.000001 * max(SPEEDS) * top, 1.000001 * m.rated_current_a

    def within(omega, i):
        u = steady_voltage(m, i, omega, view.inductances(i) + m.magnet_flux_wb)
        still = (omega == 0.0) & (i == 0.0)  # standstill without current gives no information
        return (np.abs(u) <= u_max) & (np.abs(omega) <= top) & (np.abs(i) <= rated) & ~np.asarray(still)

    return within


def new_axes(view, i) -> np.ndarray:
    """(n,) number of axes without current in the recording that have current at i (n,) [A]."""
    least, seen = LEAST_CURRENT * view.machine.rated_current_a, view.i.mean(axis=1)
    quiet = [part for part in (np.real, np.imag) if np.abs(part(seen)).max() < least]
    return sum((np.abs(part(i)) >= least for part in quiet), np.zeros(len(i)))


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
        shown = seen.get(key_a, 0.0) > SHOWN * max(seen.values(), default=0.0)
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
        least = SHOWN * max(mine.values(), default=0.0)
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


def requests(setup, fits, noise_v, cold=False) -> list[Request]:
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
    pairs = list(itertools.permutations(range(len(solutions)), 2))
    rivals = [rivalry(predictions[a], predictions[b], *knows[b], sigma, p.block, len(omega)) for a, b in pairs]
    effort = (omega / np.abs(omega).max()) ** 2 + np.abs(i / view.machine.rated_current_a) ** 2
    chosen = best_points(rivals, MOST_REQUESTS, NEW_AXIS * new_axes(view, i), STRAIN * effort)
    out, within = [], within_limits(view)
    for k in chosen:
        each = [r.left([k]) for r in rivals]
        worst = pairs[int(np.argmax(each))]
        first, second = (set(solutions[n].names) for n in worst)
        names = sorted(first ^ second) or sorted(first | second)
        speed, current = on_the_bench(float(omega[k]), complex(i[k]), view.machine, within)
        out.append(
            Request(
                speed,
                current.real,
                current.imag,
                names,
                _why(p, k, predictions, worst, solutions, effects, drive) + (COLD if cooled[k] else ""),
                float(drive),
                float(view.machine.temperature_ref_c) if cooled[k] else None,
            )
        )
    return out


COLD = ", once the machine has cooled down (record temp_winding)"


def _why(p, k, predictions, pair, solutions, effects, most):
    """What differs at candidate k between what is open: the effects that only one of the two sets contains.

    most: the bus voltage [V]; a prediction above it is beyond the drive, so that its size is left out.
    """
    at = p.ok & (p.block == k) & (p.channel == "u")
    sets = [set(solutions[n].names) for n in pair]
    only = [sorted(title_of(n, effects) for n in mine - other) for mine, other in (sets, sets[::-1])]
    a, b = (f"'{joined(titles)}'" if titles else "nothing in its place" for titles in only)
    difference = np.where(at, np.abs(predictions[pair[0]] - predictions[pair[1]]), 0.0)
    row = int(np.argmax(difference))
    order = f"order {abs(p.order[row]):.4g} of the " if p.order[row] else ""
    size = f" by {ascii_of(quantity(float(difference[row]), 'V', 2))}" if difference[row] <= most else ""
    return f"the {order}{SIGNALS['u_' + 'dq'[p.part[row]]]} differs{size} between {a} and {b}"
