# SPDX-License-Identifier: BSD-3-Clause
"""Whether an interpretation is a mistaken convention and no coincidence: met exactly, in place of effects."""

from __future__ import annotations

from fluxproof.diagnosis.effects.constant import rescaled


def is_exact(readings, left, effects) -> bool:
    """Whether no effect that is still needed rescales a quantity that an interpretation rescales already.

    Currents in rms that still need a gain error of a few per cent are a gain error by chance near that factor.
    """
    return not any(rescaled(effects[n]) & r.touches for n in left for r in readings)


def is_simpler(readings, left, most, absurd) -> bool:
    """Whether the interpretations, and the effects ``left`` beside them, are no more than ``most`` effects without.

    Other pole pairs scale L_d, L_q and psi: instead of one effect of a plausible size they would be chance; absurd:
    whether the effects without an interpretation have sizes outside of what is plausible.  Two factors that are met
    exactly are one constant that is off: voltages and R, L at twice are a magnet flux at half, which is one mistake.
    So several interpretations must replace more effects than they are.
    """
    cost = sum(1 + bool(r.pole_pairs and not absurd) for r in readings)
    several = len(readings) > 1  # each factor is one point of a free size: so many of them must replace more effects
    return len(left) + cost + several <= most or (absurd and not left)
