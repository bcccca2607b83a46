"""What the closed loop conceals: currents on their references, voltages beside those of the drive as described."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure

from fluxproof.diagnosis.example import truth
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.quantities import measured, quantity
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.overlay.compare import closed_loop
from fluxproof.diagnosis.session import IMPROVED
from golden_model.drive import Drive
from golden_model.units import si_per_lsb
from studies.demo.plots import D_AXIS, Q_AXIS, QUIET, REFERENCE, SPEED, WIDTH, label

MOST_SIGMAS = 3.0  # an estimate further from the truth is wrong
SETTLED = 100  # rows at the end of an operating point


def view(recording: Path, drive_file: Path, out: Path, drive: Drive) -> SimpleNamespace:
    """The recorded run and the closed loop simulated with the drive file and with the improved one.

    recording: a telemetry dump; out: the folder of its diagnosis.
    """
    nominal = load_nominal(drive_file)
    seen = load_recording(recording, nominal)
    improved = out / IMPROVED
    over = closed_loop(seen, nominal, improved if improved.exists() else None)
    scale = si_per_lsb("i_q_ref", drive)
    return SimpleNamespace(
        ms=1e3 * seen["t"],
        i_d=seen["i_d"],
        i_q=seen["i_q"],
        i_d_ref=seen.meta["samples"][:, 6] * scale,
        i_q_ref=seen.meta["samples"][:, 7] * scale,
        over=over,
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
    """Currents above, the voltages that the core asks for below; call it under plots.STYLE."""
    page = Figure(figsize=(WIDTH + 1.4, 5.6), layout="constrained")
    currents, d_axis, q_axis = page.subplots(3, 1, sharex=True)
    for values, reference, text, color in (
        (run.i_q, run.i_q_ref, "$i_q$", Q_AXIS),
        (run.i_d, run.i_d_ref, "$i_d$", D_AXIS),
    ):
        currents.plot(run.ms, values, color=color, linewidth=1.0)
        currents.plot(run.ms, reference, color=REFERENCE, linewidth=0.8, linestyle=(0, (4, 2)))
        label(currents, run.ms[-1], values[-50:].mean(), text, color)
    currents.set(title="The currents follow their references (dashed): nothing to see", ylabel="A")
    over = run.over
    ms = 1e3 * np.asarray(over["t"])
    labels = (("recorded", QUIET, 3.0, "recorded"), ("simulated_before", Q_AXIS, 1.0, "drive as described"))
    labels += (("simulated_after", SPEED, 1.0, "drive as diagnosed"),)
    for axis, name, text in ((d_axis, "u_d_ref", "$u_d$"), (q_axis, "u_q_ref", "$u_q$")):
        for key, color, width, words in labels:
            if key in over:
                axis.plot(ms, over[key][name], color=color, linewidth=width, label=words)
        axis.set(title=f"Voltage {text}: recorded, and simulated in closed loop", ylabel="V")
    d_axis.legend(loc="lower left", ncols=3, frameon=False, fontsize=9, borderpad=0)
    q_axis.set(xlabel="time [ms]", xlim=(run.ms[0], run.ms[-1]))
    return page
