# SPDX-License-Identifier: BSD-3-Clause
"""Forward selection by BIC over the catalogue's own effects: the greedy fit that an engineer with the catalogue writes.

All channels are one regression, each row over its noise.  Step by step the effect whose formula lowers

    BIC = n log(RSS / n) + k log n

most is added, with all its columns and a new fit of all, until none lowers it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.catalogue import CATALOGUE
from studies.compare.data import Data, averaged

FIT_GRID = [{"rows": rows, "price": price} for rows in (20, 50) for price in (1.0, 3.0, 10.0)]
NAME_GRID = [{"share": s} for s in (0.0, 0.02, 0.05, 0.1, 0.2, 0.3)]


@dataclass
class Forward:
    """shares: {effect: share of the misfit's power that its own columns explain}; left: complex (b,) [V]."""

    shares: dict[str, float]
    left: np.ndarray


def fit(data: Data, rows: int, price: float) -> Forward:
    """Select effects; price: factor on the log n that BIC asks for a coefficient."""
    use, sigma = {c: data.fitted(c) for c in data.misfit}, {}
    for name, x in data.misfit.items():
        step = np.diff(averaged(x[use[name]], rows), axis=1)
        sigma[name] = float(np.nanmedian(np.abs(step))) + 1e-12

    def stacked(channels: dict[str, np.ndarray]) -> np.ndarray:
        parts = []
        for name, x in data.misfit.items():
            column = np.broadcast_to(channels.get(name, 0.0 * x), x.shape)[use[name]]
            mean = averaged(column, rows).ravel() / sigma[name]
            parts += [mean.real, mean.imag] if np.iscomplexobj(x) else [mean.real]
        return np.concatenate(parts)

    columns = {n: list(e.core(data.view).values()) for n, e in data.view.visible(CATALOGUE).items()}
    candidates = {n: np.array([stacked(c) for c in made]).T for n, made in columns.items() if made}
    candidates = {n: x[:, np.abs(x).max(axis=0) > 0.0] for n, x in candidates.items()}
    y = stacked(data.misfit)
    chosen: list[str] = []

    def bic(names: list[str]) -> tuple[float, np.ndarray]:
        x = np.concatenate([candidates[n] for n in names], axis=1) if names else np.zeros((len(y), 0))
        c = np.linalg.lstsq(x, y, rcond=None)[0]
        rss = float(np.sum((y - x @ c) ** 2))
        return len(y) * np.log(rss / len(y)) + price * x.shape[1] * np.log(len(y)), c

    best, c = bic(chosen)
    while True:
        tried = {n: bic([*chosen, n]) for n in candidates if n not in chosen and candidates[n].shape[1]}
        if not tried:
            break
        name = min(tried, key=lambda n: tried[n][0])
        if tried[name][0] >= best:
            break
        chosen.append(name)
        best, c = tried[name]
    total, at, shares, left = float(y @ y), 0, {}, data.misfit["u"].mean(axis=1)
    for name in chosen:
        width = candidates[name].shape[1]
        part = candidates[name] @ c[at : at + width]
        shares[name] = float(part @ part) / total
        made = [m for m in columns[name] if np.abs(stacked(m)).max() > 0.0]
        for k, column in enumerate(made):
            left = left - c[at + k] * np.broadcast_to(column.get("u", 0.0), data.misfit["u"].shape).mean(axis=1)
        at += width
    return Forward(shares, left)


def names(fitted: Forward, share: float) -> list[str]:
    """Effects that explain at least ``share`` of the misfit's power."""
    return sorted(n for n, s in fitted.shares.items() if s >= share)
