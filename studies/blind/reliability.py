# SPDX-License-Identifier: BSD-3-Clause
"""Whether names stated with a confidence p are right in a share p of the cases."""

from __future__ import annotations

from itertools import pairwise

from studies.blind.figures import rate, true_names

EDGES = (0.95, 0.98, 0.99, 0.995, 0.999, 1.0)  # five bins; below 0.95 nothing is named


def reliability(cases) -> list[dict]:
    """[{"low", "high", "stated": mean confidence, "value": share that is right, "k", "n", ...}] of all names."""
    names = [(e["confidence"], e["name"] in true_names(t)) for t, a in cases for e in a.get("effects", [])]
    bins = []
    for low, high in pairwise(EDGES):
        mine = [(p, right) for p, right in names if low <= p < high or (p >= high == 1.0)]
        stated = sum(p for p, _ in mine) / len(mine) if mine else None
        bins.append({"from": low, "to": high, "stated": stated, **_ends(rate("", [right for _, right in mine]))})
    return bins


def _ends(figure: dict) -> dict:
    """A rate whose interval is called interval, as from and to are the bin's."""
    return {**{k: figure[k] for k in ("value", "k", "n")}, "interval": [figure["low"], figure["high"]]}
