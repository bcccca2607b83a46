# SPDX-License-Identifier: BSD-3-Clause
"""Candidates for the next recording: operating points within the drive's limits, and a simulated view of them."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.balance.view import View
from fluxproof.diagnosis.effects import LEAST_CURRENT
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.nominal import flux_level
from fluxproof.plant.transforms import linear_limit

ROWS = 200


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
