# SPDX-License-Identifier: BSD-3-Clause
"""A sine filter or a long cable: capacitors across the terminals, whose current is measured, behind a choke."""

import numpy as np

from fluxproof.diagnosis.effects import DOUBT, FreeCurve, Parameter, current_error, one, sigma, voltage
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.plant.transforms import linear_limit

CHOKE = 0.02  # of the machine's inductance and resistance: those of the choke of a filter that is just of interest


def _rated_voltage(nominal):
    return linear_limit(nominal.inverter.dc_bus_v)


def _rated_speed(nominal):
    """Electrical speed at which rated current takes the whole voltage [rad/s]."""
    m = nominal.machine
    return _rated_voltage(nominal) / np.hypot(m.magnet_flux_wb, m.inductance_q_h * m.rated_current_a)


class SineFilter(FreeCurve):
    def core(self, view):
        slope = 1j * view.omega * steady_voltage(view.machine, view.i, view.omega, view.psi)
        return {"capacitance": current_error(view, slope)}

    def free(self, view):
        return {"inductance": voltage(view.flux(view.i)), "resistance": voltage(view.i_mid)}

    def curve_scale(self, key, cores, nominal):
        # A choke is no share of the capacitance: the share ``curve``, by which this is multiplied, is taken out.
        m = nominal.machine
        return CHOKE / self.curve * (m.inductance_q_h if key == "inductance" else m.resistance_ohm)

    def floor(self, nominal):
        return 0.005 * nominal.machine.rated_current_a / (_rated_speed(nominal) * _rated_voltage(nominal))

    def too_large(self, c, view):
        """Whether the capacitors' current exceeds half the rated one at the highest speed."""
        voltage_v = min(view.top_speed / _rated_speed(view.nominal), 1.0) * _rated_voltage(view.nominal)
        return c["capacitance"] * view.top_speed * voltage_v > 0.5 * view.machine.rated_current_a

    def possible(self, c, covariance, nominal):
        """Capacitors and chokes are not negative; a choke that is not seen may be within its uncertainty."""
        least = [-DOUBT * sigma(covariance, n) if key != "capacitance" else 0.0 for n, key in enumerate(c)]
        return all(value >= limit for value, limit in zip(c.values(), least, strict=True))

    def size(self, c, nominal):
        return abs(c["capacitance"])

    def estimates(self, c, covariance, nominal):
        return one("capacitance_f", "F", c["capacitance"], sigma(covariance))


EFFECT = SineFilter(
    name="sine_filter",
    title="sine filter or long cable",
    clause="a sine filter or a long cable was connected between inverter and machine",
    equation="i_measured = i + C du/dt, u_measured = u + R_f i + L_f di/dt",
    signature="order 0: i_d larger by omega C u_q, i_q smaller by omega C u_d, in proportion to omega^2",
    separated_by="zero current at two speeds",
    parameters=(Parameter("capacitance_f", "F", "of each phase, in star"),),
    needs=("current",),
)
