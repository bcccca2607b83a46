"""Effects that scale one quantity, and combinations of them that are equivalent to another scale or to no change.

The balance determines ratios only.  Bus, currents and magnets scaled by the same factor are no change, and neither are
currents with R, L_d and L_q.  Any part of such a set is equivalent to its complement, and the model with fewer and
simpler effects is preferred.
"""

from __future__ import annotations

from dataclasses import replace

from fluxproof.diagnosis.effect import ALIKE
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.ties import SCALES, Ties

EARNS = 30.0  # least gain of an effect in chi^2 over dispersion, in addition to the freest form of the others
SAME_SCALE = 0.03  # of what is explained: largest loss if one scale replaces two
SAME_FIT = 1.25  # largest ratio of chi^2 if one effect replaces several
BY_CURRENT = ("resistance", "inductance_d", "inductance_q")  # voltage or flux proportional to current


class Scales(Ties):
    """Refined solutions with equivalent scales replaced by the simplest ones."""

    def _simplified(self, best) -> Solution:
        """The best model with two scales replaced by the third one if they are equivalent to it.

        Scaling u_dc, currents and magnets by the same factor is no change, so that two of them with the same factor are
        equivalent to the third.  R and the inductances of all axes with current, off by the same factor, are equivalent
        to a current scale.
        """
        explained = self.refine(Model(frozenset())).chi2 - best.chi2
        if len(best.model) >= 3:  # three that equal one: scaled currents with R and L_q scaled back are an error of L_d
            forms = [m for n in self.effects if self.linear.index[n][0] for m in self.forms([n])]
            alike = [s for m in forms if self._replaces(s := self.refine(m), best, explained)]
            if alike:
                return min(alike, key=lambda s: s.score)
        if "current_gain" in best.model.names and self.scaled_alike(best):
            rest = best.model.without("udc_gain").with_("magnet_flux")
            singles = [self.refine(self.admitted(rest.with_("current_gain", bend))) for bend in (False, True)]
            single = min(singles, key=lambda s: s.score)
            return single if self._as_complete(single, best, explained) else best
        pair = best.model.names if self.impedance_alike(best) else best.model.names & SCALES
        if len(pair) != 2:
            return best
        (third,) = SCALES - pair if pair <= SCALES else {"current_scale"}
        rest = Model(best.model.names - pair, best.model.free - pair)
        singles = [self.refine(rest.with_(third, bend)) for bend in (False, True)]
        single = min(singles, key=lambda s: s.score)
        return single if self._as_complete(single, best, explained) else best

    @staticmethod
    def _as_complete(single, best, explained) -> bool:
        """Whether one effect explains nearly as much as several do, with hardly more residual.

        A small share of a large misfit may still be significant, that is, a separate effect.
        """
        return single.chi2 - best.chi2 < SAME_SCALE * explained and single.chi2 < SAME_FIT * best.chi2

    def _replaces(self, single, best, explained) -> bool:
        """Whether one effect replaces three or more; one of them replaces the others only if these are insignificant.

        Otherwise a dominant effect would always replace two small ones.
        """
        lost = single.chi2 - best.chi2
        if single.model.names < best.model.names and lost > EARNS * self.dispersion * (len(best.model) - 1):
            return False
        return self._as_complete(single, best, explained)

    def _unscaled(self, best):
        """The best model without a current scale if one of R, L_d, L_q is off by the same factor.

        That one is then correct, and the other two are wrong.  The alternatives differ in the ripple voltage of the raw
        current, and each is compared with its own ripple voltage.
        """
        factor = best.c.get("current_gain", best.c.get("current_scale", {}))
        factor = factor.get("common", factor.get("scale", 0.0))
        right = {n for n in BY_CURRENT if n in best.c and abs(self._share(best, n) - factor) < ALIKE * abs(factor)}
        if not right:
            return best
        rest = best.model.names - right | set(BY_CURRENT) - right
        explained = self.refine(Model(frozenset())).chi2 - best.chi2
        for names in (rest - {"current_gain", "current_scale"}, rest - {"current_scale"}):
            if len(names) > len(best.model):
                continue
            plain = self.refine(self.admitted(Model(names, best.model.free & names - {"current_gain"})))
            plain = self.take_raw([plain]) or plain
            # A correction that enlarges the currents enlarges their noise, and so does a larger inductance.
            same_noise = replace(plain, chi2=plain.chi2 / best.view.noise_gain**2)
            if self._as_complete(same_noise, best, explained):
                return self._climbed(plain)
        return self.take_raw([best]) or self.refine(best.model)

    def _share(self, solution, name) -> float:
        """Relative deviation of an effect of BY_CURRENT from its nominal value."""
        m, c = self.view.machine, solution.c[name]
        nominal = {"resistance": m.resistance_ohm, "inductance_d": m.inductance_d_h, "inductance_q": m.inductance_q_h}
        return next(iter(c.values())) / nominal[name]
