# SPDX-License-Identifier: BSD-3-Clause
"""The EMRAX 228 of a race motorcycle: 475 s of CAN messages, a few per second, against its data sheet.

The recorded voltages are commanded ones, so that inverter loss and delay are part of the misfit; there is no angle, no
load machine and only one direction.  If several explanations remain, all of them are reported.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.build import Beside, build
from fluxproof.diagnosis.decide.estimates import named_effects
from fluxproof.diagnosis.decide.names import names_of
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.physics import explain
from studies.real.outputs import write
from studies.real.splits import axis_misfit, bounds, estimates_of, flux_map_of, on_other_rows

FILE = Path("emrax228") / "coastdown_run.csv"
DRIVE = ROOT / "docs" / "drives" / "emrax228.toml"
LOADED = 0.02  # of rated current
EARLY = 0.6  # of the loaded stretches: the time-wise split fits those and predicts the rest
FLUXES = ("cross_saturation", "saturation", "inductance_q", "inductance_d", "magnet_flux")


def run(folder: Path, out: Path, progress=lambda text: None) -> dict:
    """Diagnose, verify on other points and on a later part, write the outputs; returns the entry of result.json."""
    started, nominal = time.perf_counter(), load_nominal(DRIVE)
    recording = load_recording(folder / FILE, nominal)
    found = explain([recording], nominal, progress)
    decision = found.decision
    diagnosed = time.perf_counter()
    progress("other splits")
    posterior, held = decision.posterior, decision.basis.held
    best, setup = posterior.best(), posterior.setup
    view, effects = setup.view, setup.effects
    loaded = np.abs(view.i_raw[:, 0]) > LOADED * nominal.machine.rated_current_a
    early = view.t < np.quantile(view.t[loaded], EARLY)
    later_fit, by_time = on_other_rows(view, effects, best.names, early)
    alone_fit, at_rest = on_other_rows(view, effects, best.names, loaded)
    splits = {
        "operating_points": axis_misfit(best, held),
        "operating_points_loaded": axis_misfit(best, held & loaded),
        "later_time": by_time,
        "later_time_loaded": axis_misfit(later_fit, ~early & loaded),
        "unloaded_from_loaded": at_rest,
    }
    parts = [estimates_of(alone_fit), estimates_of(later_fit)]
    widened = replace(decision, effects=tuple(_widened(effect, parts) for effect in decision.effects))
    note = "Standard deviations include the differences between separately fitted parts of the log."
    answer = build(replace(found, decision=widened), nominal, Beside(after=(note,)))
    model = _with_map(named_effects(names_of(posterior), posterior, {}, only=best.names), flux_map_of(best))
    model = [_widened(effect, parts) for effect in model]
    if_added = bounds(posterior)
    entry = write(
        "emrax228",
        answer,
        nominal,
        recording,
        out,
        {
            "held_out": splits["operating_points"],
            "held_out_splits": splits,
            "stretches": {"all": len(view), "loaded": int(loaded.sum()), "held_out": int(held.sum())},
            "sets": [{"effects": fit.names, "probability": p} for p, fit in posterior.weights() if p >= k.OPEN],
            "if_added": if_added,
            "from_loaded_stretches_alone": parts[0],
            "from_the_first_part_alone": parts[1],
            "cannot_tell": _cannot_tell(view, nominal, best, if_added, parts[0], at_rest),
        },
        model=model,
    )
    entry["seconds"] |= {"diagnose": diagnosed - started}
    return entry


def _with_map(effects, flux_map):
    """The model's effects with one flux map instead of formulas that the plant lacks; the first one contains it."""
    if flux_map is None:
        return effects
    carrier = next((effect.name for effect in effects if effect.name in FLUXES), None)
    plants = {name: {"machine.flux_map": flux_map} if name == carrier else {} for name in FLUXES}
    return [replace(effect, plant=plants.get(effect.name, effect.plant)) for effect in effects]


def _widened(effect, parts):
    """The effect with sigmas that hold the differences between parts of the log, since formula errors repeat."""
    parameters = {}
    for name, estimate in effect.parameters.items():
        others = [part[name][0] for part in parts if name in part]
        sigma = float(max([estimate.sigma, *(abs(x - estimate.value) for x in others)]))
        parameters[name] = replace(estimate, sigma=sigma)
    return replace(effect, parameters=parameters)


def _cannot_tell(view, nominal, best, if_added, alone, at_rest) -> list[str]:
    m = nominal.machine
    said = [
        "The voltages are commanded ones: inverter loss and delay are part of the misfit.  Without a reversal of i_q, "
        "the loss is separated from other voltages in phase with the current by its size only.",
        "The encoder offset follows from the d voltage at no load.  One direction only: a delay, late currents and an "
        "iron loss rotate the voltage too, and only their dependence on speed separates them.",
        "i_d was never driven: L_d and saturation of the d axis are unknown, cross-saturation only from its q part.",
        "No harmonics and no sampling instants: EMF harmonics, sensor offsets and gains, eccentricity are unknown.",
    ]
    if "magnet_flux" in best.names:
        value, sigma, _ = alone["magnet_flux_wb"]
        own = m.magnet_flux_wb + best.c["magnet_flux"]["delta_psi_m"]
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
        if "parameters" in if_added.get(name, {}):
            value, sigma, unit = if_added[name]["parameters"][parameter]
            said.append(f"{name} would be {value:.3g} +- {sigma:.1g} {unit} in addition: not needed, not excluded.")
    said.append("A current scale or bus gain error above 10 % was taken as improbable: either would rescale all else.")
    said.append("Winding and magnets warmed by 12 K only: temperature coefficients cannot be determined.")
    return said
