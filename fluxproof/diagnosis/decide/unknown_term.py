# SPDX-License-Identifier: BSD-3-Clause
"""The single term that describes best what no effect of the catalogue explains.

Each term of a generic dictionary (harmonic order times a function of the operating point) is regressed on the residual
of the best model; the one that explains most is reported with its formula.  It describes and names no cause.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.result import UnknownTerm


def _dependences(view):
    """{text: ((b,) factor, unit of the coefficient)} of the functions in the dictionary."""
    omega, i = view.omega.mean(axis=1), view.i.mean(axis=1)
    return {
        "1": (np.ones(len(view)), "V"),
        "omega": (omega, "V s/rad"),
        "abs(omega)": (np.abs(omega), "V s/rad"),
        "omega^2": (omega**2, "V s2/rad2"),
        "i_q": (i.imag, "V/A"),
        "i_d": (i.real, "V/A"),
        "abs(i)": (np.abs(i), "V/A"),
        "i_q^2": (i.imag**2, "V/A2"),
        "omega i_q": (omega * i.imag, "V s/(rad A)"),
        "omega i_d": (omega * i.real, "V s/(rad A)"),
        "omega i_q^2": (omega * i.imag**2, "V s/(rad A2)"),
        "omega i_d i_q": (omega * i.real * i.imag, "V s/(rad A2)"),
        "t": (view.course, "V per recording"),
        "omega t": (omega * view.course, "V s/rad per recording"),
        "u_dc": ((view.u_dc.mean(axis=1) - m_dc(view)) / m_dc(view), "V per relative u_dc"),
    }


def m_dc(view) -> float:
    """Nominal bus voltage [V]."""
    return float(view.nominal.inverter.dc_bus_v)


def sparse_term(view, cells, residual, sigma, train) -> UnknownTerm | None:
    """The dictionary term that explains most of a residual (r,), or None if there is no residual."""
    use = cells.ok & train & (cells.channel == "u")
    total = float(np.sum((residual[use] / sigma[use]) ** 2))
    best = None
    for order in np.unique(np.abs(cells.order[use])):
        for text, (factor, unit) in _dependences(view).items():
            gain, value, spread, part, signed = _best_part(cells, residual, sigma, use, order, factor)
            if best is None or gain > best[0]:
                best = (gain, order, text, unit, value, spread, part, signed)
    if best is None or total <= 0.0:
        return None
    gain, order, text, unit, value, spread, part, signed = best
    return UnknownTerm(
        signal="u_dq" if order else ("u_q" if part else "u_d"),
        formula=_formula(order, text, part, signed),
        value=value,
        sigma=spread,
        unit=unit,
        explains=float(np.clip(gain / total, 0.0, 1.0)),
    )


def _formula(order, text, part, signed):
    if order == 0:
        return f"u_{'dq'[part]} = c * {text}"
    wave = f"exp({'-' if signed < 0 else ''}j {order:g} theta_e + j phi)"
    return f"u_d + j u_q = c * {text} * {wave}"


def _best_part(cells, residual, sigma, use, order, factor):
    """(gain in chi^2, amplitude, sigma, part, direction) of one order and function, for the better part."""
    best = (-1.0, 0.0, 0.0, 0, 1)
    for signed in (1,) if order == 0 else (1, -1):
        gains, values, spreads = [], [], []
        for part in (0, 1):
            rows = np.flatnonzero(use & (cells.order == signed * order) & (cells.part == part))
            x = factor[cells.block[rows]] / sigma[rows]
            power = float(x @ x)
            if power < 1e-20:
                found = (0.0, 0.0, 0.0)
            else:
                value = float(x @ (residual[rows] / sigma[rows])) / power
                found = (value**2 * power, value, power**-0.5)
            for column, number in zip((gains, values, spreads), found, strict=True):
                column.append(number)
        if order == 0:
            part = int(gains[1] > gains[0])
            candidate = (gains[part], values[part], spreads[part], part, 1)
        else:
            candidate = (sum(gains), float(np.hypot(*values)), float(max(spreads)), 0, signed)
        if candidate[0] > best[0]:
            best = candidate
    return best
