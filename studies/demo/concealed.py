# SPDX-License-Identifier: BSD-3-Clause
"""What the closed loop conceals: currents on their references, and the voltages that show the difference."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure

from fluxproof.diagnosis.example import truth
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.quantities import measured, quantity
from fluxproof.diagnosis.ground.result import Diagnosis
from fluxproof.diagnosis.loading.load import load_recording
from golden_model.fluxproof import Sample
from studies.demo.plots import D_AXIS, Q_AXIS, QUIET, REFERENCE, SPEED, WIDTH, label

MOST_SIGMAS = 3.0  # an estimate further from the truth is wrong
SETTLED = 100  # rows at the end of an operating point


def view(recording: Path, drive_file: Path, answer: Diagnosis) -> SimpleNamespace:
    """Currents of a telemetry dump with their references, and the misfit of its diagnosis at every block."""
    seen = load_recording(recording, load_nominal(drive_file))
    samples, read_out, scales = (seen.meta[part] for part in ("samples", "observed", "scales"))
    given = {name: samples[:, Sample._fields.index(name)] * scales[name] for name in ("i_d_ref", "i_q_ext")}
    blocks = {name: np.asarray(values) for name, values in answer.evidence.arrays.items()}
    return SimpleNamespace(
        ms=1e3 * seen["t"],
        i_d=read_out["i_d"] * scales["i_d"],
        i_q=read_out["i_q"] * scales["i_q"],
        i_d_ref=given["i_d_ref"],
        i_q_ref=given["i_q_ext"],
        block_ms=1e3 * blocks["t"],
        held=blocks["holdout"].astype(bool),
        before=(blocks["before_d"], blocks["before_q"]),
        after=(blocks["after_d"], blocks["after_q"]),
    )


def metrics(run: SimpleNamespace, answer: dict, dwell: int) -> dict:
    """The numbers of summary.json: what the currents conceal, the misfit, and every name beside the truth.

    answer: diagnosis.json; dwell: rows of an operating point, ramp included.
    """
    end = np.arange(len(run.ms)) % dwell >= dwell - SETTLED
    error = np.hypot(run.i_d - run.i_d_ref, run.i_q - run.i_q_ref)[end]
    rows, others = truth.compare(answer["effects"])
    return {
        "verdict": answer["verdict"],
        "sentence": answer["sentence"],
        "replayed": answer["digital"]["samples"],
        "replay_equal": answer["digital"]["checked"] and answer["digital"]["first_difference"] is None,
        "current_error_a": round(float(np.sqrt(np.mean(error**2))), 4),
        "misfit": answer["fit"],
        "effects": [_row(row) for row in rows],
        "false_names": others,
    }


def _row(row: truth.Compared) -> dict:
    secret, unit = row.hidden, row.unit
    out = {"name": secret.effect, "hidden": secret.words, "true": secret.value, "found": row.value, "sigma": row.sigma}
    if row.value is None:
        return {**out, "unit": unit, "deviation": None, "true_text": f"{secret.value:.4g}", "found_text": "not named"}
    texts = {"true_text": quantity(secret.value, unit), "found_text": measured(row.value, row.sigma, unit)}
    return {**out, "unit": unit, "deviation": round(row.deviation, 2), **texts}


def good(found: dict) -> bool:
    """The core equal to its golden model, every hidden difference named with its size, and nothing else."""
    sizes = all(row["deviation"] is not None and row["deviation"] <= MOST_SIGMAS for row in found["effects"])
    return found["replay_equal"] and found["verdict"] == "explained" and sizes and not found["false_names"]


def figure(run: SimpleNamespace) -> Figure:
    """Currents above, the misfit of the voltages below; call it under plots.STYLE."""
    page = Figure(figsize=(WIDTH + 1.4, 5.2), layout="constrained")
    _course(run, *page.subplots(3, 1, sharex=True))
    return page


def _course(run: SimpleNamespace, currents, d_axis, q_axis) -> None:
    """Currents with their references, and the misfit of both voltages, over time; held-out points are ringed."""
    for values, reference, text, color in (
        (run.i_q, run.i_q_ref, "$i_q$", Q_AXIS),
        (run.i_d, run.i_d_ref, "$i_d$", D_AXIS),
    ):
        currents.plot(run.ms, values, color=color, linewidth=1.0)
        currents.plot(run.ms, reference, color=REFERENCE, linewidth=0.8, linestyle=(0, (4, 2)))
        label(currents, run.ms[-1], values[-50:].mean(), text, color)
    currents.set(title="The currents follow their references (dashed)", ylabel="A")
    for axis, k, text in ((d_axis, 0, "$u_d$"), (q_axis, 1, "$u_q$")):
        axis.axhline(0.0, color=QUIET, linewidth=0.9)
        for values, color, words in ((run.before[k], Q_AXIS, "drive file"), (run.after[k], SPEED, "values found")):
            axis.plot(run.block_ms, values, ".", color=color, markersize=4.5)
            at = run.block_ms[run.held], values[run.held]
            axis.plot(*at, "o", color=color, markersize=6.5, fillstyle="none", markeredgewidth=0.8, label=words)
        axis.set(title=f"Recorded {text} minus model", ylabel="V")
    place = dict(loc="lower right", bbox_to_anchor=(1.0, 0.97), borderpad=0, handletextpad=0.2)
    d_axis.legend(**place, ncols=2, frameon=False, fontsize=9)
    q_axis.set(xlabel="time [ms]; rings: operating points that were not fitted", xlim=(run.ms[0], run.ms[-1]))


def overview(run: SimpleNamespace, answer: dict) -> Figure:
    """The README's picture: the same on the left, misfit and sizes against the truth on the right."""
    page = Figure(figsize=(9.6, 4.6), layout="constrained")
    left, right = page.subfigures(1, 2, width_ratios=(1.55, 1))
    _course(run, *left.subplots(3, 1, sharex=True))
    misfit, sizes = right.subplots(2, 1, height_ratios=(1, 1.3))
    fit = answer["fit"]
    bars = ((fit["holdout_before"], Q_AXIS), (fit["holdout_after"], SPEED), (fit["noise_floor"], QUIET))
    for row, (value, color) in enumerate(bars):
        misfit.barh(row, value, 0.7, color=color)
        misfit.annotate(f"{value:.2g} V", (value, row), (4, 0), textcoords="offset points", va="center")
    misfit.set_yticks(range(3), ("before", "after", "noise floor"))
    misfit.set(title="Misfit at points not fitted, rms", xlabel="V", xlim=(0, 1.2 * fit["holdout_before"]))
    misfit.set_axisbelow(True)
    misfit.invert_yaxis()
    rows, _ = truth.compare(answer["effects"])
    for row, compared in enumerate(rows):
        if compared.value is not None:
            share, spread = compared.value / compared.hidden.value, compared.sigma / abs(compared.hidden.value)
            sizes.errorbar(100 * share, row, xerr=200 * spread, fmt="o", color=SPEED, markersize=4, capsize=3)
    sizes.axvline(100, color=REFERENCE, linewidth=1.1)
    sizes.set(title="Found ± 2 σ", xlabel="% of the truth", ylim=(len(rows) - 0.5, -0.5))
    sizes.set_yticks(range(len(rows)), [compared.hidden.effect.replace("_", "\n") for compared in rows])
    return page
