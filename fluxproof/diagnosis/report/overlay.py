# SPDX-License-Identifier: BSD-3-Clause
"""The picture of the closed-loop simulation laid over the recording."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import COLUMNS
from fluxproof.diagnosis.report import theme
from fluxproof.diagnosis.report.maps import LeftOut

POINTS = 300  # rows of the close-up; about the horizontal pixels of a phone
MOST_COLUMNS = 6
# colour and width, in the order of drawing
RUNS = {
    "recorded": (theme.RECORDED, 2.8),
    "simulated_before": (theme.BEFORE, 1.0),
    "simulated_after": (theme.AFTER, 1.0),
}


def overlay(data: dict) -> theme.Picture:
    """The closed-loop simulation laid over the recording; ``data`` as in write.write_outputs.

    A long recording has a second column: a close-up of the rows where the drive as described differs most.
    """
    t, runs = np.asarray(data["t"], float), _runs(data)
    names = list(data["recorded"])[:MOST_COLUMNS]
    if not names or len(t) < 2:
        raise LeftOut("the overlay contains no samples")
    if any(len(values) != len(t) for columns in runs.values() for values in columns.values()):
        raise LeftOut("the overlay's columns differ in length")
    parts = [slice(None)] + ([_furthest_off(runs, names)] if len(t) > 2 * POINTS else [])
    height = 0.7 + 1.25 * len(names)
    figure, panels = theme.panels(len(names), len(parts), height, sharex="col", sharey="row", squeeze=False)
    for row, name in zip(panels, names, strict=True):
        for axis, part in zip(row, parts, strict=True):
            for run, (color, width) in RUNS.items():
                if name in runs[run]:
                    axis.plot(*thinned(t[part], runs[run][name][part]), color=color, linewidth=width)
            axis.set_xlim(t[part][0], t[part][-1])
        row[0].set(title=theme.plain(name), ylabel=COLUMNS.get(name, ""))
    for axis in panels[-1]:
        axis.set_xlabel("time [s]")
        axis.locator_params(axis="x", nbins=4)
    words = {"recorded": "recorded", "simulated_before": "before", "simulated_after": "after"}
    theme.key(panels[0, -1], *((words[run], RUNS[run][0]) for run in RUNS if runs[run]))
    caption = "The closed-loop simulation of the drive as described (before) and improved (after), over the recording"
    caption += "; right: a close-up of the rows where before differs most." if len(parts) > 1 else "."
    return theme.picture("overlay", figure, caption)


def _runs(data: dict) -> dict[str, dict[str, np.ndarray]]:
    return {run: {k: np.asarray(v, float) for k, v in (data.get(run) or {}).items()} for run in RUNS}


def _furthest_off(runs, names) -> slice:
    """The POINTS rows in which recorded and simulated_before differ most, each column relative to its range."""
    off = np.zeros(len(runs["recorded"][names[0]]))
    for name in names:
        recorded = runs["recorded"][name]
        other = runs["simulated_before"].get(name, np.full(len(recorded), np.nanmean(recorded)))
        off += np.nan_to_num((recorded - other) ** 2 / (np.nanvar(recorded) or 1.0))
    total = np.append(0.0, np.cumsum(off))
    start = int(np.argmax(total[POINTS:] - total[:-POINTS]))
    return slice(start, start + POINTS)


def thinned(t: np.ndarray, values: np.ndarray, most: int = 2 * POINTS) -> tuple[np.ndarray, np.ndarray]:
    """About ``most`` points at most, with every peak preserved: minimum and maximum of equal groups of rows."""
    if len(t) <= most:
        return t, values
    starts = np.linspace(0, len(t), most // 2, endpoint=False).astype(int)
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    return np.repeat(t[starts], 2), np.column_stack([low, high]).ravel()
