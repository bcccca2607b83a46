"""Cogging: a torque that depends on the rotor's angle alone, at multiples of the slots and poles."""

import numpy as np

from diagnosis.catalogue.effect import Effect, Parameter
from diagnosis.result import Estimate


def _waves(view, orders):
    out = {}
    for h in orders:
        out[f"h{h}_cos"] = {"torque": np.cos(h * view.theta_mid)}
        out[f"h{h}_sin"] = {"torque": np.sin(h * view.theta_mid)}
    return out


class Cogging(Effect):
    def core(self, view):
        return _waves(view, (6, 12, 18))

    def free(self, view):
        return _waves(view, (4, 8, 24, 30, 36))

    def floor(self, nominal):
        m = nominal.machine
        return 0.006 * 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a

    def size(self, c, nominal):
        return float(np.sqrt(sum(v**2 for v in c.values())))

    @staticmethod
    def _orders(c):
        """{order: (amplitude, phase)} per electrical turn, T = a sin(h theta + phi)."""
        orders = sorted({int(name[1 : name.index("_")]) for name in c})
        pairs = {h: (c[f"h{h}_cos"], c[f"h{h}_sin"]) for h in orders}
        return {h: (float(np.hypot(a, b)), float(np.arctan2(a, b))) for h, (a, b) in pairs.items()}

    def estimates(self, c, covariance, nominal):
        sizes = self._orders(c)
        h = max(sizes, key=lambda k: sizes[k][0])
        k = list(c).index(f"h{h}_cos")
        spread = float(np.sqrt(0.5 * (covariance[k, k] + covariance[k + 1, k + 1])))
        order = Estimate(float(h * nominal.machine.pole_pairs), 0.0, "per turn")
        return {"cogging_nm": Estimate(sizes[h][0], spread, "Nm"), "cogging_order": order}

    def plant(self, c, nominal):
        sizes = self._orders(c)
        h = max(sizes, key=lambda k: sizes[k][0])
        return {
            "machine.cogging_amplitude_nm": sizes[h][0],
            "machine.cogging_order": int(h * nominal.machine.pole_pairs),
            "machine.cogging_phase_rad": sizes[h][1],
        }


EFFECT = Cogging(
    name="cogging",
    title="the rotor cogs",
    equation="T = T_airgap + a sin(n theta_m + phi), n a multiple of slots and poles",
    signature="torque and speed at even orders per electrical turn, present without current",
    confounders=("emf_harmonics", "current_offset"),
    separated_by="a slow turn without current",
    parameters=(
        Parameter("cogging_nm", "Nm", "amplitude of the largest order"),
        Parameter("cogging_order", "per turn", "of the largest"),
    ),
)
