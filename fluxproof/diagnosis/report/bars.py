# SPDX-License-Identifier: BSD-3-Clause
"""Bar charts: the fit before and after, and the share of the misfit that each named effect explains."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.result import Fit
from fluxproof.diagnosis.report import theme
from fluxproof.diagnosis.report.maps import LeftOut
from fluxproof.diagnosis.report.words import effect_text, explained, percent
from fluxproof.diagnosis.words.phrases import SIGNALS

LONGEST = 34  # letters of a label beside a bar


def fit_bars(fit: Fit) -> theme.Picture:
    """rms misfit before and after, on fitted and on held-out points, with the noise floor."""
    rows = [
        ("held out, before", fit.holdout_before, theme.BEFORE),
        ("held out, after", fit.holdout_after, theme.AFTER),
        ("fitted, before", fit.train_before, theme.BEFORE),
        ("fitted, after", fit.train_after, theme.AFTER),
    ]
    if not all(np.isfinite(value) for _, value, _ in rows) or not any(value for _, value, _ in rows):
        raise LeftOut("the misfit was not measured")
    figure, axis = theme.axes(height=2.3)
    top = max(value for _, value, _ in rows)
    for place, (_, value, color) in zip((0, 1, 2.5, 3.5), rows, strict=True):
        axis.barh(place, value, 0.78, color=color)
        axis.annotate(f"{value:.3g} {fit.unit}", (value, place), (4, 0), textcoords="offset points", va="center")
    if np.isfinite(fit.noise_floor) and fit.noise_floor > 0.0:
        axis.axvline(fit.noise_floor, color=theme.INK, linewidth=1.1, linestyle=(0, (4, 2)))
        axis.annotate(
            f"noise floor {fit.noise_floor:.3g} {fit.unit}",
            (fit.noise_floor, 1.0),
            (-2, 3),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            va="bottom",
            fontsize=9,
        )
    axis.set_yticks((0, 1, 2.5, 3.5), [name for name, _, _ in rows])
    axis.set(
        xlabel=f"rms misfit of {theme.plain(SIGNALS.get(fit.signal, fit.signal))} [{fit.unit}]", xlim=(0, 1.2 * top)
    )
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="y", visible=False)
    axis.invert_yaxis()
    return theme.picture(
        "fit_bars",
        figure,
        "Misfit before and after, at held-out and at fitted operating points.",
    )


def shares(diagnosis) -> theme.Picture:
    """One bar per named effect with its share of the misfit's power, and one for the residual."""
    named = diagnosis.effects
    rows = [(effect_text(e.name).title, e.explains, explained(e, named), theme.AFTER) for e in named]
    if not rows:
        raise LeftOut("no effect is named")
    if diagnosis.explained_share is not None:
        rest = 1.0 - diagnosis.explained_share
        rows.append(("residual", rest, percent(rest), theme.BEFORE))
    figure, axis = theme.axes(height=0.7 + 0.36 * len(rows))
    for place, (_, share, text, color) in enumerate(rows):
        axis.barh(place, np.clip(share, 0.0, 1.0), 0.7, color=color)
        axis.annotate(text, (np.clip(share, 0.0, 1.0), place), (4, 0), textcoords="offset points", va="center")
    labels = [theme.plain(t if len(t) <= LONGEST else f"{t[: LONGEST - 1]}…") for t, *_ in rows]
    axis.set_yticks(range(len(rows)), labels)
    axis.set(xlim=(0, 1.18), xticks=(0, 0.5, 1), xticklabels=("0", "50 %", "100 %"))
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="y", visible=False)
    axis.invert_yaxis()
    caption = (
        "Share of the misfit's power above the noise floor that each effect removes; shares of like effects overlap."
    )
    return theme.picture("shares", figure, caption)
