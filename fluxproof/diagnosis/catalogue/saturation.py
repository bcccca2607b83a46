# SPDX-License-Identifier: BSD-3-Clause
"""Self-saturation: psi_d = f(i_d), psi_q = g(i_q), g odd; the curves are free."""

import numpy as np

from fluxproof.diagnosis.effects.effect import LEAST_CURRENT, FluxEffect, Parameter
from fluxproof.diagnosis.ground.result import Estimate


def _q(view, shape):
    y = view.i.imag / view.machine.rated_current_a
    return 1j * view.machine.inductance_q_h * view.machine.rated_current_a * shape(y)


def _d(view, shape):
    x = view.i.real / view.machine.rated_current_a
    return view.machine.inductance_d_h * view.machine.rated_current_a * shape(x) + 0j


def _with_current(view, columns):
    """The columns of the axes with enough current."""
    i = view.i / view.machine.rated_current_a
    enough = {"d": np.abs(i.real).max() > LEAST_CURRENT, "q": np.abs(i.imag).max() > LEAST_CURRENT}
    return {key: column for key, column in columns.items() if enough[key[0]]}


class Saturation(FluxEffect):
    def core_psi(self, view):
        return {"q_3": _q(view, lambda y: y**3), "d_3": _d(view, lambda x: x**3)}

    def free_psi(self, view):
        return {
            "q_2": _q(view, lambda y: y * np.abs(y)),
            "q_5": _q(view, lambda y: y**5),
            "d_2": _d(view, lambda x: x**2),
            "d_2s": _d(view, lambda x: x * np.abs(x)),
        }

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
            powers = (("2", 2), ("2s", 2), ("3", 3), ("5", 5))
            curve = sum((c.get(f"{axis}_{k}", 0.0) * x**p for k, p in powers), np.zeros_like(x))
            bends.append(np.max(np.abs(curve - x * curve[-1])))
        return float(max(bends))

    def estimates(self, c, covariance, nominal):
        names = list(c)
        out = {}
        for axis in "qd":
            l_i = getattr(nominal.machine, f"inductance_{axis}_h") * nominal.machine.rated_current_a
            mine = np.array([1.0 if name.startswith(axis) else 0.0 for name in names])
            spread = float(np.sqrt(max(mine @ covariance @ mine, 0.0)))
            value = float(sum(v for name, v in c.items() if name.startswith(axis)))
            if value or spread:  # an axis without current does not determine its curve
                out[f"psi_{axis}_change_at_rated_wb"] = Estimate(value * l_i, spread * l_i, "Wb")
        return out

    def plant(self, c, nominal):
        """The plant's i = x (1 + s x^2), psi = L x, fitted to the curve within the rated current."""
        i = np.linspace(-1.0, 1.0, 41)
        shapes = {"1": i, "2": i**2, "2s": i * np.abs(i), "3": i**3, "5": i**5}
        out = {}
        for axis in "dq":
            odd = {"2": i * np.abs(i)} if axis == "q" else {}  # on the q axis |y| y has this name
            x = i + sum(v * {**shapes, **odd}[k[2:]] for k, v in c.items() if k.startswith(f"{axis}_"))
            bend = float((i - x) @ x**3 / (x**3 @ x**3)) / nominal.machine.rated_current_a**2
            out[f"machine.saturation_{axis}_per_a2"] = max(0.0, bend)
        return out


EFFECT = Saturation(
    name="saturation",
    title="saturation of an axis by its own current",
    equation="psi_q = g(i_q), odd; psi_d = psi_m + f(i_d)",
    signature="order 0, proportional to speed, nonlinear in the current: about -omega i_q^3 on the d axis",
    confounders=("inductance_q", "inductance_d", "cross_saturation", "encoder_offset"),
    map_shapes=("linear", "separable"),
    separated_by="i_q up to the rated current in several steps, both signs",
    parameters=(
        Parameter("psi_q_change_at_rated_wb", "Wb", "flux linkage at rated i_q minus L_q i_q", "psi_q at rated i_q"),
        Parameter("psi_d_change_at_rated_wb", "Wb", "flux linkage at rated i_d minus L_d i_d", "psi_d at rated i_d"),
    ),
    curve=1.0,  # no formula of a saturation is preferred
    bends=True,
)
