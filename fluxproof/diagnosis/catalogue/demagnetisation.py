# SPDX-License-Identifier: BSD-3-Clause
"""Magnets that lose a part of their flux at once, as after a pulse of negative i_d on a hot rotor: omega psi_step.

The instant is searched between the dwells: visits to one operating point are compared with each other, and the instant
after which their flux linkage differs most is taken, at the cost of its prior probability.  Within a dwell, and between
two recordings, none is looked for.
"""

import numpy as np

from fluxproof.diagnosis.balance.operating_points import instant_of_change, log_prior
from fluxproof.diagnosis.effects import DOUBT, Caveat, Chosen, Constant, FluxEffect, Parameter, one, sigma


class Demagnetisation(FluxEffect, Constant, Chosen, Caveat):
    def core_psi(self, view):
        instant = instant_of_change(view)
        lost = np.zeros(len(view)) if instant is None else (view.t >= instant).astype(float)
        return {"step": np.ones_like(view.i) * lost[:, None]}

    def log_choice(self, view):
        return log_prior(view)

    def floor(self, nominal):
        return 0.006 * nominal.machine.magnet_flux_wb

    def ceiling(self, nominal):
        return 0.6 * nominal.machine.magnet_flux_wb

    def possible(self, c, covariance, nominal):
        """Magnets do not regain at once what they have lost."""
        return c["step"] <= DOUBT * sigma(covariance)

    def estimates(self, c, covariance, nominal):
        return one("magnet_flux_step_wb", "Wb", c["step"], sigma(covariance))

    def caveat(self, view, c):
        begins = instant_of_change(view)
        return f"The loss occurred just before the steady rows that begin {begins:.3g} s after the first one."


EFFECT = Demagnetisation(
    name="demagnetisation",
    title="sudden loss of magnet flux",
    equation="psi_d = L_d i_d + psi_m + psi_step (t >= t_0)",
    signature="order 0 on the q axis, proportional to speed, from one instant on",
    separated_by="an operating point without current before and after, and once more when the machine is cold",
    parameters=(Parameter("magnet_flux_step_wb", "Wb", "from one instant on", "change"),),
    plausible={"magnet_flux_step_wb": (-0.4, 0.0, "machine.magnet_flux_wb")},
    otherwise="a sensor of current or voltage has changed its scale",
    needs=("time",),
)
