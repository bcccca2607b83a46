# SPDX-License-Identifier: BSD-3-Clause
"""The verdict, from names and sizes; headline.py puts it into words."""

from __future__ import annotations

from fluxproof.diagnosis.ground import constants as k


def kind_of(names, train, held, channel, share, stray) -> str:
    """The verdict.

    names: Names; train, held: Sizes; channel, share: where the explained share is counted, and what it is; stray: a
    misfit outside the orders.
    """
    if not names.confidence and not names.open:
        if names.suspects:
            return "unexplained"
        return "no_mismatch" if is_usual(train) and not stray and not standing_out(train) else "unexplained"
    shares = {c: held.share(c) for c in held.channels} | {channel: share}
    # Of what any recording may have, names must explain the larger part too.
    most = {c: s.floor_times(k.FLOOR) if (shares[c] or 0.0) < k.HALF else s.above(k.FLOOR)
            for c, s in held.channels.items()}  # fmt: skip
    left = [c for c, s in held.channels.items() if s.after > most[c]]
    whole = all(shares[c] is not None and shares[c] >= 1.0 - k.SMALL for c in left)
    if not whole or stray:
        return "partly_explained" if share is not None and share >= k.HALF else "unexplained"
    return "ambiguous" if names.open else "explained"


def at_floor(sizes) -> bool:
    """Whether the misfit before any explanation is noise in every channel and order: nothing is named then.

    Here the floor counts: what effects explain above it is there, also where other recordings have as much.
    """
    orders = [s for (channel, _), s in sizes.orders.items() if channel in sizes.channels]
    return all(s.before <= s.floor_times(k.FLOOR) for s in (*sizes.channels.values(), *orders))


def is_usual(sizes) -> bool:
    """Whether any recording of this kind may have the misfit before an explanation in every channel."""
    return all(s.before <= s.above(k.FLOOR) for s in sizes.channels.values())


def standing_out(sizes) -> list:
    """[(channel, order)] whose remainder exceeds its noise floor and is a large part of what was there before."""
    return [
        key for key, s in sizes.orders.items()
        if key[0] in sizes.channels and s.after > s.above(k.FLOOR) and s.left > k.STANDS_OUT * max(s.excess, 1e-300)
    ]  # fmt: skip
