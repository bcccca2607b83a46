# SPDX-License-Identifier: BSD-3-Clause
"""Cogging torque: a function of the rotor angle alone, at multiples of the numbers of slots and poles."""

import numpy as np

from fluxproof.diagnosis.balance.torque_order import log_prior, repeating_order
from fluxproof.diagnosis.effects import Chosen, Described, FreeCurve, Orders, Parameter, ShaftTorque, Wave
from fluxproof.diagnosis.ground.machine import rated_torque
from fluxproof.diagnosis.ground.result import Estimate


def _seen(view, h):
    """Share (b, 1) of a torque ripple e^(jwt) that appears in the recorded torque.

    The acceleration of a free shaft is a difference over three samples, with the gain sin(wT)/(wT) sin(wT/2)/(wT/2);
    a transducer's torque is interpolated to the middles of the intervals (blocks.at_middle).
    """
    x = h * view.omega.mean(axis=1, keepdims=True) * view.sample_time_s
    moved = (9.0 * np.cos(0.5 * x) - np.cos(1.5 * x)) / 8.0
    difference = np.sinc(x / np.pi) * np.sinc(0.5 * x / np.pi)
    return np.where(view.turns_freely[:, None], difference, moved)


def _waves(view, n):
    """Columns of order n per mechanical turn."""
    h = n / view.machine.pole_pairs
    seen = _seen(view, h)
    return {
        Wave(n, "cos"): {"torque": seen * np.cos(h * view.theta_mid)},
        Wave(n, "sin"): {"torque": seen * np.sin(h * view.theta_mid)},
    }


class Cogging(ShaftTorque, FreeCurve, Chosen, Described):
    def core(self, view):
        n = repeating_order(view)
        return {**_waves(view, n), **_waves(view, 2 * n)}

    def free(self, view):
        return _waves(view, 3 * repeating_order(view))

    def log_choice(self, view):
        return log_prior(view)

    def floor(self, nominal):
        return 0.006 * rated_torque(nominal.machine)

    def ceiling(self, nominal):
        return 0.6 * rated_torque(nominal.machine)

    def size(self, c, nominal):
        return float(np.sqrt(sum(v**2 for v in c.values())))

    @staticmethod
    def _orders(c):
        """{order: (amplitude, phase)} per mechanical turn, T = a sin(n theta_m + phi)."""
        orders = sorted({wave.order for wave in c})
        pairs = {n: (c[Wave(n, "cos")], c[Wave(n, "sin")]) for n in orders}
        return {n: (float(np.hypot(a, b)), float(np.arctan2(a, b))) for n, (a, b) in pairs.items()}

    def estimates(self, c, covariance, nominal):
        sizes = self._orders(c)
        n = max(sizes, key=lambda n: sizes[n][0])
        k = list(c).index(Wave(n, "cos"))
        spread = float(np.sqrt(0.5 * (covariance[k, k] + covariance[k + 1, k + 1])))
        return {"cogging_nm": Estimate(sizes[n][0], spread, "Nm"), "cogging_order": Estimate(float(n), 0.0, "per turn")}

    def given(self, view, plant):
        m = plant.machine
        h = m.cogging_order / m.pole_pairs
        if not m.cogging_amplitude_nm:
            return {}
        wave = np.sin(h * view.theta_mid + m.cogging_phase_rad)
        return {"torque": m.cogging_amplitude_nm * _seen(view, h) * wave}

    def plant(self, c, nominal):
        sizes = self._orders(c)
        n = max(sizes, key=lambda n: sizes[n][0])
        return {
            "machine.cogging_amplitude_nm": sizes[n][0],
            "machine.cogging_order": n,
            "machine.cogging_phase_rad": sizes[n][1],
        }


EFFECT = Cogging(
    name="cogging",
    title="cogging torque",
    equation="T = T_airgap + a sin(n theta_m + phi), n a multiple of slots and poles",
    signature="torque and speed at whole orders per mechanical turn, present without current",
    separated_by="a slow turn without current",
    parameters=(
        Parameter("cogging_nm", "Nm", "amplitude of the largest order", "amplitude"),
        Parameter("cogging_order", "per turn", "the largest order, per mechanical turn", "order"),
    ),
    needs=("harmonics",),
    shows_at=Orders(electrical=()),
)
