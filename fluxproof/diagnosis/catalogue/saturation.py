# SPDX-License-Identifier: BSD-3-Clause
"""Self-saturation: psi_d = f(i_d), psi_q = g(i_q), g odd; the curves are free."""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.effects import DOUBT, LEAST_CURRENT, BentFlux, Parameter
from fluxproof.diagnosis.ground.result import Estimate


class Term(NamedTuple):
    """A coefficient: a shape of the axis' own current in per unit of rated, in units of L i_rated."""

    axis: str
    shape: Callable


TERMS = {
    "q_2": Term("q", lambda y: y * np.abs(y)),
    "d_2": Term("d", lambda x: x**2),
    "d_2s": Term("d", lambda x: x * np.abs(x)),
    "q_3": Term("q", lambda y: y * y**2),
    "d_3": Term("d", lambda x: x * x**2),
    "q_5": Term("q", lambda y: y * (y**2) ** 2),
}
CURRENTS = (-1.0, -0.5, 0.5, 1.0)  # of rated: where a flux linkage must have the sign of its current
FORMULA, FURTHER = ("q_3", "d_3"), ("q_2", "q_5", "d_2", "d_2s")


def _psi(view, key):
    axis, shape = TERMS[key]
    m = view.machine
    if axis == "q":
        return 1j * m.inductance_q_h * m.rated_current_a * shape(view.i.imag / m.rated_current_a)
    return m.inductance_d_h * m.rated_current_a * shape(view.i.real / m.rated_current_a) + 0j


def _with_current(view, columns):
    """The columns of the axes with enough current."""
    i = view.i / view.machine.rated_current_a
    enough = {"d": np.abs(i.real).max() > LEAST_CURRENT, "q": np.abs(i.imag).max() > LEAST_CURRENT}
    return {key: column for key, column in columns.items() if enough[TERMS[key].axis]}


def _of(axis, c) -> dict:
    """{coefficient: value} of one axis in the order of TERMS."""
    return {key: c[key] for key, term in TERMS.items() if key in c and term.axis == axis}


class Saturation(BentFlux):
    curve = 1.0  # no formula of a saturation is preferred

    def core_psi(self, view):
        return {key: _psi(view, key) for key in FORMULA}

    def free_psi(self, view):
        return {key: _psi(view, key) for key in FURTHER}

    def core(self, view):
        return _with_current(view, super().core(view))

    def free(self, view):
        return _with_current(view, super().free(view))

    def floor(self, nominal):
        return 0.006

    def ceiling(self, nominal):
        return 1.0

    def size(self, c, nominal):
        """Largest deviation of either curve from its chord, relative to L i at rated current."""
        x = np.linspace(0, 1, 21)
        bends = []
        for axis in "qd":
            curve = sum((value * TERMS[key].shape(x) for key, value in _of(axis, c).items()), np.zeros_like(x))
            bends.append(np.max(np.abs(curve - x * curve[-1])))
        return float(max(bends))

    def possible(self, c, covariance, nominal):
        """No saturation reverses the flux linkage that a current makes: an inductance is never negative."""
        values = np.array(list(c.values()))
        for axis, share in itertools.product("qd", CURRENTS):
            weights = np.array([TERMS[key].shape(share) if TERMS[key].axis == axis else 0.0 for key in c])
            if np.sign(share) * (share + weights @ values) < -DOUBT * np.sqrt(max(weights @ covariance @ weights, 0.0)):
                return False
        return True

    def estimates(self, c, covariance, nominal):
        out = {}
        for axis in "qd":
            l_i = getattr(nominal.machine, f"inductance_{axis}_h") * nominal.machine.rated_current_a
            mine = np.array([1.0 if TERMS[key].axis == axis else 0.0 for key in c])
            spread = float(np.sqrt(max(mine @ covariance @ mine, 0.0)))
            value = float(sum(v for key, v in c.items() if TERMS[key].axis == axis))
            if value or spread:  # an axis without current does not determine its curve
                out[f"psi_{axis}_change_at_rated_wb"] = Estimate(value * l_i, spread * l_i, "Wb")
        return out

    def plant(self, c, nominal):
        """The plant's i = x (1 + s x^2), psi = L x, fitted to the curve within the rated current."""
        i = np.linspace(-1.0, 1.0, 41)
        out = {}
        for axis in "dq":
            x = i + sum(v * TERMS[key].shape(i) for key, v in c.items() if TERMS[key].axis == axis)
            bend = float((i - x) @ x**3 / (x**3 @ x**3)) / nominal.machine.rated_current_a**2
            out[f"machine.saturation_{axis}_per_a2"] = max(0.0, bend)
        return out


EFFECT = Saturation(
    name="saturation",
    title="saturation of an axis by its own current",
    equation="psi_q = g(i_q), odd; psi_d = psi_m + f(i_d)",
    signature="order 0, proportional to speed, nonlinear in the current: about -omega i_q^3 on the d axis",
    separated_by="i_q up to the rated current in several steps, both signs",
    parameters=(
        Parameter("psi_q_change_at_rated_wb", "Wb", "flux linkage at rated i_q minus L_q i_q", "psi_q at rated i_q"),
        Parameter("psi_d_change_at_rated_wb", "Wb", "flux linkage at rated i_d minus L_d i_d", "psi_d at rated i_d"),
    ),
    needs=("voltage",),
)
