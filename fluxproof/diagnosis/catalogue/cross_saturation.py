# SPDX-License-Identifier: BSD-3-Clause
"""Cross-saturation: both fluxes are derivatives of one mixed co-energy, which is even in i_q (reciprocity)."""

import numpy as np

from fluxproof.diagnosis.effects import BentFlux, Parameter
from fluxproof.diagnosis.ground.result import Estimate


def _mixed(view, slope_d, slope_q):
    """Flux of a co-energy W(x, y), x and y in per unit of rated current, from its two partial derivatives."""
    m = view.machine
    scale = m.inductance_q_h * m.rated_current_a
    x, y = view.i.real / m.rated_current_a, view.i.imag / m.rated_current_a
    return scale * (slope_d(x, y) + 1j * slope_q(x, y))


class CrossSaturation(BentFlux):
    def core_psi(self, view):
        return {"xy2": _mixed(view, lambda x, y: y**2, lambda x, y: 2 * x * y)}

    def free_psi(self, view):
        return {
            # Squares and products: a general power of an array takes sixty times as long.
            "x2y2": _mixed(view, lambda x, y: 2 * x * y**2, lambda x, y: 2 * x**2 * y),
            "xy4": _mixed(view, lambda x, y: (y**2) ** 2, lambda x, y: 4 * x * y * y**2),
            "xy1": _mixed(view, lambda x, y: np.sqrt(y**2 + 0.01) - 0.1, lambda x, y: x * y / np.sqrt(y**2 + 0.01)),
            "x2y4": _mixed(view, lambda x, y: 2 * x * (y**2) ** 2, lambda x, y: 4 * x**2 * y * y**2),
            "x3y2": _mixed(view, lambda x, y: 3 * x**2 * y**2, lambda x, y: 2 * x * x**2 * y),
            # The iron that couples the axes also bends each of them.
            "y3": _mixed(view, lambda x, y: 0.0 * x, lambda x, y: y * y**2),
            "x3": _mixed(view, lambda x, y: x * x**2, lambda x, y: 0.0 * y),
        }

    def floor(self, nominal):
        return 0.006

    def ceiling(self, nominal):
        return 1.0

    def size(self, c, nominal):
        """Change of psi_d by rated i_q, relative to L_q i_rated."""
        return abs(c.get("xy2", 0.0) + c.get("xy4", 0.0) + 0.9 * c.get("xy1", 0.0))

    def estimates(self, c, covariance, nominal):
        m = nominal.machine
        weights = np.array([{"xy2": 1.0, "xy4": 1.0, "xy1": np.sqrt(1.01) - 0.1}.get(name, 0.0) for name in c])
        scale = m.inductance_q_h / m.rated_current_a
        value = float(weights @ np.array(list(c.values()))) * scale
        spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0))) * scale
        return {"cross_saturation_wb_per_a2": Estimate(-value, spread, "Wb/A2")}

    def plant(self, c, nominal):
        return {
            "machine.cross_saturation_wb_per_a2": self.estimates(c, np.zeros((len(c),) * 2), nominal)[
                "cross_saturation_wb_per_a2"
            ].value
        }


EFFECT = CrossSaturation(
    name="cross_saturation",
    title="cross-saturation of the axes",
    equation="psi_d = L_d i_d + psi_m - c i_q^2, psi_q = L_q i_q - 2 c i_d i_q (one co-energy)",
    signature="order 0, in proportion to the speed: omega i_q^2 on the q axis, even in i_q; omega i_d i_q on d",
    separated_by="a grid of i_d and i_q that includes i_q = 0",
    parameters=(Parameter("cross_saturation_wb_per_a2", "Wb/A2", "c at rated i_q", "coefficient"),),
    needs=("voltage",),
)
