# SPDX-License-Identifier: BSD-3-Clause
"""Heat maps of the misfit: over electrical angle and current, and over the speed-current plane.

The colour of a cell is the rms over its rows k of sqrt(e_d(k)^2 + e_q(k)^2), the magnitude of the dq misfit;
before and after share one colour scale.  The arrays are those of diagnosis.result.Evidence.
"""

from __future__ import annotations

import numpy as np
from matplotlib.colors import Normalize

from fluxproof.diagnosis.report import theme

CELLS = (28, 24, 20, 16, 13, 10)  # along each axis, finest first; with 28 a cell is 4 pixels wide on a phone
FILLED = 0.9  # least filled share relative to the coarsest grid: finer cells leave empty stripes between points
SPARSE = 0.35  # least filled share of the coarsest grid for a map; below it each fine cell is drawn as a square
QUIET = 3.0  # times the noise: least upper end of the colour scale, so that noise alone does not look significant
NOTHING = 1e-9


class LeftOut(Exception):
    """A picture cannot be drawn; the message gives the reason in the report."""


def length(e, when: str) -> np.ndarray:
    """Magnitude of the dq misfit [V], shape (n,); ``when``: "before" or "after"."""
    return np.hypot(e[f"{when}_d"], e[f"{when}_q"])


def along_current(e) -> tuple[np.ndarray, str]:
    """The current that varies most, and its label."""
    name = max(("i_q", "i_d"), key=lambda axis: np.ptp(e[axis]))
    return e[name], f"${name}$ [A]"


def angle_current(e) -> theme.Picture:
    """Misfit over the electrical angle, 0 to 360 degrees, and the current that varies most."""
    current, label = along_current(e)
    angle = np.degrees(e["theta_e"]) % 360.0
    caption = (
        "Misfit over electrical angle and current. Horizontal bands depend on the current, vertical ones on the angle."
    )
    figure = _before_after(e, angle, current, "electrical angle [°]", label, range_x=(0.0, 360.0))
    return theme.picture("angle_current", figure, caption + _scale(e))


def speed_current(e) -> theme.Picture:
    """Misfit over electrical speed and the current that varies most."""
    current, label = along_current(e)
    figure = _before_after(e, e["omega_e"], current, "electrical speed [rad/s]", label)
    caption = "Misfit over speed and current. Brighter to the sides: grows with speed; to top and bottom: with load."
    return theme.picture("speed_current", figure, caption + _scale(e))


def _scale(e) -> str:
    return " The line on the colour scale is the noise." if "noise" in e else ""


def _before_after(e, x, y, x_label: str, y_label: str, range_x=None):
    """One or two maps (before, after) side by side with a common colour scale."""
    spans = [range_x or (x.min(), x.max()), (y.min(), y.max())]
    if any(high - low < NOTHING * max(abs(high), 1.0) for low, high in spans):
        raise LeftOut("speed or current does not vary in this recording")
    shown = [when for when in ("before", "after") if f"{when}_d" in e and f"{when}_q" in e]
    count = _count(x, y, spans)
    maps = [_cells(x, y, length(e, when), spans, count) for when in shown]
    noise = np.sqrt(2.0) * float(np.ravel(e["noise"])[0]) if "noise" in e else 0.0  # of two axes
    top = max(float(np.nanpercentile(maps[0][0], 99)), QUIET * noise) or 1.0
    scale = Normalize(0.0, top)
    figure, panels = theme.panels(1, len(shown), height=2.5, sharey=True, squeeze=False)
    for axis, when, (values, edges_x, edges_y) in zip(panels[0], shown, maps, strict=True):
        image = _draw(axis, values, edges_x, edges_y, scale)
        axis.set(title=e.get("words", {}).get(when, when) if len(shown) > 1 else "misfit", ylim=_wider(spans[1]))
        axis.set_xlim(range_x or _wider(spans[0]))
        if range_x:
            axis.set_xticks([90, 180, 270])
    panels[0][0].set_ylabel(y_label)
    figure.supxlabel(x_label, fontsize=10, color=theme.SOFT)
    bar = figure.colorbar(image, ax=panels[0], extend="max", shrink=0.95, pad=0.03)
    bar.ax.set_title("V", fontsize=9, loc="center", fontweight="normal", color=theme.SOFT)
    bar.outline.set_visible(False)
    if noise > 0.0:
        bar.ax.axhline(noise, color="white", linewidth=1.2)
    return figure


def _count(x, y, spans) -> int:
    """Number of cells per axis: the finest grid that the operating points fill; the finest of all for sparse points."""
    filled = {n: np.count_nonzero(np.histogram2d(x, y, n, spans)[0]) / n**2 for n in CELLS}
    coarsest = filled[CELLS[-1]]
    return next(n for n in CELLS if filled[n] >= FILLED * coarsest) if coarsest >= SPARSE else CELLS[0]


def _cells(x, y, values, spans, count: int):
    """rms per cell, (count, count), NaN in empty cells; and the cell edges."""
    total, edges_x, edges_y = np.histogram2d(x, y, count, spans, weights=values**2)
    filled = np.histogram2d(x, y, count, spans)[0]
    return np.sqrt(np.divide(total, filled, out=np.full_like(total, np.nan), where=filled > 0.0)), edges_x, edges_y


def _wider(span, share=0.04):
    more = share * (span[1] - span[0])
    return span[0] - more, span[1] + more


def _draw(axis, values, edges_x, edges_y, scale):
    filled = np.isfinite(values)
    axis.grid(visible=False)
    if filled.mean() >= SPARSE:
        axis.set_facecolor(theme.EMPTY)
        extent = (edges_x[0], edges_x[-1], edges_y[0], edges_y[-1])
        at = dict(extent=extent, origin="lower", aspect="auto", interpolation="none")
        return axis.imshow(values.T, norm=scale, **at)
    centre_x, centre_y = ((edges[1:] + edges[:-1]) / 2 for edges in (edges_x, edges_y))
    column, row = np.nonzero(filled)
    size = 70 if filled.sum() < 60 else 26
    marks = dict(marker="s", s=size, linewidth=0.6, edgecolor=theme.AXIS, clip_on=False)
    return axis.scatter(centre_x[column], centre_y[row], c=values[filled], norm=scale, **marks)
