# SPDX-License-Identifier: BSD-3-Clause
"""Curves over the time, as every page has them."""

from __future__ import annotations

import numpy as np
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

PICTURE_MS = 100
POINTS = 500  # pairs of smallest and largest value of a curve
WIDE = 400  # px of the column beside the curves
COLOURS = {"i_d": "#0072b2", "i_q": "#d55e00", "i_q_ref": "#000000", "u_d": "#0072b2", "u_q": "#d55e00",
           "speed": "#0072b2", "speed_ref": "#000000", "torque": "#009e73", "theta_e": "#009e73"}  # fmt: skip


def plot(title: str, names: tuple[str, ...], unit: str, sources: dict[str, ColumnDataSource]):
    """A figure over the time with a curve for each name, whose sources it adds."""
    made = figure(
        title=title, height=210, min_width=420, sizing_mode="stretch_width", y_axis_label=unit,
        tools="xpan,xwheel_zoom,crosshair,hover,reset",
    )  # fmt: skip
    for name in names:
        sources[name] = ColumnDataSource({"x": [], "y": []})
        made.line("x", "y", source=sources[name], color=COLOURS[name], legend_label=name, name=name)
    legend = made.legend[0]
    legend.update(orientation="horizontal", border_line_color=None, padding=0, margin=0)
    made.add_layout(legend, "above")  # beside the curves, never over them
    return made


def thinned(time_s: np.ndarray, curve: np.ndarray, points: int = POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest value of each of ``points`` stretches: no peak is lost."""
    size = -(-len(curve) // points)
    if size < 2:
        return time_s, curve
    count = len(curve) // size
    cut = curve[len(curve) - count * size :].reshape(count, size)
    at = time_s[len(curve) - count * size :: size]
    return np.repeat(at, 2), np.column_stack([cut.min(axis=1), cut.max(axis=1)]).ravel()
