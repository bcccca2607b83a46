# SPDX-License-Identifier: BSD-3-Clause
"""Line charts: misfit over time, harmonic orders.

The arrays are those of diagnosis.result.Evidence; a drawing function raises KeyError if one is missing.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.report import theme
from fluxproof.diagnosis.report.maps import LeftOut, length

POINTS = 300  # along the time axis: about one for each pixel of a phone
WHEN = {"before": theme.BEFORE, "after": theme.AFTER}


def over_time(e) -> theme.Picture:
    """rms magnitude of the misfit in equal intervals of time, the noise as a band, held-out intervals shaded."""
    t = e["t"]
    edges = np.linspace(t[0], t[-1], min(POINTS, len(t)) + 1)
    part = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(edges) - 2)
    rows = np.bincount(part, minlength=len(edges) - 1)
    middle = (edges[1:] + edges[:-1]) / 2
    figure, axis = theme.axes(height=2.5)
    names, tops = [], []
    for when in _given(e, "{}_d", "{}_q"):
        squares = np.bincount(part, length(e, when) ** 2, len(rows))
        rms = np.sqrt(np.divide(squares, rows, out=np.full(len(rows), np.nan), where=rows > 0))
        _line(axis, middle, rms, WHEN[when])
        names.append((_called(e, when), WHEN[when]))
        tops.append(np.nanmax(rms))
    if "noise" in e:
        noise = np.sqrt(2.0) * float(np.ravel(e["noise"])[0])  # two axes
        axis.axhspan(0.0, noise, color=theme.BAND, linewidth=0, zorder=0)
        names.append(("noise band", theme.SOFT))
        tops.append(noise)
    if "holdout" in e and e["holdout"].any():
        held = np.bincount(part, e["holdout"], len(rows)) > rows / 2
        axis.fill_between(
            np.repeat(edges, 2)[1:-1],
            0,
            1,
            where=np.repeat(held, 2),
            transform=axis.get_xaxis_transform(),
            color=theme.HELD,
            linewidth=0,
            zorder=-1,
        )
    axis.set(title="Misfit", xlabel="time [s]", ylabel="V", xlim=(t[0], t[-1]), ylim=(0, 1.08 * max(tops) or 1.0))
    theme.key(axis, *names)
    caption = "Magnitude of the misfit vector over time. Vertical shading: intervals held out of every fit."
    return theme.picture("over_time", figure, caption)


def orders(e) -> theme.Picture:
    """Amplitude of each harmonic order, before and after, on a logarithmic axis."""
    _same_length(e, "orders", "spectrum_{}")
    values = {when: e[f"spectrum_{when}"] for when in _given(e, "spectrum_{}")}
    positive = np.concatenate(list(values.values()))
    positive = positive[positive > 0.0]
    if not len(positive):
        raise LeftOut("every harmonic of the misfit is zero")
    top, bottom = (
        positive.max() * 1.8,
        min(max(positive.min() / 1.8, positive.max() * 1e-4), positive.max() / 10),
    )
    few = len(e["orders"]) <= 16
    place = np.arange(len(e["orders"])) if few else e["orders"]
    gap = 0.11 if few else 0.0
    figure, axis = theme.axes(height=2.5)
    for when, side in (("before", -gap), ("after", gap)):
        if when in values:
            heights = np.clip(values[when], bottom, top)
            axis.vlines(place + side, bottom, heights, color=WHEN[when], linewidth=2.4 if few else 1.0)
            axis.plot(place + side, heights, "o", color=WHEN[when], markersize=5 if few else 2)
    if few:
        axis.set_xticks(place, [f"{order:.2g}" for order in e["orders"]])
    axis.grid(axis="x", visible=False)
    axis.set(
        title="Harmonics",
        xlabel="order per electrical turn, in dq",
        ylabel="V",
        yscale="log",
        ylim=(bottom, top),
    )
    theme.key(axis, *((_called(e, when), WHEN[when]) for when in values))
    caption = (
        "Amplitude of the misfit's harmonics. Order 0 is the part that does not depend on the angle; its leakage"
        " into the other orders of incomplete turns is subtracted."
    )
    return theme.picture("orders", figure, caption)


def _called(e, when: str) -> str:
    """Label of a curve: "before" and "after" or what the report calls them, or "misfit" if there is no "after"."""
    return e.get("words", {}).get(when, when) if any("after" in name for name in e) else "misfit"


def _line(axis, x, y, color) -> None:
    """A line that is interrupted at NaN; an isolated point is drawn as a dot."""
    axis.plot(x, y, color=color)
    known = np.isfinite(np.pad(y, 1, constant_values=np.nan))
    alone = known[1:-1] & ~known[:-2] & ~known[2:]
    axis.plot(x[alone], y[alone], ".", color=color, markersize=3)


def _same_length(e, base: str, *patterns: str) -> None:
    names = [base, *(pattern.format(when) for pattern in patterns for when in WHEN)]
    sizes = {name: e[name].shape for name in names if name in e}
    if len(set(sizes.values())) > 1:
        raise LeftOut(f"the arrays differ in length, {sizes}")


def _given(e, *patterns: str) -> list[str]:
    """Which of "before" and "after" have all their arrays; KeyError if "before" has not."""
    given = [when for when in WHEN if all(pattern.format(when) in e for pattern in patterns)]
    if "before" not in given:
        raise KeyError(patterns[0].format("before"))
    return given
