# SPDX-License-Identifier: BSD-3-Clause
"""An angle sensor that turns against the rotor with the torque, as behind a soft shaft or coupling."""

from fluxproof.diagnosis.effects import MeasurementError, Parameter, angle_error, one, sigma
from fluxproof.diagnosis.ground.machine import airgap_torque, rated_torque

SETTLED = 4  # steps until turn and torque agree


def _load(view):
    """Air-gap torque at the samples over the rated one, (b, m+1)."""
    return airgap_torque(view.machine, view.psi, view.i) / rated_torque(view.machine)


class ShaftTwist(MeasurementError):
    def core(self, view):
        return {"twist": angle_error(view, _load(view))}

    def floor(self, nominal):
        return 0.01

    def ceiling(self, nominal):
        return 0.2  # beyond it, no drive would be regulated with such a sensor

    def corrected(self, view, c):
        turn = 0.0
        for _ in range(SETTLED):  # the torque follows from currents at the true angle
            turn = c["twist"] * _load(view.turned(turn))
        return view.turned(turn)

    def estimates(self, c, covariance, nominal):
        return one("twist_rad", "rad", c["twist"], sigma(covariance))


EFFECT = ShaftTwist(
    name="shaft_twist",
    title="soft shaft between rotor and angle sensor",
    clause="the angle sensor twisted against the rotor with the torque, as with a soft shaft",
    equation="theta_measured = theta_e + k T",
    signature="order 0: omega psi_m k T on the d axis, odd in i_q: like an error of L_q with a cross-saturation",
    separated_by="i_d of both signs at one torque; the angle against a second sensor, loaded and unloaded",
    plausible={"twist_rad": (-0.1, 0.1)},  # some degrees of the shaft: a coupling that turns further is broken
    otherwise="a coupling that turns further is broken, or an axis saturates",
    parameters=(Parameter("twist_rad", "rad", "electrical, at rated torque", "twist"),),
    needs=("angle",),
)
