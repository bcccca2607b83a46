# SPDX-License-Identifier: BSD-3-Clause
"""Common style of all pictures, light and dark: colours are roles, which the page's style sheet defines.

A figure is drawn with the light colours; in its SVG each becomes a CSS variable, so that the same picture
follows the reader's colour scheme.  Text is drawn as outlines and needs no font.  Before is vermilion, after is
blue, a pair that colour-blind readers can distinguish; labels above the axes replace a legend.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from fluxproof.quote import mathtext, visible

LIGHT = {
    "--ink": "#1d2127",
    "--soft": "#5c636d",
    "--axis": "#9aa0a8",
    "--grid": "#e8eaed",
    "--before": "#c2461c",
    "--after": "#1f5fa8",
    "--recorded": "#7d8590",
    "--band": "#dfe3e8",
    "--held": "#f3ead2",
    "--empty": "#eceef1",
}
INK, SOFT, AXIS, GRID, BEFORE, AFTER, RECORDED, BAND, HELD, EMPTY = LIGHT.values()
WIDTH = 4.7  # inches; narrow, so that 10-point text is legible on a phone of 400 px
STYLE: dict[Any, Any] = {k: v for k, v in mpl.rcParamsDefault.items() if not k.startswith("backend")} | {
    **{"font.size": 10.0, "text.color": INK, "axes.labelcolor": SOFT},
    **{
        "axes.titlesize": 10.5,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.titlecolor": INK,
    },
    **{"axes.grid": True, "grid.color": GRID, "axes.axisbelow": True, "axes.edgecolor": AXIS},
    **dict.fromkeys(("axes.spines.top", "axes.spines.right"), False),
    **dict.fromkeys(("xtick.color", "ytick.color"), AXIS),
    **dict.fromkeys(("xtick.labelcolor", "ytick.labelcolor"), SOFT),
    **dict.fromkeys(("figure.facecolor", "axes.facecolor", "savefig.facecolor"), "none"),
    **{"image.cmap": "cividis", "lines.linewidth": 1.3, "path.simplify_threshold": 0.4},
    "svg.hashsalt": "fluxproof",  # the same figure, the same bytes
}
NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))


@dataclass(frozen=True)
class Picture:
    """An inline SVG element and its caption."""

    svg: Markup
    caption: str


def axes(height: float) -> tuple[Figure, Axes]:
    """A figure of the common width of all pictures, with one pair of axes."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots()


def panels(rows: int, columns: int, height: float, **kwargs) -> tuple[Figure, np.ndarray]:
    """The same with several pairs of axes, in the array that ``Figure.subplots`` makes of them."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(rows, columns, **kwargs)


def key(axis, *words: tuple[str, str]) -> None:
    """Labels of the lines in their own colours, above the axes at the right."""
    place, at = axis.transAxes, (1.0, 1.0)
    for text, color in reversed(words):
        offset = dict(xytext=(0, 4) if place is axis.transAxes else (-9, 0), textcoords="offset points")
        at_words = dict(xycoords=place, color=color, ha="right", va="bottom", fontsize=9, annotation_clip=False)
        place, at = axis.annotate(text, at, **at_words, **offset), (0.0, 0.0)


def plain(text: str) -> str:
    """Text from a file as a label: never parsed as a formula, on one line, cut to the available length."""
    line = visible(" ".join(str(text).split()))
    return mathtext(line if len(line) <= 40 else f"{line[:39]}…")


def _place(figure: Figure) -> None:
    """Place the axes once and for all: a figure whose layout is still open is drawn twice as it is saved."""
    engine = figure.get_layout_engine()
    if engine is not None:
        FigureCanvasSVG(figure)  # whose renderer measures the words
        engine.execute(figure)
        figure.set_layout_engine("none")


def picture(name: str, figure: Figure, caption: str) -> Picture:
    """The figure as an inline SVG element whose colours follow the page; ``name`` makes its ids unique."""
    with mpl.rc_context(STYLE), io.BytesIO() as stream:
        _place(figure)
        figure.savefig(stream, format="svg", dpi=144, metadata=NO_METADATA)
        svg = stream.getvalue().decode()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<!--.*?-->|<style.*?</style>|<metadata.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", svg)
    for role, color in LIGHT.items():
        svg = svg.replace(color, f"var({role})")
    head = re.sub(r'\s(width|height|version|xmlns)="[^"]*"', "", svg[: svg.index(">")])
    head = f'{head} role="img" aria-label="{escape(visible(caption))}">'
    return Picture(Markup(head + svg[svg.index(">") + 1 :]), caption)
