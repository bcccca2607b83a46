# SPDX-License-Identifier: BSD-3-Clause
"""Recordings with the same unexplained remainder: an unknown effect that is seen often is a discovery.

The signature of a remainder is a vector with a place for each signal and signed electrical order, whose squares are the
shares of the remainder's power, and a place for each cause beyond the catalogue that it looks like.  The cosine between
two signatures is 1 for the same remainder of any size.  Clusters are those of average linkage at the distance
GROUP_APART.  A recording that leaves next to nothing joins a group if its effects are what the group's cause looks
like, and the little that is left is alike.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from fluxproof.diagnosis.fleet.rates import Weighed
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.suspects import SUSPECTS

FAINT = -1.0  # any share left, also of less than the noise


@dataclass(frozen=True)
class Line:
    """A place of a group's signature: share of the remainder's power, and median size with the middle half."""

    signal: str
    order: float
    share: float
    size: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Group:
    """Drives whose remainder has one signature.  looks_like: causes or terms with the number of recordings.

    companions: effects that half of the recordings or more have beside it.  What comes with the same unknown remainder
    again and again is a part of it, which the effect imitates, and no fault of its own.
    """

    serials: tuple[str, ...]
    recordings: tuple[str, ...]
    lines: tuple[Line, ...]
    looks_like: tuple[tuple[str, int], ...]
    companions: tuple[str, ...]


def signature(weighed: Weighed | None, least=k.SMALL) -> dict[tuple[str, float], float]:
    """The remainder of a recording, a vector of the length 1; empty if no more than the share ``least`` is left."""
    if weighed is None:
        return {}
    best = weighed.best
    power = defaultdict(float)
    if (best["left_share"] or 0.0) > least:
        for part in best["left"]:
            if part["size"] is not None:
                power[part["signal"], float(part["order"])] += max(part["share"] or 0.0, 0.0)
    total = sum(power.values())
    out = {place: np.sqrt(value / total) for place, value in power.items()} if total > 0.0 else {}
    out |= {(f"as if {SUSPECTS[n].clause}", 0.0): 1.0 for n, p in weighed.present.items() if n in SUSPECTS and p > 0.5}
    length = np.sqrt(sum(v**2 for v in out.values()))
    return {place: float(v / length) for place, v in out.items()} if length > 0.0 else {}


def groups(rows: list[dict], weighed: list[Weighed | None]) -> list[Group]:
    """The groups of at least GROUP_DRIVES drives, the largest first."""
    found = [(row, w, s) for row, w in zip(rows, weighed, strict=True) if (s := signature(w))]
    if len(found) < k.GROUP_DRIVES:
        return []
    places = sorted({place for _, _, s in found for place in s})
    table = np.array([[s.get(place, 0.0) for place in places] for _, _, s in found])
    labels = fcluster(linkage(table, "average", metric="cosine"), k.GROUP_APART, "distance")
    rest = [(row, w) for row, w in zip(rows, weighed, strict=True) if not signature(w)]
    faint, out = [(row, w, s) for row, w in rest if (s := signature(w, FAINT))], []
    for label in np.unique(labels):
        mine = [found[n] for n in np.flatnonzero(labels == label)]
        if len({row["serial"] for row, _, _ in mine}) < k.GROUP_DRIVES:
            continue
        mine += _joining(faint, mine)
        serials, recordings = (tuple(sorted({row[key] for row, _, _ in mine})) for key in ("serial", "recording"))
        out.append(Group(serials, recordings, tuple(_lines(mine)), _looks(mine), _companions(mine)))
    return sorted(out, key=lambda g: (-len(g.serials), g.serials))


def _joining(faint, mine) -> list:
    """Those of the recordings ``faint`` whose effects are all companions of a group and whose remainder is alike."""
    companions, places = set(_companions(mine)), {place for _, _, s in mine for place in s}
    mean = {place: np.mean([s.get(place, 0.0) for _, _, s in mine]) for place in places}
    length = np.sqrt(sum(v**2 for v in mean.values()))
    alike = lambda s: sum(v * mean.get(place, 0.0) for place, v in s.items()) >= (1.0 - k.GROUP_APART) * length  # noqa: E731
    present = lambda w: {e for e, p in w.present.items() if p > 0.5}  # noqa: E731
    return [(row, w, s) for row, w, s in faint if present(w) and present(w) <= companions and alike(s)]


def _lines(mine) -> list[Line]:
    """Places of the signature that half of the recordings have, the largest first."""
    shares: dict[tuple[str, float], list[float]] = defaultdict(list)
    sizes, units = defaultdict(list), {}
    for _, weighed, own in mine:
        for place, value in own.items():
            shares[place].append(value**2)
        for part in weighed.best["left"]:
            place = (part["signal"], float(part["order"]))
            if place in own and part["size"] is not None:
                sizes[place].append(part["size"])
                units[place] = part["unit"]
    out = []
    for place, values in shares.items():
        if len(values) * 2 >= len(mine):
            low, size, high = np.quantile(sizes[place], (0.25, 0.5, 0.75)) if sizes[place] else (np.nan,) * 3
            spread = (float(np.median(values)), float(size), float(low), float(high))
            out.append(Line(*place, *spread, units.get(place, "")))
    return sorted(out, key=lambda line: -line.share)


def _companions(mine) -> tuple[str, ...]:
    seen = Counter(e for _, weighed, _ in mine for e, p in weighed.present.items() if p > 0.5)
    return tuple(sorted(e for e, count in seen.items() if 2 * count >= len(mine) and e not in SUSPECTS))


def _looks(mine) -> tuple[tuple[str, int], ...]:
    """What the recordings' own answers say of the remainder, the most frequent first."""
    said = Counter()
    for row, _, _ in mine:
        unknown = row.get("unknown")
        if unknown:
            said[unknown["meaning"] or unknown["formula"]] += 1
    return tuple(sorted(said.items(), key=lambda entry: (-entry[1], entry[0]))[:4])
