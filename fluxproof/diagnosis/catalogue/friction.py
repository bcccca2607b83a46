# SPDX-License-Identifier: BSD-3-Clause
"""Friction: a torque against the motion that depends on the speed alone."""

import numpy as np

from fluxproof.diagnosis.effects import DOUBT, FreeCurve, Parameter, ShaftTorque
from fluxproof.diagnosis.ground.machine import rated_torque
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant.transforms import linear_limit

LOW = 0.1  # of top speed: where the friction of a shaft that begins to turn has fallen to 1 / e
SPEEDS = (0.05, 0.3, 1.0)  # of top speed, at which a drag must not be negative


def _drag(view, shape):
    omega_m = view.omega_mid / view.machine.pole_pairs
    return {"torque": -shape(omega_m)}


def _top(view):
    return max(float(np.abs(view.omega).max()) / view.machine.pole_pairs, 1e-9)


class Friction(ShaftTorque, FreeCurve):
    def core(self, view):
        top = _top(view)
        return {
            "viscous": _drag(view, lambda w: w),
            "coulomb": _drag(view, lambda w: np.tanh(w / (0.01 * top))),
        }

    def free(self, view):
        top = _top(view)
        return {
            "square": _drag(view, lambda w: w * np.abs(w) / top),
            "low": _drag(view, lambda w: np.sign(w) * np.exp(-np.abs(w) / (LOW * top))),
        }

    def curve_scale(self, key, cores, nominal):
        return cores.get("viscous" if key == "square" else "coulomb", max(cores.values()))

    def floor(self, nominal):
        return 0.006 * rated_torque(nominal.machine)

    def ceiling(self, nominal):
        return rated_torque(nominal.machine)

    def size(self, c, nominal):
        """Drag torque [Nm] at the speed where the EMF reaches the bus voltage, about the maximum speed."""
        m = nominal.machine
        top = linear_limit(nominal.inverter.dc_bus_v) / m.magnet_flux_wb / m.pole_pairs
        return abs(c["viscous"]) * top + abs(c["coulomb"]) + abs(c.get("square", 0.0)) * top + abs(c.get("low", 0.0))

    def possible(self, c, covariance, nominal):
        """Friction cannot drive the shaft: at no speed up to that of ``size`` the total drag is negative."""
        m = nominal.machine
        top = linear_limit(nominal.inverter.dc_bus_v) / m.magnet_flux_wb / m.pole_pairs
        values = np.array(list(c.values()))
        for x in SPEEDS:
            grows = {"viscous": x * top, "coulomb": 1.0, "square": x**2 * top, "low": np.exp(-x / LOW)}
            weights = np.array([grows[name] for name in c])
            drag = (m.viscous_friction_nms or 0.0) * x * top + (m.coulomb_friction_nm or 0.0) + weights @ values
            if drag < -DOUBT * np.sqrt(max(weights @ covariance @ weights, 0.0)):
                return False
        return True

    def estimates(self, c, covariance, nominal):
        m, spread = nominal.machine, np.sqrt(np.maximum(np.diag(covariance), 0.0))
        b, t = m.viscous_friction_nms or 0.0, m.coulomb_friction_nm or 0.0
        return {
            "viscous_friction_nms": Estimate(b + c["viscous"], float(spread[0]), "Nm s"),
            "coulomb_friction_nm": Estimate(t + c["coulomb"], float(spread[1]), "Nm"),
        }

    def plant(self, c, nominal):
        values = self.estimates(c, np.zeros((len(c),) * 2), nominal)
        return {f"machine.{name}": max(e.value, 0.0) for name, e in values.items()}


EFFECT = Friction(
    name="friction",
    title="friction different from the drive file",
    equation="T_shaft = T_airgap - B omega_m - T_c sign(omega_m)",
    signature="torque against the motion, odd in speed, at every load",
    separated_by="a torque transducer, or a no-load coast-down in both directions",
    beside_torque="the drag over speed with and without a negative i_d, which only an iron loss follows",
    parameters=(
        Parameter("viscous_friction_nms", "Nm s", "per mechanical rad/s", "viscous"),
        Parameter("coulomb_friction_nm", "Nm", "dry", "dry"),
    ),
    needs=("torque",),
)
