# SPDX-License-Identifier: BSD-3-Clause
"""The requested recording: points that separate a rival best after it is refitted."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import MACHINE, recorded
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.inference.converge import fit_of_set
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.plan.candidates import grid, new_axes, steady_view, within_limits
from fluxproof.diagnosis.plan.experiment import ENOUGH, best_points, closest_distance, rivalry
from fluxproof.diagnosis.plan.request import known_of
from fluxproof.diagnosis.plan.request import requests as planned
from fluxproof.diagnosis.words.requests import requested

NOMINAL = load_nominal(PAPER)
RATED = NOMINAL.machine.rated_current_a
NOISE_V = 0.005
LOSSY = {"iron_conductance_s": 1 / 3000.0}
STILL = tuple((w, 0.0, 0.0) for w in (160.0, -160.0, 80.0, -80.0, 40.0, -120.0)) * 2  # rotated at zero current


def requests(*args, **kwargs):
    """The planned points with the words of a request."""
    return requested(planned(*args, **kwargs), CATALOGUE)


def search_of(**deviation):
    """The set-up of a recording, all blocks fitted."""
    view = view_of(recorded(**deviation), NOMINAL)
    return setup_of(view)


def setup_of(view, effects=CATALOGUE):
    return Setup(view, effects, np.ones(len(view), bool))


@pytest.fixture(scope="module")
def lossy():
    return search_of(machine=LOSSY)


def on_a_line(known, sigma=0.2):
    """A parabola as truth, a line b x as rival, at nine candidates from -1 to 1."""
    x = np.linspace(-1.0, 1.0, 9)
    return rivalry(x**2, 0.0 * x, x[None, :], np.array([[known]]), np.full(9, sigma), np.arange(9), 9)


def test_distance_excludes_what_a_refitted_rival_explains():
    """At one point a line fits the parabola; a point and its mirror image separate them completely."""
    free, settled = on_a_line(1e-6), on_a_line(1e12)
    assert free.left([8]) < 1e-4 < 24.0 < settled.left([8])
    assert free.left([0, 8]) == pytest.approx(2.0 / 0.2**2, rel=1e-6)
    x, y = np.array([0.5, 1.0]), np.array([0.25, 1.0])  # the formula against a fit
    b = (x @ y) / (x @ x)
    assert free.left([6, 8]) == pytest.approx(np.sum((y - b * x) ** 2) / 0.2**2, rel=1e-6)


def test_points_are_chosen_together():
    """With an undetermined rival a single point has no value, and a point with its mirror image the most."""
    assert sorted(best_points([on_a_line(1e-6)], 2)) == [0, 8]


def test_points_differ():
    """Even if one point suffices, the others differ: an explanation that is not tied may be true."""
    for sigma in (0.2, 0.01):
        assert sorted(best_points([on_a_line(1e12, sigma)], 3)) in ([0, 1, 8], [0, 7, 8])


def test_sufficient_points_with_least_strain_are_chosen():
    strain = 0.2 * np.linspace(-1.0, 1.0, 9) ** 2
    faint, clear = on_a_line(1e12), on_a_line(1e12, 1e-4)
    assert set(best_points([faint], 2, 0.0, strain)) == {0, 8}
    mild = best_points([clear], 3, 0.0, strain)
    assert not {0, 8} & set(mild)
    # Any single one of the points may be lost.
    assert all(closest_distance([clear], [n for n in mild if n != k]) >= ENOUGH for k in mild)
    out = np.where(np.abs(np.linspace(-1.0, 1.0, 9)) < 0.6, 0.0, 10.0)
    assert sorted(best_points([on_a_line(1e-6)], 2, out)) == [2, 6]


def test_skew_and_iron_loss_are_separated_under_load():
    """Without current both are omega^2 psi_m on the d axis; the loss follows the flux of the load as well."""
    still = view_of(recorded(STILL, machine=LOSSY), NOMINAL)
    search = setup_of(still)
    solutions = [fit_of_set(search, [n]) for n in ("iron_loss", "sampling_skew")]
    asked = requests(search, solutions, 0.05)
    top = np.abs(still.omega).max()
    assert asked and all(abs(r.omega_e) > 0.9 * top for r in asked)
    assert np.hypot(asked[0].i_d, asked[0].i_q) > 0.5 * RATED
    assert set(asked[0].separates) == {"iron_loss", "sampling_skew"} and "V between " in asked[0].why
    titles = (CATALOGUE[n].title for n in asked[0].separates)
    assert all(title in asked[0].why for title in titles) and "iron_loss" not in asked[0].why
    within = within_limits(still)
    for r in asked:
        assert all(x == float(f"{x:.2g}") for x in (r.omega_e, r.i_d, r.i_q)) and within(r.omega_e, r.i_d + 1j * r.i_q)


def test_a_request_is_about_what_is_open(lossy):
    """What both explanations contain is certain and needs no point."""
    solutions = [fit_of_set(lossy, [n, "resistance"]) for n in ("iron_loss", "sampling_skew")]
    for r in requests(lossy, solutions, 0.05):
        assert set(r.separates) == {"iron_loss", "sampling_skew"} and CATALOGUE["resistance"].title not in r.why


def test_new_axis_is_used_only_if_it_separates_better():
    """Curves over i_q are separated by i_q; i_d would add further unknowns."""
    view = view_of(recorded(machine={"inductance_q_h": 1.1 * MACHINE.inductance_q_h}), NOMINAL)
    only_q = view.take(np.abs(view.i.real.mean(axis=1)) < 0.05 * RATED)
    search = setup_of(only_q)
    solutions = [fit_of_set(search, names) for names in (["saturation"], ["inductance_q", "saturation"])]
    assert all(abs(r.i_d) < 1e-9 for r in requests(search, solutions, NOISE_V))
    on_d = np.array([-0.5 * RATED, 0.5j * RATED, 0.0])
    assert new_axes(only_q, on_d).tolist() == [1.0, 0.0, 0.0] and not new_axes(view, on_d).any()


def test_there_is_always_a_request(lossy):
    """If no point separates well, the best ones are requested."""
    same = fit_of_set(lossy, ["sampling_skew"])
    weak = fit_of_set(lossy, ["sampling_skew", "udc_gain"])
    assert 1 <= len(requests(lossy, [same, weak], 100.0)) <= 3


def test_constant_and_drift_are_separated_on_a_cold_machine():
    search = search_of(machine={"magnet_flux_wb": 0.97 * MACHINE.magnet_flux_wb})
    solutions = [fit_of_set(search, [n]) for n in ("magnet_flux", "magnet_temperature")]
    for s in solutions:  # as one operating point would leave it: both the same at the end of the recording
        c = s.c[s.names[0]]
        c.update({key: -0.005 if n == 0 else 0.0 for n, key in enumerate(c)})
    warm, cold = (requests(search, solutions, NOISE_V, cold=x) for x in (False, True))
    assert all(r.temp_winding is None for r in warm)
    assert cold[0].temp_winding == NOMINAL.machine.temperature_ref_c and "cooled down" in cold[0].why


def test_warm_and_cold_points_in_one_view(lossy):
    made = steady_view(lossy.view, [100.0, 100.0], [1j, 1j], np.array([False, True]))
    assert made.course.tolist() == [1.0, 0.0]
    assert made.top_speed == lossy.view.top_speed > 100.0  # to which a curve over speed refers


def test_points_are_within_the_recorded_range(lossy):
    view = lossy.view
    omega, i = grid(view)
    half = 0.5 * 0.9 * NOMINAL.inverter.dc_bus_v / np.sqrt(3) / NOMINAL.machine.magnet_flux_wb
    assert np.abs(omega).max() <= 1.2001 * max(np.abs(view.omega).max(), half)
    assert np.abs(i).max() <= 1.0001 * RATED
    u = NOMINAL.machine.resistance_ohm * i + 1j * omega * (view.inductances(i) + NOMINAL.machine.magnet_flux_wb)
    assert np.abs(u).max() <= 0.9 * NOMINAL.inverter.dc_bus_v / np.sqrt(3)
    assert {(np.sign(w), np.sign(x.imag.round(9))) for w, x in zip(omega, i, strict=True)} >= {(1, 1), (1, -1), (-1, 1)}


def test_a_locked_rotor_asks_for_what_the_drive_can_do():
    """At rest the share of a resistance that rises with speed is noise: it was multiplied to 1e19 kV at speed."""
    locked = tuple((0.0, d, q) for d, q in ((0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (-3.0, 0.0), (0.0, 3.0))) * 2
    view = view_of(recorded(locked, machine={"resistance_ohm": 1.3 * MACHINE.resistance_ohm}), NOMINAL)
    view = view.replace(omega=1e-6 * (1.0 + 0.0 * view.omega))
    search = setup_of(view)
    solutions = [fit_of_set(search, [n]) for n in ("resistance", "udc_gain")]
    solutions[0].c["resistance"]["skin"] = 1e-3 * solutions[0].c["resistance"]["delta_r"]
    for r in requests(search, solutions, NOISE_V):
        volts = [float(part.split()[0]) for part in r.why.split("differs by ")[1:] if part.split()[1] == "V"]
        assert " kV" not in r.why and all(v < NOMINAL.inverter.dc_bus_v for v in volts), r.why


def test_a_prediction_above_the_bus_voltage_has_no_figure(lossy):
    solutions = [fit_of_set(lossy, [n]) for n in ("iron_loss", "resistance")]
    solutions[1].c["resistance"]["delta_r"] = 1e6
    asked = requests(lossy, solutions, NOISE_V)
    assert any(" differs between " in r.why for r in asked) and not any("kV" in r.why for r in asked)


def test_undetermined_part_of_a_curve_has_no_information(lossy):
    """At one speed a resistance and its growth with speed are collinear: only their sum is known."""
    view = lossy.view
    one = view.take(np.isclose(view.omega.mean(axis=1), view.omega.max(), rtol=0.05))
    search = setup_of(one, {"resistance": CATALOGUE["resistance"]})
    solution = fit_of_set(search, ["resistance"])
    solution.c["resistance"]["delta_r"] = 0.3
    at_rest, at_speed = np.array([1.0, 0.0]), np.array([1.0, 1.0])
    known = known_of(solution, {("resistance", k): np.ones(9) for k in ("delta_r", "skin")})
    doubt = np.linalg.inv(known)
    assert at_rest @ doubt @ at_rest > 100.0 * (at_speed @ doubt @ at_speed)
    # Candidates at eight times the speed do not improve the knowledge at the recorded one.
    columns = {("resistance", k): n * np.ones(9) for k, n in (("delta_r", 1.0), ("skin", 64.0))}
    assert np.allclose(known_of(solution, columns), known)
