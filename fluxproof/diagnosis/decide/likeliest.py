# SPDX-License-Identifier: BSD-3-Clause
"""The causes that fit an unexplained misfit best, with their probability, and what speaks against them."""

from __future__ import annotations

from fluxproof.diagnosis.decide.estimates import estimates_in
from fluxproof.diagnosis.decide.sizes import Sizes, measured_torque
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import BestFit, NamedEffect

NO_SIZE, WORSE = AGAINST = ("its size is compatible with zero", "held-out points are worse with it")


def likeliest(searched, sizeless, held) -> BestFit | None:
    """The best fit among the sets that a simulation has parameters for; None if no effect is more probable than none.

    searched: the posterior over all sets; sizeless: effects without a size; held: (b,) held-out blocks.
    """
    setup, weights = searched.setup, searched.weights()
    able = [(p, fit) for p, fit in weights if all(setup.effects[n].named for n in fit.names)]
    if not able or not able[0][1].names:
        return None
    p, fit = able[0]
    before, left = (_left(setup, y, held) for y in (setup.cells.y, fit.left()))
    present = searched.present()
    effects = tuple(NamedEffect(n, min(present[n], 0.999), estimates_in(fit, n), 0.0) for n in fit.names)
    return BestFit(effects, float(p), left, _against(p, fit, sizeless, left / max(before, 1e-300)))


def _left(setup, y, held) -> float:
    """rms of a misfit (r,) at held-out points, of the voltage or of the torque where no voltage was recorded."""
    sizes = Sizes(setup, setup.cells.y, y, held, measured_torque(setup))
    found = sizes.channels.get(sizes.compared())
    return found.after if found else 0.0


def _against(p, fit, sizeless, share) -> str:
    """Why the best fit is not asserted; share: of the misfit's rms that it leaves."""
    if sizeless.intersection(fit.names):
        return NO_SIZE
    if share >= 1.0:
        return WORSE
    if 1.0 - share**2 < k.HALF:
        return f"it leaves {100 * share:.0f} % of the misfit"
    return "other sets of effects fit as well" if p < 1.0 - k.DOUBTED else "the residual may imitate it"
