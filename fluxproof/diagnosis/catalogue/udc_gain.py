# SPDX-License-Identifier: BSD-3-Clause
"""Gain error of the measured bus voltage: it scales every voltage."""

from fluxproof.diagnosis.effects import Constant, MeasurementError, Parameter, one, sigma, voltage

LARGEST_GAIN, SMALLEST_GAIN = 2.5, -0.75  # the sensor of a drive that runs is right within a factor of 3.5


class UdcGain(MeasurementError, Constant):
    rescales = ("u", "u_dc")

    def core(self, view):
        # The nominal drive's voltage replaces the applied one, whose noise is that of the misfit.
        return {"gain": voltage(view.machine.resistance_ohm * view.i_mid + view.flux(view.psi))}

    def floor(self, nominal):
        return 0.003

    def ceiling(self, nominal):
        return 0.5

    def too_large(self, c, view):
        return not SMALLEST_GAIN < c["gain"] < LARGEST_GAIN

    def corrected(self, view, c):
        factor = 1.0 / (1.0 + max(c["gain"], SMALLEST_GAIN))
        kept = view.voltage_kept * factor
        return view.replace(u=view.u * factor, u_dc=view.u_dc * factor, voltage_kept=kept)

    def estimates(self, c, covariance, nominal):
        return one("udc_gain", "1", c["gain"], sigma(covariance) * (1.0 + c["gain"]))

    def plant(self, c, nominal):
        return {"sensors.u_dc_gain_error": c["gain"]}


EFFECT = UdcGain(
    name="udc_gain",
    title="gain error of the bus voltage sensor",
    equation="u_dc_measured = (1 + g) u_dc",
    signature="R, L_d, L_q and psi_m wrong by the same factor",
    separated_by="an external voltmeter, or the open-circuit EMF",
    parameters=(Parameter("udc_gain", "1", "relative error", "error"),),
    plausible={"udc_gain": (-0.1, 0.1)},
    otherwise="the bus voltage of another point of the circuit, or the wrong divider",
    needs=("inverter",),
)
