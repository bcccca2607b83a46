# SPDX-License-Identifier: BSD-3-Clause
"""d-axis inductance that differs from the nameplate: omega i_d on the q axis."""

import numpy as np

from fluxproof.diagnosis.effects import LEAST_CURRENT, Constant, FluxEffect, Parameter, Spread, one, sigma


class InductanceD(FluxEffect, Constant, Spread):
    rescales = ("inductance_d_h",)
    bent = "saturation"

    def core_psi(self, view):
        return {"delta_l_d": view.i.real.astype(complex)}

    def free_psi(self, view):
        x = view.i.real / view.machine.rated_current_a
        unit = view.machine.rated_current_a * x + 0j
        return {"bend_2": unit * x, "bend_3": unit * x**2}

    def free(self, view):
        carried = np.abs(view.i.real).max() > LEAST_CURRENT * view.machine.rated_current_a
        # Decided once for all views of a recording: corrected currents must not change the set of coefficients.
        return super().free(view) if view.memo.setdefault("curve_d", bool(carried)) else {}

    def delta_l(self, c):
        return c["delta_l_d"], 0.0

    def floor(self, nominal):
        return 0.01 * nominal.machine.inductance_d_h

    def ceiling(self, nominal):
        return 2.0 * nominal.machine.inductance_d_h

    def estimates(self, c, covariance, nominal):
        return one("inductance_d_h", "H", nominal.machine.inductance_d_h + c["delta_l_d"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.inductance_d_h": nominal.machine.inductance_d_h + c["delta_l_d"]}


EFFECT = InductanceD(
    name="inductance_d",
    title="d-axis inductance off the nameplate",
    equation="psi_d = (L_d + delta_l_d) i_d",
    signature="order 0, omega i_d on the q axis; and the slope of i_d",
    separated_by="two non-zero values of i_d",
    parameters=(Parameter("inductance_d_h", "H", "of the d axis", "L_d"),),
    plausible={"inductance_d_h": (0.33, 3.0, "machine.inductance_d_h")},
    otherwise="an inductance between two terminals is twice that of a phase; an incremental one is smaller",
    needs=("voltage",),
)
