"""Which recording would tell tied explanations apart: the operating points at which they differ most."""

from __future__ import annotations

import itertools

import numpy as np

from diagnosis.cells import Projector
from diagnosis.result import Request

ROWS = 200
ENOUGH = 50.0  # squared distance, in standard deviations, that counts as told apart
MOST = 4


def steady_view(view, omega, i_dq, cold=False, rows=ROWS):
    """A view of made-up steady operating points of the nominal drive: omega (b,) [rad/s], i_dq (b,) complex [A].

    cold: of a machine that has cooled down; otherwise slow changes stand where the recording ended.
    """
    omega, i_dq = np.asarray(omega, float), np.asarray(i_dq, complex)
    period, b = view.sample_time_s, len(omega)
    theta = 0.1 + omega[:, None] * period * np.arange(-1, rows + 2)
    steady = lambda x, n: np.repeat(np.asarray(x)[:, None], n, axis=1)  # noqa: E731
    i = steady(i_dq, rows + 1)
    psi = view.inductances(i_dq) + view.machine.magnet_flux_wb
    u_dq = view.machine.resistance_ohm * i_dq + 1j * omega * psi
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
        course=np.full(b, 0.0 if cold else 1.0),
        temp=np.full(b, _temperature(view, cold)),
        torque=np.full((b, rows), np.nan),
        slope_m=np.zeros((b, rows)),
        shaft=np.full(b, ""),
        psi_extra=0.0,
        memo=dict(view.memo),
        run=np.arange(b),
        rows=np.zeros(b, int),
    )


def _temperature(view, cold):
    """Winding temperature of a further recording [degC], nan where none was recorded."""
    if not np.isfinite(view.temp).any():
        return np.nan
    return float(view.machine.temperature_ref_c if cold else view.temp[np.argmax(view.course)])


def grid(view):
    """Operating points that the drive can run: (omega, i_dq), within its voltage and what was recorded."""
    m = view.machine
    rated = m.rated_current_a
    u_max = 0.9 * view.nominal.inverter.dc_bus_v / np.sqrt(3)
    top = max(float(np.abs(view.omega).max()), 0.25 * u_max / m.magnet_flux_wb)
    points = []
    for share, q, d in itertools.product(
        (0.0, 0.1, -0.1, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0), (0.0, 0.5, -0.5, 1.0, -1.0), (0.0, -0.5, 0.5)
    ):
        omega, i = share * top, rated * (d + 1j * q)
        u = m.resistance_ohm * i + 1j * omega * (view.inductances(np.array(i)) + m.magnet_flux_wb)
        if abs(i) <= 1.2 * rated and abs(u) < u_max:
            points.append((omega, i))
    return np.array([p[0] for p in points]), np.array([p[1] for p in points])


def predictions(view, solution, effects):
    """What a solution adds to the misfit of a view, as rows (r,), and the standard deviation of it (r,)."""
    p = Projector(view)
    total, variance = np.zeros(len(p.ok)), np.zeros(len(p.ok))
    for name, c in solution.c.items():
        effect = effects[name]
        columns = {**effect.core(view), **effect.free(view)}
        rows = np.array([p.rows(columns[key]) if key in columns else np.zeros(len(p.ok)) for key in c])
        total += np.array(list(c.values())) @ rows
        variance += np.einsum("ir,ij,jr->r", rows, solution.covariance[name], rows)
    return p, total, np.sqrt(np.maximum(variance, 0.0))


DRIFTS = {"magnet_temperature", "resistance_temperature"}


def wants_cold(names) -> bool:
    """Whether a machine that has cooled down tells the names apart: a drift has gone then, all else has not.

    Two drifts have then gone both: they are told apart while the machine is warm, by the load.
    """
    names = set(names)
    return bool(DRIFTS & names) and not names <= DRIFTS


def requests(view, solutions, effects, noise_v, cold=False) -> list[Request]:
    """Operating points that separate the tied solutions best, the most telling first; empty where none does.

    cold: ask for a machine that has cooled down.
    """
    omega, i = grid(view)
    made = steady_view(view, omega, i, cold)
    rows = [predictions(made, s, effects) for s in solutions]
    p = rows[0][0]
    pairs = list(itertools.combinations(range(len(solutions)), 2))
    own = np.hypot(noise_v, 3e-4 * view.nominal.inverter.dc_bus_v)
    distance = np.zeros((len(pairs), len(omega)))
    for n, (a, b) in enumerate(pairs):
        difference = rows[a][1] - rows[b][1]
        weight = np.where(
            p.ok & (p.channel == "u"), 1.0 / (own**2 + 0.25 * (rows[a][2] ** 2 + rows[b][2] ** 2)), 0.0
        )
        np.add.at(distance[n], p.block, weight * difference**2)
    out, reached = [], np.zeros(len(pairs))
    while len(out) < MOST and (reached < ENOUGH).any():
        open_pairs = reached < ENOUGH
        near = distance[open_pairs]
        gain = np.minimum(near, ENOUGH).sum(axis=0) + 1e-3 * np.sqrt(near).sum(axis=0)  # the clearest of equals
        k = int(np.argmax(gain))
        told = open_pairs & (distance[:, k] >= 9.0)
        if not told.any():
            break
        reached = reached + np.minimum(distance[:, k], ENOUGH)
        names = sorted({x for n in np.flatnonzero(told) for s in pairs[n] for x in solutions[s].model.names})
        worst = pairs[int(np.argmax(np.where(told, distance[:, k], -1)))]
        out.append(
            Request(
                float(omega[k]),
                float(i[k].real),
                float(i[k].imag),
                names,
                _why(made, k, rows, worst, solutions) + (COLD if cold else ""),
                float(view.nominal.inverter.dc_bus_v),
                float(view.machine.temperature_ref_c) if cold else None,
            )
        )
        distance[:, k] = 0.0
    return out


COLD = ", once the machine has cooled down (record temp_winding)"


def default_request(view, names, effects) -> Request:
    """A spin without current at the highest speed, where no computed point separates the names: with the reasons."""
    cold = wants_cold(names)
    top = float(np.abs(view.omega).max())
    why = "; ".join(f"{n}: {effects[n].separated_by}" for n in names)
    return Request(
        top,
        0.0,
        0.0,
        names,
        why + (COLD if cold else ""),
        float(view.nominal.inverter.dc_bus_v),
        float(view.machine.temperature_ref_c) if cold else None,
    )


def _why(view, k, rows, pair, solutions):
    p = rows[0][0]
    at = p.ok & (p.block == k) & (p.channel == "u")
    a, b = (" with ".join(sorted(solutions[n].model.names)) for n in pair)
    difference = np.where(at, np.abs(rows[pair[0]][1] - rows[pair[1]][1]), 0.0)
    row = int(np.argmax(difference))
    where = f"u_{'dq'[p.part[row]]}" + (f" at order {abs(p.order[row]):g}" if p.order[row] else "")
    return f"{where} differs by {difference[row]:.3g} V between {a} and {b}"
