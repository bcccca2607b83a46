"""Effects that scale one thing, and what several of them together amount to: another scale, or nothing at all.

The balance knows ratios only.  Bus, currents and magnets scaled alike are no change, and so are currents with R, L_d
and L_q: any of such a set are the rest of it, and where what was found are alike the fewer and plainer names are right.
"""

from __future__ import annotations

from dataclasses import replace

from fluxproof.diagnosis.effect import ALIKE
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.ties import SCALES, Ties

EARNS = 30.0  # gain in chi^2 over dispersion that an effect must bring beside the freest form of the others
SAME_SCALE = 0.03  # of what is explained: so much may be lost by one scale in place of two
SAME_FIT = 1.25  # of chi^2: so much worse may one effect be in place of several
BY_CURRENT = ("resistance", "inductance_d", "inductance_q")  # voltage or flux in proportion to the current


class Scales(Ties):
    """Refined solutions with the scales among their effects called by their plainest names."""

    def _simplified(self, best) -> Solution:
        """The best model with two scales that amount to a third one taken for that.

        All of (u_dc, current, magnets) scaled alike is no change at all, so any two of them alike are the third.
        Ohms and the inductances of all axes with current, off alike, are the current's scale.
        """
        explained = self.refine(Model(frozenset())).chi2 - best.chi2
        if len(best.model) >= 3:  # three that amount to one: scaled currents with R and L_q set right again are L_d
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
        """Whether one effect in place of several loses little of what they explain, and leaves hardly more than they.

        Of a large misfit even a small share is many times the noise: an effect of its own.
        """
        return single.chi2 - best.chi2 < SAME_SCALE * explained and single.chi2 < SAME_FIT * best.chi2

    def _replaces(self, single, best, explained) -> bool:
        """Whether one effect explains what three or more do: one of themselves only if the others do not earn a place.

        Of a dominant one and two small ones the dominant one is always most of it.
        """
        lost = single.chi2 - best.chi2
        if single.model.names < best.model.names and lost > EARNS * self.dispersion * (len(best.model) - 1):
            return False
        return self._as_complete(single, best, explained)

    def _unscaled(self, best):
        """The best model without a scale of all currents where an inductance, or the ohms, are off by the same factor.

        Such a one is right, and the others of R, L_d and L_q are wrong.  Each of the two leaves another ripple voltage
        of the raw current: they are compared with what each of them makes of it.
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
            # What makes larger currents of the recorded ones makes larger noise of theirs; so does a larger inductance.
            same_noise = replace(plain, chi2=plain.chi2 / best.view.noise_gain**2)
            if self._as_complete(same_noise, best, explained):
                return self._climbed(plain)
        return self.take_raw([best]) or self.refine(best.model)

    def _share(self, solution, name) -> float:
        """How far an effect of BY_CURRENT is off its nominal value, relative."""
        m, c = self.view.machine, solution.c[name]
        nominal = {"resistance": m.resistance_ohm, "inductance_d": m.inductance_d_h, "inductance_q": m.inductance_q_h}
        return next(iter(c.values())) / nominal[name]
