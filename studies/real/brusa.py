# SPDX-License-Identifier: BSD-3-Clause
"""Identification of the measured Brusa map from terminal quantities: closed loop with a linear nameplate.

Two recordings at shuffled operating points and two speeds identify the missing effects; a third one covers the current
plane of the map for the surface.  The result is compared with held-out dwells of the first two and with the map itself.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.holdout import holdout_blocks
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.result import Diagnosis, Estimate, Fit, NamedEffect
from fluxproof.files import write_text
from fluxproof.plant import FluxMap
from studies.real.brusa_loop import Course, measured_map, record, serpentine
from studies.real.flux_surface import Surface, earned, flux_map, ladder, names
from studies.real.outputs import NAMES_OF_AXES, write

FILE = Path("brusa_flux_map") / "brusa_meas.csv"
DRIVE = ROOT / "docs" / "drives" / "brusa_hsm1.toml"
# The switching plant follows the compare values without dead time; the drive file must describe the same plant.
IDEAL = "\n[plant.inverter]\ndead_time_s = 0.0 # the closed loop over the measured map has an ideal inverter\n"
EDGE_A, NAMING_STEP_A, MAPPING_STEP_A = 140.0, 35.0, 20.0
NAMING = ((1000.0, 1), (-1800.0, 2))  # rpm, seed of the order, which decorrelates drift and current
MAPPING_RPM, DWELL_S = 1000.0, 0.046
MAP_STEP_A = 10.0
TARGET = 0.02  # of the map's range
EARNS = 30.0  # chi^2 by which an effect beside the map must improve the fit


def run(folder: Path, out: Path, progress=lambda text: None) -> dict:
    """Simulate, diagnose, fit the surface and write the outputs; returns the entry of result.json."""
    started, truth = time.perf_counter(), measured_map(folder / FILE)
    nominal = load_nominal(write_text(out / FILE.parts[0] / "drive_nominal.toml", DRIVE.read_text() + IDEAL))
    progress("closed loop over the measured map")
    naming, mapping = recordings(truth)
    simulated = time.perf_counter()
    answer = diagnose(naming, nominal, progress)
    diagnosed = time.perf_counter()
    progress("flux surface")
    views = [view_of(r, nominal, CATALOGUE) for r in naming]
    view = joined_views(views)
    held = holdout_blocks(view)
    steps = ladder(view, ~held)
    everything = joined_views([*views, view_of(mapping, nominal, CATALOGUE)])
    train = np.append(~held, np.ones(len(everything) - len(view), bool))
    surface = flux_map(everything, train=train)
    noise_v = surface.error_wb * float(np.abs(view.omega).mean())
    asserted = {e.name for e in answer.effects} | {n for group in answer.ambiguity for n in group}
    beside = earned(everything, sorted(asserted - {"saturation", "cross_saturation"}), train=train)
    before = answer.sentence
    answer = _with_surface(answer, surface, names(steps, noise_v), beside, view, held, noise_v)
    errors = {"covered grid of the measured map": compare(surface, truth)}
    result = write(
        "brusa_flux_map",
        answer,
        nominal,
        mapping,
        out,
        {
            "held_out": held_out(surface, view, held),
            "ladder_holdout_v": {shape: steps[shape]["holdout"] for shape in steps},
            "flux_map": errors
            | {
                "target_share_of_range": TARGET,
                "expects_of_itself_wb_rms": surface.error_wb,
                "spline_damping": surface.damping,
            },
            "rigid_formulas_said": before,
            "refuted_beside_the_free_surface": {n: round(g, 2) for n, g in beside.items() if g < EARNS},
            "cannot_tell": cannot_tell(surface, truth),
        },
    )
    result["seconds"] |= {
        "simulate": simulated - started,
        "diagnose": diagnosed - simulated,
        "surface": time.perf_counter() - diagnosed,
    }
    return result


def recordings(truth: FluxMap):
    """([two recordings at shuffled points], one that sweeps the plane)."""
    levels = np.arange(-EDGE_A, EDGE_A + 1.0, NAMING_STEP_A)
    i_d, i_q = serpentine(levels, levels)
    naming = []
    for rpm, seed in NAMING:
        order = np.random.default_rng(seed).permutation(len(i_d))
        naming.append(record(DRIVE, truth, Course(rpm, i_d[order], i_q[order], DWELL_S)))
    levels = np.arange(-EDGE_A, EDGE_A + 1.0, MAPPING_STEP_A)
    return naming, record(DRIVE, truth, Course(MAPPING_RPM, *serpentine(levels, levels), DWELL_S))


def compare(surface: Surface, truth: FluxMap) -> dict:
    """Errors of both fluxes at the covered points of the true map's grid, as shares of the map's range."""
    i = truth.i_d_a[:, None] + 1j * truth.i_q_a
    covered = surface.covered(i)
    off = surface.psi(i) - (truth.psi_d_wb + 1j * truth.psi_q_wb)
    out = {"points": int(covered.sum()), "of": int(covered.size)}
    for axis, error, flux in (("d", off.real, truth.psi_d_wb), ("q", off.imag, truth.psi_q_wb)):
        span, mine = float(np.ptp(flux)), error[covered]
        at = np.flatnonzero(covered.ravel())[np.argmax(np.abs(mine))]
        out[axis] = {
            "range_wb": span,
            "max": float(np.abs(mine).max() / span),
            "rms": float(np.sqrt(np.mean(mine**2)) / span),
            "worst_at_a": [float(i.ravel()[at].real), float(i.ravel()[at].imag)],
            "within_target": bool(np.abs(mine).max() / span < TARGET),
        }
    return out


def held_out(surface: Surface, view, held) -> dict:
    """Misfit of the held-out dwells, per axis [V rms]."""
    before, after = misfit(view)["u"].mean(axis=1)[held], surface.residual(view)[held]
    pick = {"d": np.real, "q": np.imag}
    return {
        axis: {k: float(np.sqrt(np.mean(part(x) ** 2))) for k, x in (("before", before), ("after", after))}
        for axis, part in pick.items()
    }


def cannot_tell(surface: Surface, truth: FluxMap) -> list[str]:
    inside = surface.covered(truth.i_d_a[:, None] + 1j * truth.i_q_a)
    r = surface.beside["resistance"]["delta_r"]
    return [
        f"Nothing was recorded beyond {EDGE_A:g} A: {int((~inside).sum())} of {inside.size} points are not covered.",
        "A current scale or a bus gain scales the whole map; only an ammeter or a voltmeter can separate them.",
        f"Resistance fitted with a free surface: nameplate {1e3 * r.value:+.2f} +- {1e3 * r.sigma:.2f} mohm.",
        "A measured map is not exactly reciprocal; a co-energy cannot represent the difference.",
    ]


def _with_surface(answer, surface, found, beside, view, held, noise_v) -> Diagnosis:
    """The answer with the surface: the names that follow from it, the map as plant parameter, the residual."""
    chart, covered = surface.flux_map(MAP_STEP_A)
    edge = np.abs(surface.points.imag).max()
    on_axis = surface.psi(np.array([0.0, 1j * edge, -1j * edge]))
    share = 1.0 - (
        np.mean(np.abs(surface.residual(view)[held]) ** 2) / np.mean(np.abs(misfit(view)["u"].mean(axis=1)[held]) ** 2)
    )
    sigma = surface.error_wb
    machine = view.machine
    own = {
        "saturation": {
            "psi_q_change_at_edge_wb": Estimate(float(on_axis[1].imag - machine.inductance_q_h * edge), sigma, "Wb"),
        },
        "cross_saturation": {
            "psi_d_change_by_i_q_wb": Estimate(float(on_axis[1:].real.mean() - on_axis[0].real), sigma, "Wb"),
        },
    }
    kept = [e for e in answer.effects if beside.get(e.name, 0.0) >= EARNS and e.name not in own]
    effects = tuple(
        NamedEffect(n, 0.999, own[n], float(share), {"machine.flux_map": chart.mended()} if n == found[0] else {})
        for n in found
    )
    ambiguity = tuple(g for g in answer.ambiguity if sum(beside.get(n, EARNS) >= EARNS for n in g) > 1)
    y, left = misfit(view)["u"].mean(axis=1), surface.residual(view)
    rms = lambda x: float(np.sqrt(np.mean(np.abs(x) ** 2)))  # noqa: E731
    fit = Fit("u_dq", "V", rms(y[~held]), rms(left[~held]), rms(y[held]), rms(left[held]), noise_v)
    arrays = answer.evidence.arrays
    what = " and ".join(NAMES_OF_AXES[n] for n in found)
    sentence = (
        f"{what[0].upper()}{what[1:]}: with the flux map found, the misfit at held-out operating points falls from "
        f"{fit.holdout_before:.3g} V to {fit.holdout_after:.3g} V."
    )
    note = (
        f"The flux map is a free reciprocal surface over {int(covered.sum())} of {covered.size} points of its grid; "
        f"its estimated error is {1e3 * sigma:.2g} mWb rms."
    )
    return replace(
        answer,
        verdict="ambiguous" if ambiguity else "explained" if found else answer.verdict,
        sentence=sentence,
        effects=(*effects, *kept),
        ambiguity=ambiguity,
        next_recording=answer.next_recording if ambiguity else (),
        fit=fit,
        explained_share=fit.explained_share,
        remainder=(),
        unknown_term=None,
        advice="",  # that of the answer with the map is written with its outputs
        notes=(*answer.notes, note),
        evidence=replace(answer.evidence, arrays=arrays and arrays | {"after_d": left.real, "after_q": left.imag}),
    )
