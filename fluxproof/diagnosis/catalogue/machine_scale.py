# SPDX-License-Identifier: BSD-3-Clause
"""Constants of the drive file that are all wrong by one factor: values of another machine, or of other terminals.

The coefficient is the share by which the true constants exceed those of the file.  R, L_d and L_q alone leave the same
voltages as a gain of all current sensors, and together with the magnet flux the same as a gain of the bus voltage: a
voltage balance cannot separate them, so that the prior odds are those of a sensor as far off.
"""

import numpy as np

from fluxproof.diagnosis.effects import (
    Alternatives,
    Chosen,
    Constant,
    FluxEffect,
    Parameter,
    Restates,
    sigma,
    torque_of,
)
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Estimate

LARGEST, SMALLEST = 3.0, -0.714  # the shares of sensors whose readings are 0.25 and 3.5 times the true values
IMPEDANCE = ("resistance_ohm", "inductance_d_h", "inductance_q_h")
KEYS = {"impedance": IMPEDANCE, "all": (*IMPEDANCE, "magnet_flux_wb")}
PARAMETERS = {"impedance": "impedance_factor", "all": "machine_factor"}


def _share(c) -> tuple[str, float]:
    """The coefficient that is in use: (form, share)."""
    return next(((form, share) for form, share in c.items() if share), ("impedance", 0.0))


class MachineScale(Alternatives, FluxEffect, Constant, Chosen, Restates):
    rescales = KEYS["all"]
    one_of = (("impedance",), ("all",))

    def core_psi(self, view):
        flux = view.nominal_psi
        return {"impedance": flux - view.machine.magnet_flux_wb, "all": flux}

    def core(self, view):
        drop = view.machine.resistance_ohm * view.i_mid
        return {
            form: {"u": drop + view.flux(psi), "torque": torque_of(view, psi, view.i)}
            for form, psi in self.core_psi(view).items()
        }

    def log_choice(self, view):
        """The odds of a sensor beyond its plausible range: three constants that are off alike are no tolerance."""
        return float(np.log(k.IMPLAUSIBLE))

    def floor(self, nominal):
        return 0.004

    def ceiling(self, nominal):
        return 0.6

    def too_large(self, c, view):
        return not SMALLEST < _share(c)[1] < LARGEST

    def inductances(self, c, machine):
        share = _share(c)[1]
        return share * machine.inductance_d_h, share * machine.inductance_q_h

    def estimates(self, c, covariance, nominal):
        used = _share(c)[0]
        return {
            PARAMETERS[form]: Estimate(1.0 + share, sigma(covariance, place), "1")
            for place, (form, share) in enumerate(c.items())
            if share or form == used
        }

    def of(self, nominal, c):
        form, share = _share(c)
        return {key: (1.0 + share) * getattr(nominal.machine, key) for key in KEYS[form]}

    def twin(self, c):
        return {"impedance": "current_scale", "all": "udc_gain"}[_share(c)[0]]

    def plant(self, c, nominal):
        return {f"machine.{key}": value for key, value in self.of(nominal, c).items()}


EFFECT = MachineScale(
    name="machine_scale",
    title="constants of the drive file off by one factor",
    equation="R, L_d, L_q (or with psi_m) = factor * those of the drive file",
    signature="R, L_d and L_q wrong by the same factor, or psi_m too",
    separated_by="a cold DC resistance measurement between two terminals, half of which is the R of a phase",
    parameters=(
        Parameter("impedance_factor", "1", "true R, L_d and L_q over those of the drive file", "R, L_d and L_q times"),
        Parameter("machine_factor", "1", "true R, L_d, L_q and psi_m over those of the file", "R, L and flux times"),
    ),
    needs=("current", "voltage"),
)
