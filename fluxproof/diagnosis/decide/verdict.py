# SPDX-License-Identifier: BSD-3-Clause
"""The kind of a verdict, from names and sizes: of a posterior, of one operating point, and under an interpretation."""

from __future__ import annotations

from fluxproof.diagnosis.decide.credibility import credibilities
from fluxproof.diagnosis.ground import constants as k

WHOLE = ("explained", "ambiguous")  # verdicts on what was found of a misfit that it explains


def kind_of(names, train, held, channel, share, stray) -> str:
    """The verdict of a posterior.

    names: Names; train, held: Sizes; channel, share: where the explained share is counted, and what it is; stray: a
    misfit outside the orders.
    """
    if not names.asserted:
        agrees = is_usual(train, bool(names.minor)) and not stray and not standing_out(train)
        return "no_mismatch" if agrees and not names.suspects else "unexplained"
    if stray or not _is_whole(held, {c: held.share(c) for c in held.channels} | {channel: share}):
        return "partly_explained" if share is not None and share >= k.HALF else "unexplained"
    return "ambiguous" if names.ambiguous else "explained"


def without_imitations(kind, names, best) -> str:
    """The kind of a verdict where much is left: if that may imitate every name (credibility.py), nothing is explained.

    A sudden loss of flux, without an effect for it, was half explained by gains of currents and bus.
    """
    if kind != "partly_explained" or not names.asserted & set(best.names):
        return kind
    real = credibilities(best)
    sure = any(real[n] >= 1.0 - k.DOUBTED for n in names.asserted & set(best.names))
    return kind if sure else "unexplained"


def kind_of_one_point(names, groups, left_over, quiet) -> str:
    """The verdict of one operating point, from the drifts that are named and the groups that are ambiguous.

    left_over: a part of drift or constant is not explained; quiet: there is nothing to explain.
    """
    if not (names or groups):
        return "no_mismatch" if quiet else "unexplained"
    if left_over and names:
        return "partly_explained"
    return "ambiguous" if groups else "explained"


def kind_as_interpreted(kind, share, remainder) -> str:
    """The verdict on the recording as documented, of one whose verdict is ``kind`` under an interpretation.

    share: of the documented misfit that the interpretation explains; remainder: what is left.  An interpretation
    explains a misfit although nothing is left for an effect.
    """
    if kind == "no_mismatch":
        return "explained"
    if kind == "unexplained" and remainder and share >= k.HALF:
        return "partly_explained"
    return kind


def at_floor(sizes) -> bool:
    """Whether the misfit before any explanation is noise in every channel and order: nothing is named then.

    Here the floor counts: what effects explain above it is there, also where other recordings have as much.
    """
    orders = [s for (channel, _), s in sizes.orders.items() if channel in sizes.channels]
    return all(s.before <= s.floor_times(k.FLOOR) for s in (*sizes.channels.values(), *orders))


def is_usual(sizes, explained=False) -> bool:
    """Whether any recording of this kind may have the misfit in every channel; explained: what is left of it."""
    return all((s.after if explained else s.before) <= s.above(k.FLOOR) for s in sizes.channels.values())


def standing_out(sizes) -> list:
    """[(channel, order)] whose remainder exceeds its noise floor and is a large part of what was there before."""
    return [
        key for key, s in sizes.orders.items()
        if key[0] in sizes.channels and s.after > s.above(k.FLOOR) and s.left > k.STANDS_OUT * max(s.excess, 1e-300)
    ]  # fmt: skip


def _is_whole(held, shares) -> bool:
    """Whether every measured channel is explained: at the floor, or up to what the formulas' own error leaves.

    Of what any recording may have, names must explain the larger part too.
    """
    most = {c: s.floor_times(k.FLOOR) if (shares[c] or 0.0) < k.HALF else s.above(k.FLOOR)
            for c, s in held.channels.items()}  # fmt: skip
    left = [c for c, s in held.channels.items() if s.after > most[c]]
    return all(shares[c] is not None and shares[c] >= 1.0 - k.SMALL for c in left)
