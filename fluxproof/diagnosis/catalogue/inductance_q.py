# SPDX-License-Identifier: BSD-3-Clause
"""q-axis inductance that differs from the nameplate: -omega i_q on the d axis."""

import numpy as np

from fluxproof.diagnosis.effects import LEAST_CURRENT, Constant, FluxEffect, Parameter, Spread, one, sigma


class InductanceQ(FluxEffect, Constant, Spread):
    rescales = ("inductance_q_h",)
    bent = "saturation"

    def core_psi(self, view):
        return {"delta_l_q": 1j * view.i.imag}

    def free_psi(self, view):
        y = view.i.imag / view.machine.rated_current_a
        unit = 1j * view.machine.rated_current_a * y
        return {"bend_2": unit * np.abs(y), "bend_3": unit * y**2}

    def free(self, view):
        carried = np.abs(view.i.imag).max() > LEAST_CURRENT * view.machine.rated_current_a
        # Decided once for all views of a recording: corrected currents must not change the set of coefficients.
        return super().free(view) if view.memo.setdefault("curve_q", bool(carried)) else {}

    def delta_l(self, c):
        return 0.0, c["delta_l_q"]

    def floor(self, nominal):
        return 0.01 * nominal.machine.inductance_q_h

    def ceiling(self, nominal):
        return 2.0 * nominal.machine.inductance_q_h

    def estimates(self, c, covariance, nominal):
        return one("inductance_q_h", "H", nominal.machine.inductance_q_h + c["delta_l_q"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.inductance_q_h": nominal.machine.inductance_q_h + c["delta_l_q"]}


EFFECT = InductanceQ(
    name="inductance_q",
    title="q-axis inductance off the nameplate",
    equation="psi_q = (L_q + delta_l_q) i_q",
    signature="order 0, -omega i_q on the d axis; and the slope of i_q",
    separated_by="several i_q of both signs; rotation at zero current",
    parameters=(Parameter("inductance_q_h", "H", "of the q axis", "L_q"),),
    plausible={"inductance_q_h": (0.33, 3.0, "machine.inductance_q_h")},
    otherwise="an inductance between two terminals is twice that of a phase; an incremental one is smaller",
    needs=("voltage",),
)
