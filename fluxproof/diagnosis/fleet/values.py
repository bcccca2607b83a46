# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of recordings and of drives, averaged over the sets of effects that are possible."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from fluxproof.diagnosis.fleet.population import pooled
from fluxproof.diagnosis.fleet.rates import Weighed
from fluxproof.diagnosis.ground import constants as k

LEAST_SHARE = 1e-3  # of the probability: sets below it move no value


def values_of(weighed: Weighed | None) -> dict[tuple[str, str], tuple[float, float, str]]:
    """{(effect, parameter): (value, sigma, unit)} of a recording: mean over its sets, their differences in sigma."""
    if weighed is None:
        return {}
    found = defaultdict(list)
    for p, h in weighed.sets:
        if p < LEAST_SHARE:
            break
        for e in h["estimates"]:
            if e["value"] is not None and e["sigma"]:
                found[e["effect"], e["parameter"]].append((p, e["value"], e["sigma"], e["unit"]))
    out = {}
    for key, entries in found.items():
        p, x, s = (np.array(column) for column in list(zip(*entries, strict=True))[:3])
        if p.sum() < 0.5:  # of a set that is not believed
            continue
        told = s <= k.USELESS * s.min()  # a set that does not determine the parameter is ignored
        p, x, s = p[told], x[told], s[told]
        p = p / p.sum()
        mean = float(p @ x)
        sigma = float(np.sqrt(p @ (s**2 + (x - mean) ** 2)))
        if sigma < k.USELESS * abs(mean):
            out[key] = (mean, sigma, entries[0][3])
    return out


def by_drive(serials, values) -> dict[tuple[str, str], dict[str, tuple[float, float, str]]]:
    """{(effect, parameter): {serial: (value, sigma, unit)}}, recordings of a drive pooled."""
    lists = defaultdict(lambda: defaultdict(list))
    for serial, mine in zip(serials, values, strict=True):
        for key, entry in mine.items():
            lists[key][serial].append(entry)
    return {
        key: {
            serial: (*pooled([e[0] for e in entries], [e[1] for e in entries]), entries[0][2])
            for serial, entries in sorted(drives.items())
        }
        for key, drives in sorted(lists.items())
    }
