# SPDX-License-Identifier: BSD-3-Clause
"""Several recordings of one drive as one view, and how far drifts have gone in each of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from fluxproof.diagnosis.balance.view import View, lacking

COLD_K = 5.0  # a machine within this difference from the temperature of its nameplate is cold


def joined_views(views: list[View]) -> View:
    """Several recordings of one drive as one view; time continues, dwells stay separate.

    Slow drifts continue with time too, with two exceptions: they are constant in a recording shorter than the first
    one, and a winding temperature determines their progress (``_course_of``).
    """
    first = views[0]
    if len(views) == 1:
        return first
    offsets_t = np.cumsum([0.0, *(v.span_s for v in views)])
    slow = np.cumsum([0.0, first.span_s, *(v.span_s if v.span_s >= first.span_s else 0.0 for v in views[1:])])
    offsets_run = np.cumsum([0, *(v.run.max() + 1 for v in views)])
    stack: dict[str, Any] = {name: np.concatenate([getattr(v, name) for v in views]) for name in first.stacked}
    if any(v.lacks is not None for v in views):
        stack["lacks"] = np.concatenate([lacking((), len(v)) if v.lacks is None else v.lacks for v in views])
    for name in ("i_abc", "mean_duty"):
        parts = [getattr(v, name) for v in views]
        stack[name] = None if any(p is None for p in parts) else np.concatenate(parts)
    return first.replace(
        **stack,
        t=np.concatenate([v.t + o for v, o in zip(views, offsets_t[:-1], strict=True)]),
        course=np.concatenate(
            [_course_of(v, first, a, b, slow[-1]) for v, a, b in zip(views, slow[:-1], slow[1:], strict=True)]
        ),
        run=np.concatenate([v.run + o for v, o in zip(views, offsets_run[:-1], strict=True)]),
        span_s=float(offsets_t[-1]),
        angle_step=max(v.angle_step for v in views),
    )


def stayed_cold(view) -> bool:
    """Whether the winding is known to have been cold throughout, so that it does not indicate a drift's progress."""
    return bool((np.abs(view.temp - view.machine.temperature_ref_c) < COLD_K).all())


def _course_of(view, first, begin, end, total):
    """(b,) progress of drifts in one of several recordings: by its temperature if possible, else begin to end [s].

    A recording that is cold throughout has the progress of a cold start, unless the first one was cold throughout too,
    since the magnets warm by their own losses.  A temperature that the first recording passed through has the progress
    of that time.
    """
    by_time = np.minimum(view.t + begin, end) / max(total, 1e-9)
    if view is first or not np.isfinite(view.temp).all() or stayed_cold(first):
        return by_time
    if stayed_cold(view):
        return np.zeros(len(view))
    known = np.isfinite(first.temp).all() and np.ptp(first.temp) > 2.0 * COLD_K
    if not known:
        return by_time
    nearest = np.argmin(np.abs(first.temp[None, :] - view.temp[:, None]), axis=1)
    return first.t[nearest] / max(total, 1e-9)
