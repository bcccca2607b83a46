# SPDX-License-Identifier: BSD-3-Clause
"""The README's picture of a fleet: a parameter over the drives, a drift; `python -m studies.fleet --picture FILE`."""

from __future__ import annotations

import os
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from fluxproof.diagnosis.report import theme
from studies.fleet.figures import Study, ageing, production


def draw(study: Study, path: Path) -> Path:
    """Write the picture, by temporary name and renaming."""
    _, line, _ = production(study)
    _, life = ageing(study)
    with mpl.rc_context({**theme.STYLE, "figure.facecolor": "white"}):
        figure = Figure(figsize=(10.0, 3.3), layout="constrained")
        left, right = figure.subplots(1, 2)
        (design,), outlying = line.findings.designs[:1], set(line.findings.designs[0].outliers)
        _population(left, next(p for p in design.populations if p.parameter == "magnet_flux_wb"), outlying)
        drifts = [d for d in life.findings.designs[0].drifts if d.parameter == "magnet_flux_wb"]
        if drifts:
            _drift(right, drifts[0])
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{os.getpid()}.{path.name}")
        figure.savefig(temporary, dpi=110, facecolor="white", metadata={"Software": None})
        os.replace(temporary, path)
    return path


def _population(axis, pop, outlying):
    order = np.argsort(pop.x, kind="stable")
    at = np.arange(len(order))
    axis.axhspan(1e3 * (pop.mean - 2 * pop.spread), 1e3 * (pop.mean + 2 * pop.spread), color=theme.BAND)
    axis.axhline(1e3 * pop.mean, color=theme.INK, linewidth=1.0)
    axis.errorbar(at, 1e3 * pop.x[order], 2e3 * pop.s[order], fmt="none", ecolor=theme.RECORDED)
    flagged = np.array([pop.serials[n] in outlying for n in order])
    axis.plot(at[~flagged], 1e3 * pop.shrunk[order][~flagged], "o", color=theme.AFTER, markersize=3)
    axis.plot(at[flagged], 1e3 * pop.x[order][flagged], "o", color=theme.BEFORE, markersize=6)
    axis.set(xlabel="drives, sorted", ylabel="magnet flux [mWb]", title=f"{len(order)} drives")
    theme.key(axis, ("recording ± 2 σ", theme.RECORDED), ("drive", theme.AFTER), ("another fault", theme.BEFORE))


def _drift(axis, found):
    days = np.array([(t - found.times[0]).total_seconds() / 86400.0 for t in found.times])
    axis.errorbar(days, 1e3 * found.x, 2e3 * found.s, fmt="o", color=theme.RECORDED, markersize=3)
    axis.plot(days, 1e3 * (found.line.a + found.line.b * days), color=theme.AFTER)
    if found.noticed is not None:
        axis.axvline(days[found.noticed], color=theme.BEFORE, linewidth=1.2, linestyle=(0, (4, 2)))
    axis.set(xlabel="days", ylabel="magnet flux [mWb]", title="One drive over its life")
    theme.key(axis, ("recording", theme.RECORDED), ("rate", theme.AFTER), ("noticed", theme.BEFORE))
