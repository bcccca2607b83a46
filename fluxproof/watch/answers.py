# SPDX-License-Identifier: BSD-3-Clause
"""Step responses on a page: measured beside predicted, rise time and overshoot of both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from fluxproof.cosim.step_response import LOOPS, Loop
from fluxproof.watch.curves import thinned
from fluxproof.watch.responses import Response
from golden_model.drive import Drive

COLOURS = {"reference": "#000000", "predicted": "#d55e00", "measured": "#0072b2"}


class Answers:
    """One view's pictures of the loops; those without a response are not seen."""

    def __init__(self, drive: Drive) -> None:
        self.rpm = 30.0 / np.pi / drive.machine.pole_pairs
        self.sources: dict[str, ColumnDataSource] = {}
        self.plots = {loop.name: self._plot(loop) for loop in LOOPS}
        self.drawn: dict[str, Response] = {}

    def _plot(self, loop: Loop):
        made = figure(
            title=f"Step response, {loop.name}", height=210, min_width=210, sizing_mode="stretch_width",
            tools="xpan,xwheel_zoom,crosshair,hover,reset", x_axis_label="ms from the step on",
            y_axis_label="rpm" if loop.speed_mode else "A", visible=False,
        )  # fmt: skip
        for name, colour in COLOURS.items():
            key = f"{loop.name}, {name}"
            self.sources[key] = ColumnDataSource({"x": [], "y": []})
            made.line("x", "y", source=self.sources[key], color=colour, legend_label=name, name=key)
        legend = made.legend[0]
        legend.update(orientation="horizontal", border_line_color=None, padding=0, margin=0)
        made.add_layout(legend, "above")
        return made

    def renew(self, latest: Mapping[str, Response]) -> str:
        """Draw what is new; the figures of all as HTML."""
        for name, response in dict(latest).items():
            if self.drawn.get(name) is not response:
                self._draw(response)
                self.plots[name].visible, self.drawn[name] = True, response
        return told(self.drawn)

    def _draw(self, response: Response) -> None:
        name, scale = response.loop.name, self.rpm if response.loop.speed_mode else 1.0
        time, values = 1e3 * response.measured.time, scale * np.repeat([response.before, response.after], 2)
        ends = {"x": [min(float(time[0]), 0.0), 0.0, 0.0, float(time[-1])], "y": values.tolist()}
        self.sources[f"{name}, reference"].data = ends
        for which, curve in (("predicted", response.predicted), ("measured", response.measured)):
            x, y = thinned(1e3 * curve.time, scale * curve.values)
            self.sources[f"{name}, {which}"].data = {"x": x, "y": y}


def told(responses: Mapping[str, Response]) -> str:
    """Rise and overshoot of steps as HTML; empty where there is none."""
    rows = []
    for name, response in responses.items():
        at = "" if response.counter is None else f"sample {response.counter}: "
        for which, rise, over in response.told():
            rows.append(f"<tr><td>{at}{name}, {which}</td><td>{rise}</td><td>{over}</td></tr>")
    head = "<tr><th>step response</th><th>to 90 %</th><th>overshoot</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>" if rows else ""
