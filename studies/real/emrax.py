"""The EMRAX 228 of a race motorcycle: 475 s of CAN messages, a few per second, against its data sheet.

The recorded voltages are commanded ones, so that inverter loss and delay are part of the misfit; there is no angle, no
load machine and only one direction.  If several explanations remain, all of them are reported.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.answer.headline import sentence
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.inference.slow_model import bounds, flux_map_of, on_other_rows
from fluxproof.diagnosis.ingest.load import load_recording
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.slow_diagnosis import axis_misfit, diagnose_slow, model_effects
from studies.real.outputs import write

FILE = Path("emrax228") / "coastdown_run.csv"
DRIVE = ROOT / "docs" / "drives" / "emrax228.toml"
LOADED = 0.02  # of rated current
EARLY = 0.6  # of the loaded stretches: the time-wise split fits those and predicts the rest
FLUXES = ("cross_saturation", "saturation", "inductance_q", "inductance_d", "magnet_flux")


def run(folder: Path, out: Path, progress=lambda text: None) -> dict:
    """Diagnose, verify on other points and on a later part, write the outputs; returns the entry of result.json."""
    started, nominal = time.perf_counter(), load_nominal(DRIVE)
    recording = load_recording(folder / FILE, nominal)
    answer = diagnose_slow([recording], nominal, progress)
    answer.rows, answer.problems = len(recording), recording.problems
    diagnosed = time.perf_counter()
    progress("other splits")
    search, found, view = answer.search, answer.found, answer.search.view
    loaded = np.abs(view.i_raw[:, 0]) > LOADED * nominal.machine.rated_current_a
    early = view.t < np.quantile(view.t[loaded], EARLY)
    later, later_solution, by_time = on_other_rows(view, found.best.model, early)
    alone, alone_solution, at_rest = on_other_rows(view, found.best.model, loaded)
    held = {
        "operating_points": axis_misfit(search, found.best, answer.held),
        "operating_points_loaded": axis_misfit(search, found.best, answer.held & loaded),
        "later_time": by_time,
        "later_time_loaded": axis_misfit(later, later_solution, ~early & loaded),
        "unloaded_from_loaded": at_rest,
    }
    parts = [_estimates(alone, alone_solution), _estimates(later, later_solution)]
    for effect in answer.effects:
        _widen(effect, parts)
    answer.sentence = sentence(answer, CATALOGUE)
    answer.notes.append("Standard deviations include the differences between separately fitted parts of the log.")
    model = _with_map(model_effects(search, found), flux_map_of(search, found.best))
    for effect in model:
        _widen(effect, parts)
    ruled_out = bounds(search, found)
    entry = write(
        "emrax228",
        answer,
        nominal,
        recording,
        out,
        {
            "held_out": held["operating_points"],
            "held_out_splits": held,
            "stretches": {"all": len(view), "loaded": int(loaded.sum()), "held_out": int(answer.held.sum())},
            "tied_models": [
                {"effects": sorted(s.model.names), "score": s.score - found.best.score} for s in found.tied
            ],
            "if_added": ruled_out,
            "from_loaded_stretches_alone": parts[0],
            "from_the_first_part_alone": parts[1],
            "cannot_tell": _cannot_tell(view, nominal, found, ruled_out, alone, alone_solution, at_rest),
        },
        model=model,
    )
    entry["seconds"] |= {"diagnose": diagnosed - started}
    return entry


def _with_map(effects, flux_map):
    """The model's effects with one flux map instead of formulas that the plant lacks; the first one contains it."""
    if flux_map is None:
        return effects
    first = True
    for effect in effects:
        if effect.name in FLUXES:
            effect.plant = {"machine.flux_map": flux_map} if first else {}
            first = False
    return effects


def _widen(effect, parts) -> None:
    """Increase the standard deviations to the differences between parts of the log, since formula errors repeat."""
    for name, estimate in effect.parameters.items():
        others = [part[name][0] for part in parts if name in part]
        estimate.sigma = float(max([estimate.sigma, *(abs(x - estimate.value) for x in others)]))


def _estimates(search, solution) -> dict:
    """{parameter: [value, standard deviation, unit]} of a solution."""
    out = {}
    for name in sorted(solution.model.names):
        covariance = solution.covariance[name] * search.problem.dispersion
        found = search.effects[name].estimates(solution.c[name], covariance, search.view.nominal)
        out |= {k: [e.value, e.sigma, e.unit] for k, e in found.items()}
    return out


def _cannot_tell(view, nominal, found, ruled_out, alone, alone_solution, at_rest) -> list[str]:
    m, alone_values = nominal.machine, _estimates(alone, alone_solution)
    said = [
        "The voltages are commanded ones: inverter loss and delay are part of the misfit.  Without a reversal of i_q, "
        "the loss is separated from other voltages in phase with the current by its size only.",
        "The encoder offset follows from the d voltage at no load.  One direction only: a delay, late currents and an "
        "iron loss rotate the voltage too, and only their dependence on speed separates them.",
        "i_d was never driven: L_d and saturation of the d axis are unknown, cross-saturation only from its q part.",
        "No harmonics and no sampling instants: EMF harmonics, sensor offsets and gains, eccentricity are unknown.",
    ]
    if "magnet_flux" in found.best.model.names and "magnet_flux_wb" in alone_values:
        value, sigma, _ = alone_values["magnet_flux_wb"]
        own = m.magnet_flux_wb + found.best.c["magnet_flux"]["delta_psi_m"]
        said.append(
            f"The magnet flux of {1e3 * own:.3g} mWb depends on stretches without current, in which the controller may "
            f"have been passive.  Loaded stretches alone give {1e3 * value:.3g} +- {1e3 * sigma:.2g} mWb and "
            f"predict the unloaded ones to {at_rest['d']['after']:.2g} V (d) and {at_rest['q']['after']:.2g} V (q)."
        )
    for name, parameter in (
        ("resistance", "resistance_ohm"),
        ("udc_gain", "udc_gain"),
        ("current_scale", "scale"),
    ):
        if "parameters" in ruled_out.get(name, {}):
            value, sigma, unit = ruled_out[name]["parameters"][parameter]
            said.append(
                f"{name} added to the model would be {value:.3g} +- {sigma:.1g} {unit}: not significant, not excluded."
            )
    said.append(
        "A current scale or bus gain error above 15 % was not considered: either would rescale all other values."
    )
    said.append("Winding and magnets warmed by 12 K only: temperature coefficients cannot be determined.")
    return said
