"""The bus voltage is measured with a wrong gain: every voltage is scaled."""

from fluxproof.diagnosis.effect import Effect, Parameter, one, sigma, voltage


class UdcGain(Effect):
    def core(self, view):
        # The nominal drive's own voltage stands for the applied one, whose noise is that of the misfit.
        return {"gain": voltage(view.machine.resistance_ohm * view.i_mid + view.flux(view.psi))}

    def floor(self, nominal):
        return 0.003

    def ceiling(self, nominal):
        return 0.5

    def corrected(self, view, c):
        factor = 1.0 / (1.0 + c["gain"])
        return view.replace(u=view.u * factor, u_dc=view.u_dc * factor)

    def estimates(self, c, covariance, nominal):
        return one("udc_gain", "1", c["gain"], sigma(covariance))

    def plant(self, c, nominal):
        return {"sensors.u_dc_gain_error": c["gain"]}


EFFECT = UdcGain(
    name="udc_gain",
    title="the bus voltage is measured with a wrong gain",
    equation="u_dc_measured = (1 + g) u_dc",
    signature="R, L_d, L_q and psi_m wrong by one and the same factor",
    confounders=("magnet_flux", "current_scale", "resistance", "inductance_d", "inductance_q"),
    separated_by="an external voltmeter, or the open-circuit EMF",
    parameters=(Parameter("udc_gain", "1", "relative error"),),
    corrects=True,
)
