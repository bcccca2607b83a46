# SPDX-License-Identifier: BSD-3-Clause
"""What the explanations found, over time: the size of one parameter with two standard deviations."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from bokeh.models import ColumnDataSource, Select, Whisker
from bokeh.plotting import figure

from fluxproof.watch.explain import Explanation
from golden_model.drive import Drive

SIGMAS = 2.0


class Sizes:
    """One view's picture of the size of a parameter; not seen until an explanation has one."""

    def __init__(self, drive: Drive) -> None:
        self.sample_time_s = drive.sample_time_s
        self.source = ColumnDataSource({"x": [], "y": [], "low": [], "high": []})
        self.chosen = Select(title="Size over time of", options=[], value="", name="size", width=240, visible=False)
        self.plot = figure(
            title="Size by each explanation, +- 2 sigma", height=210, min_width=420, sizing_mode="stretch_width",
            tools="xpan,xwheel_zoom,crosshair,hover,reset", x_axis_label="s since the reset", visible=False,
        )  # fmt: skip
        self.plot.scatter("x", "y", source=self.source, size=7, color="#0072b2", name="sizes")
        self.plot.add_layout(Whisker(base="x", upper="high", lower="low", source=self.source))
        self.drawn: tuple = ()

    def renew(self, found: Iterable[Explanation]) -> None:
        """Draw the explanations that name the chosen parameter; the one named last where none was chosen."""
        known = list(found)
        names: list[Any] = sorted({name for e in known for name in e.sizes})
        state = (names, known[-1].counter if known else None, self.chosen.value)
        if not names or state == self.drawn:
            return
        if self.chosen.value not in names:
            self.chosen.value = next(name for e in reversed(known) for name in e.sizes)
        self.chosen.options, self.chosen.visible, self.plot.visible = names, True, True
        name = self.chosen.value
        rows = [(e.counter * self.sample_time_s, *e.sizes[name]) for e in known if name in e.sizes]
        self.source.data = {
            "x": [t for t, *_ in rows],
            "y": [value for _, value, _, _ in rows],
            "low": [value - SIGMAS * sigma for _, value, sigma, _ in rows],
            "high": [value + SIGMAS * sigma for _, value, sigma, _ in rows],
        }
        self.plot.yaxis.axis_label = rows[-1][3]
        self.drawn = (names, state[1], name)
