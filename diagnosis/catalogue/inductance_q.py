"""Inductance of the q axis other than the nameplate's: -omega i_q on the d axis."""

from diagnosis.catalogue.effect import Effect, Parameter, flux, one, sigma


class InductanceQ(Effect):
    def core(self, view):
        return {"delta_l_q": flux(view, 1j * view.i.imag)}

    def floor(self, nominal):
        return 0.01 * nominal.machine.inductance_q_h

    def estimates(self, c, covariance, nominal):
        return one("inductance_q_h", "H", nominal.machine.inductance_q_h + c["delta_l_q"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.inductance_q_h": nominal.machine.inductance_q_h + c["delta_l_q"]}


EFFECT = InductanceQ(
    name="inductance_q",
    title="inductance of the q axis differs from the nameplate",
    equation="psi_q = (L_q + delta_l_q) i_q",
    signature="order 0, -omega i_q on the d axis; and the slope of i_q",
    confounders=("encoder_offset", "saturation", "iron_loss", "sampling_skew"),
    separated_by="several i_q of both signs; a spin without current",
    parameters=(Parameter("inductance_q_h", "H", "of the q axis"),),
)
