# SPDX-License-Identifier: BSD-3-Clause
"""All pictures of a report, and the reason for each one that cannot be drawn."""

from __future__ import annotations

import warnings
from typing import Any

import matplotlib as mpl
import numpy as np

from fluxproof.diagnosis.report import bars, lines, maps, overlay, theme
from fluxproof.diagnosis.report.maps import LeftOut

# name: (drawing function, required arrays, title)
BLOCKS = ("before_d", "before_q")
DRAWN = {
    "speed_current": (
        maps.speed_current,
        ("omega_e", "i_d", "i_q", *BLOCKS),
        "misfit over speed and current",
    ),
    "angle_current": (
        maps.angle_current,
        ("theta_e", "i_d", "i_q", *BLOCKS),
        "misfit over angle and current",
    ),
    "orders": (lines.orders, ("orders", "spectrum_before"), "harmonic orders"),
    "over_time": (lines.over_time, ("t", *BLOCKS), "misfit over time"),
}
BLOCK_ARRAYS = (
    "t",
    "theta_e",
    "omega_e",
    "i_d",
    "i_q",
    "before_d",
    "before_q",
    "after_d",
    "after_q",
    "holdout",
)


def draw(diagnosis, laid_over: dict | None) -> tuple[dict[str, theme.Picture], list[str]]:
    """(pictures by name, one line with the reason for each picture that is left out)."""
    drawn, left_out = {}, []
    arrays: dict[str, Any] = {name: np.asarray(values) for name, values in diagnosis.evidence.arrays.items()}
    if diagnosis.verdict == "unexplained" and not diagnosis.effects:  # nothing is named, so there is no "after"
        arrays = {name: values for name, values in arrays.items() if "after" not in name}
    try:
        arrays = _clean(arrays)
    except LeftOut as reason:
        return {}, [f"every picture of the misfit: {reason}"] if arrays else []
    if diagnosis.verdict == "partly_explained":
        arrays["words"] = {"before": "before", "after": "residual"}
    jobs = [(name, title, needs, function, arrays) for name, (function, needs, title) in DRAWN.items()]
    jobs.append(("shares", "shares of the misfit", (), bars.shares, diagnosis))
    jobs.append(("fit_bars", "misfit before and after", (), bars.fit_bars, diagnosis.fit))
    if laid_over is not None:
        jobs.append(("overlay", "simulation over the recording", ("t", "recorded"), overlay.overlay, laid_over))
    for name, title, needs, function, data in jobs:
        missing = [need for need in needs if need not in data] if needs else []
        try:
            if missing:
                raise LeftOut(f"{', '.join(missing)} is missing")
            with mpl.rc_context(theme.STYLE), warnings.catch_warnings():
                warnings.simplefilter("ignore")  # empty map cells are intended; a font may lack a glyph
                drawn[name] = function(data)
        except LeftOut as reason:
            left_out.append(f"{title}: {reason}")
    return drawn, left_out


def _clean(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays without blocks that contain NaN or infinity; LeftOut if lengths differ or fewer than two remain."""
    blocks = {name: arrays[name] for name in BLOCK_ARRAYS if name in arrays}
    sizes = {name: values.shape for name, values in blocks.items()}
    if len(set(sizes.values())) > 1:
        raise LeftOut(f"the block means differ in length, {sizes}")
    rest = {name: values for name, values in arrays.items() if name not in blocks}
    if not np.all(np.isfinite(rest.get("noise", 0.0))):
        rest.pop("noise")
    if not blocks:
        return rest
    good = np.all([np.isfinite(values.astype(float)) for values in blocks.values()], axis=0)
    if good.sum() < 2:
        raise LeftOut("fewer than two blocks of the recording contain finite numbers")
    return rest | {name: values[good] for name, values in blocks.items()}
