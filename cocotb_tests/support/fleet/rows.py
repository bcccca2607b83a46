# SPDX-License-Identifier: BSD-3-Clause
"""Made-up rows of a fleet's table."""

from __future__ import annotations

import datetime

import numpy as np

START = datetime.datetime(2026, 1, 1, tzinfo=datetime.timezone.utc)


def hypothesis(extras=(), evidence=0.0, values=(("magnet_flux", "magnet_flux_wb", 0.1, 1e-4),), left=(), share=0.0):
    """One set of a row."""
    return {
        "extras": list(extras),
        "evidence": evidence,
        "credible": [1.0] * len(extras),
        "estimates": [dict(effect=e, parameter=p, value=v, sigma=s, unit="Wb") for e, p, v, s in values],
        "left": [dict(signal=a, order=o, size=x, unit="V", share=c) for a, o, x, c in left],
        "left_share": share,
    }


def row(n, sets, time=None, serial=None, verdict="explained"):
    name = f"r{n:04d}"
    head = dict(recording=name, serial=serial or f"S{n:04d}", time=time, drive="drive.toml", design="d", key=name)
    return {**head, "status": "done", "verdict": verdict, "hypotheses": sets, "unknown": None, "names": []}


def flux(value, sigma=1e-4):
    return (("magnet_flux", "magnet_flux_wb", value, sigma),)


def ageing(loss, count=50, sigma=1e-4, seed=0):
    rng, days = np.random.default_rng(seed), 7.0 * np.arange(count)
    x = 0.1 * (1.0 - loss * days / days[-1]) + sigma * rng.standard_normal(count)
    return [(START + datetime.timedelta(days=float(d)), float(v), sigma) for d, v in zip(days, x, strict=True)]
