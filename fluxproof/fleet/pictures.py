# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of fleet.html: verdicts, a parameter over the population, a drift, the signature of a group."""

from __future__ import annotations

import functools

import matplotlib as mpl
import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

from fluxproof.diagnosis.ground.quantities import number, unit_text
from fluxproof.diagnosis.report import theme

MOST_DRIVES = 120  # of a picture: beyond, every n-th drive is drawn, and every outlier


def styled(draw):
    """A drawing function under the common style."""

    @functools.wraps(draw)
    def wrapped(*args, **kwargs):
        with mpl.rc_context(theme.STYLE):
            return draw(*args, **kwargs)

    return wrapped


@styled
def verdicts(counts: dict[str, int]) -> theme.Picture:
    """How many recordings of which verdict."""
    rows = sorted(counts.items(), key=lambda entry: -entry[1])
    figure, axis = theme.axes(height=0.6 + 0.33 * len(rows))
    top = max(counts.values())
    for place, (_, count) in enumerate(rows):
        axis.barh(place, count, 0.7, color=theme.AFTER)
        axis.annotate(str(count), (count, place), (4, 0), textcoords="offset points", va="center")
    axis.set_yticks(range(len(rows)), [theme.plain(name.replace("_", " ")) for name, _ in rows])
    axis.set(xlim=(0, 1.15 * top), xlabel="recordings")
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="y", visible=False)
    axis.invert_yaxis()
    return theme.picture("verdicts", figure, "Recordings by the verdict that each has by itself.")


@styled
def population(pop, name: str, outlying: set[str]) -> theme.Picture:
    """A parameter over the drives: what each recording says with its sigma, and the value shrunk to the others."""
    order = np.argsort(pop.x, kind="stable")
    step = max(1, -(-len(order) // MOST_DRIVES))
    chosen = [n for k, n in enumerate(order) if k % step == 0 or pop.serials[n] in outlying]
    at = np.arange(len(chosen))
    figure, axis = theme.axes(height=2.7)
    axis.axhspan(pop.mean - 2 * pop.spread, pop.mean + 2 * pop.spread, color=theme.BAND, zorder=0)
    axis.axhline(pop.mean, color=theme.INK, linewidth=1.0)
    axis.errorbar(at, pop.x[chosen], 2 * pop.s[chosen], fmt="none", ecolor=theme.RECORDED, elinewidth=0.9)
    axis.plot(at, pop.shrunk[chosen], "o", color=theme.AFTER, markersize=2.6, linestyle="none")
    out = [k for k, n in enumerate(chosen) if pop.serials[n] in outlying]
    if out:
        axis.plot(at[out], pop.x[np.array(chosen)[out]], "o", color=theme.BEFORE, markersize=4.2, linestyle="none")
    axis.set(xlabel="drives, sorted", ylabel=theme.plain(f"{pop.parameter} [{unit_text(pop.unit)}]"), xticks=[])
    theme.key(axis, ("recording ± 2 σ", theme.RECORDED), ("shrunk", theme.AFTER), ("outlier", theme.BEFORE))
    caption = (
        f"{pop.parameter}: mean {number(pop.mean)} ± {number(pop.mean_sigma, 2)}, spread of drives "
        f"{number(pop.spread, 3)} ± {number(pop.spread_sigma, 2)} {unit_text(pop.unit)}; uncertainty of a recording "
        f"{number(float(np.median(pop.s)), 2)} {unit_text(pop.unit)}. Band: two spreads."
    )
    return theme.picture(name, figure, caption)


@styled
def drift(found, name: str) -> theme.Picture:
    """A parameter of one drive over time, its line, and the limit."""
    figure, axis = theme.axes(height=2.5)
    axis.errorbar(found.times, found.x, 2 * found.s, fmt="o", color=theme.RECORDED, markersize=3, elinewidth=0.9)
    days = np.array([(t - found.times[0]).total_seconds() / 86400.0 for t in found.times])
    axis.plot(found.times, found.line.a + found.line.b * days, color=theme.AFTER)
    if found.noticed is not None:
        axis.axvline(found.times[found.noticed], color=theme.INK, linewidth=1.0, linestyle=(0, (4, 2)))
    span = np.ptp(found.x)
    if found.limit is not None and abs(found.limit - found.x.mean()) < 3.0 * span:
        axis.axhline(found.limit, color=theme.BEFORE, linewidth=1.0)
    locator = AutoDateLocator(maxticks=6)
    axis.xaxis.set_major_locator(locator)
    axis.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    axis.set(ylabel=theme.plain(f"{found.parameter} [{unit_text(found.unit)}]"))
    return theme.picture(name, figure, f"{found.serial}: {found.parameter} over time; dashed: noticed.")


@styled
def signature(group, name: str) -> theme.Picture:
    """The places of a group's common remainder."""
    lines = group.lines[:8]
    figure, axis = theme.axes(height=0.7 + 0.33 * len(lines))
    for place, line in enumerate(lines):
        axis.barh(place, line.share, 0.7, color=theme.BEFORE)
        size = f"{line.size:.3g} {line.unit}" if np.isfinite(line.size) else ""
        axis.annotate(theme.plain(size), (line.share, place), (4, 0), textcoords="offset points", va="center")
    axis.set_yticks(range(len(lines)), [theme.plain(place_text(line)) for line in lines])
    axis.set(xlim=(0, 1.25 * max(line.share for line in lines)), xlabel="share of the residual's power")
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="y", visible=False)
    axis.invert_yaxis()
    return theme.picture(name, figure, f"Common signature of {len(group.serials)} drives, with the median rms size.")


def place_text(line) -> str:
    """A place of a signature in words: 'u_dq, order 2'."""
    return line.signal if line.signal.startswith("as if") else f"{line.signal}, order {line.order:g}"
