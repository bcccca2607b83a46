# SPDX-License-Identifier: BSD-3-Clause
"""Operating points as a recording: tables, constants, one axis, logs of a few hundred hertz, several files."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import answer_of, found, held, said, without
from cocotb_tests.support.drives import L_D, L_Q, PSI, RATED, R
from cocotb_tests.support.recordings.bench_logs import GRID, Truth, sampled, table
from cocotb_tests.support.recordings.from_equations import DRIVE, made, nominal_of, write
from cocotb_tests.support.recordings.with_mistake import all_of, frame, moved, scaled
from cocotb_tests.support.slow import halved, slowly
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.slow_view import slow_view
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording

WEAK = Truth(psi=0.95 * PSI)


@pytest.mark.parametrize(
    "kind", [table, slowly(lambda truth: held(table(truth)))], ids=["table", "held one after another"]
)
def test_every_row_is_an_operating_point(tmp_path, kind):
    answer = answer_of(tmp_path, kind(WEAK))
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == ["magnet_flux"]
    assert found(answer)["magnet_flux_wb"] == pytest.approx(0.95 * PSI, rel=0.005)
    assert any("emf_harmonics" in note and "cannot be diagnosed" in note for note in answer.notes)
    assert answer_of(tmp_path, kind(Truth())).verdict == "no_mismatch"


def test_a_table_has_no_drift(tmp_path):
    recording = load_recording(write(tmp_path / "r.csv", table()), nominal_of(tmp_path))
    view = slow_view(recording, nominal_of(tmp_path))
    assert recording.points and not view.course.any() and view.span_s == 0.0
    from fluxproof.diagnosis.catalogue import CATALOGUE

    seen = set(view.visible(CATALOGUE))
    assert not {"magnet_temperature", "emf_harmonics"} & seen
    assert {"magnet_flux", "dead_time", "delay"} <= seen


def test_rounded_values_and_transients_of_a_slow_log(tmp_path):
    points = [p for p in GRID for _ in range(30)]
    columns = held(table(WEAK, points=points), 1.0)
    columns |= {k: np.round(columns[k], 1) for k in ("i_d", "i_q", "u_d_ref", "u_q_ref")}
    between = np.flatnonzero(np.arange(len(points)) % 30 == 0)[1:]  # a row in the middle of every change
    for name in ("i_d", "i_q", "omega_e", "u_d_ref", "u_q_ref"):
        columns[name][between] = 0.5 * (columns[name][between - 1] + columns[name][between + 1])
    answer = answer_of(tmp_path, columns)
    assert found(answer) == {"magnet_flux_wb": pytest.approx(0.95 * PSI, rel=0.005)}


def test_a_sine_filter_is_described_with_its_capacitance(tmp_path):
    """Currents measured in front of a filter looked like a gain of all sensors beside drifts of magnet and winding."""
    columns = dict(table())
    i, omega = columns["i_d"] + 1j * columns["i_q"], columns["omega_e"]
    capacitance, choke, copper = 2e-6, 0.12 * L_D, 0.1 * R
    u = R * i + 1j * omega * (L_D * i.real + 1j * L_Q * i.imag + PSI)
    i = i + 1j * omega * capacitance * u
    u = u + (copper + 1j * omega * choke) * i
    columns |= {"i_d": i.real, "i_q": i.imag, "u_d_ref": u.real, "u_q_ref": u.imag}
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == "unexplained" and not answer.effects
    assert "sine filter" in answer.sentence and answer.unknown_term.explains > 0.95
    assert answer.unknown_term.value == pytest.approx(capacitance, rel=0.05)


def test_a_table_at_several_temperatures_shows_winding_and_magnets(tmp_path):
    parts = []
    for temp in (20.0, 60.0, 100.0):
        warm = Truth(r=R * (1.0 + 0.0039 * (temp - 20.0)), psi=PSI * (1.0 - 0.001 * (temp - 20.0)))
        part = table(warm, seed=int(temp))
        parts.append(part | {"temp_winding": np.full(len(part["i_q"]), temp)})
    answer = answer_of(tmp_path, {name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
    assert answer.verdict == "explained", answer.sentence
    assert found(answer)["magnet_flux_drift_wb"] == pytest.approx(-0.08 * PSI, rel=0.05)
    assert found(answer)["resistance_temp_coeff_per_k"] == pytest.approx(0.0039, rel=0.1)


@pytest.mark.parametrize("size, verdict", [(0.1, "no_mismatch"), (0.5, "no_mismatch"), slowly(3.0, "explained")])
def test_either_of_two_causes_is_not_agreement(tmp_path, size, verdict):
    """Within so narrow a range of currents resistance and dead time imitate each other: one value has to say so.

    Of half the size, most probably 0.05 % of the bus as dead time, both are a note.
    """
    points = [(w, 0.0, q) for w in (80.0, 200.0, 350.0, -300.0) for q in np.linspace(2.5, 4.5, 4)]
    truth = Truth(r=R + 0.08 * size, v_dead=0.25 * size)
    answer = answer_of(tmp_path, table(truth, points=points, noise_v=0.02))
    assert answer.verdict == verdict, answer.sentence
    if verdict == "no_mismatch":
        assert not answer.effects and not answer.ambiguity
        noise = answer.fit.train_before <= 2.0 * answer.fit.noise_floor
        assert noise or [m.name for m in answer.minor] == ["dead_time"]
    if answer.effects:
        sizes = {"v_dead_v": truth.v_dead, "resistance_ohm": truth.r}
        estimates = {key: e for effect in answer.effects for key, e in effect.parameters.items()}
        assert "v_dead_v" in estimates and ("resistance_ohm" in estimates or said(answer, "Winding resistance"))
        assert all(abs(e.value - sizes[key]) < 2.0 * e.sigma for key, e in estimates.items())


@pytest.mark.parametrize("error_v, verdict", [(0.1, "ambiguous"), (0.15, "no_mismatch")])
def test_of_a_usual_misfit_effects_explain_the_larger_part_or_are_not_told(tmp_path, error_v, verdict):
    """A resistance 5 % too large beside errors of the points that repeat: 0.14 V and 0.2 % of the voltage are usual."""
    columns = {k: np.repeat(v, 2) for k, v in table(Truth(r=1.05 * R), noise_v=error_v, noise_a=0.0).items()}
    for name in ("u_d_ref", "u_q_ref"):
        columns[name] += 0.005 * np.random.default_rng(1).standard_normal(len(columns[name]))
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == verdict and not answer.effects, answer.sentence
    assert answer.ambiguity == ((("dead_time", "resistance"),) if verdict == "ambiguous" else ())
    assert answer.fit.train_before > 3.0 * answer.fit.noise_floor


CORRECTED = {  # what a check corrects before the magnets are found
    "i_q has the opposite sign": scaled(("i_q",), -1.0),
    "i_d and i_q are swapped": moved(("i_d", "i_q"), ("i_q", "i_d")),
    "the speed has the wrong sign": scaled(("omega_e",), -1.0),
    "rad/s of the shaft": scaled(("omega_e",), 1 / 4),
}


@pytest.mark.parametrize("found_by_check", halved(CORRECTED))
def test_an_effect_behind_a_mistaken_column_of_a_table_is_named(tmp_path, found_by_check):
    answer = answer_of(tmp_path, CORRECTED[found_by_check](table(WEAK)))
    assert [e.name for e in answer.effects] == ["magnet_flux"] and not answer.conventions, answer.sentence
    assert any(found_by_check in p.message for p in answer.problems)


# Mistakes that no reading describes, and that effects or readings would explain in part.
UNKNOWN = {
    "voltages in units of 40 V": scaled(("u_d_ref", "u_q_ref"), 1 / 40.0),
    "mirrored and turned": all_of(scaled(("i_d", "u_d_ref"), -1.0), frame(np.pi / 4)),
}


@pytest.mark.parametrize("name", halved(UNKNOWN))
def test_a_mistake_without_a_reading_is_not_explained_by_another(tmp_path, name):
    from fluxproof.diagnosis.session import run

    (tmp_path / "drive.toml").write_text(DRIVE)
    recording = write(tmp_path / "r.csv", UNKNOWN[name](table(Truth(psi=0.95 * PSI, r=1.3 * R))))
    answer = run(recording, tmp_path / "drive.toml", tmp_path / "out")
    assert answer.verdict == "unexplained" and not answer.conventions and not answer.effects, answer.sentence
    assert not (tmp_path / "out" / "drive_improved.toml").exists()
    assert answer.fit.holdout_after == answer.fit.holdout_before


OFF = {  # by a size that is no convention: the effect, its parameter and value
    "currents at 0.37": (scaled(("i_d", "i_q"), 0.37), "current_scale", "scale", -0.63),
    "voltages at 0.37": (scaled(("u_d_ref", "u_q_ref"), 0.37), "udc_gain", "udc_gain", -0.63),
    "frame 45 degrees ahead": (frame(np.pi / 4), "encoder_offset", "offset_rad", np.pi / 4),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", OFF)
def test_an_error_is_named_up_to_the_ceiling_of_its_effect(tmp_path, name):
    change, effect, key, value = OFF[name]
    answer = answer_of(tmp_path, change(table()))
    assert not answer.conventions, answer.sentence
    if answer.effects:
        assert [e.name for e in answer.effects] == [effect], answer.sentence
        assert found(answer)[key] == pytest.approx(value, abs=0.005)
    else:  # the constants of the drive file by one factor leave the same
        assert answer.ambiguity == (tuple(sorted((effect, "machine_scale"))),), answer.sentence
    # With weaker magnets one scale may be another with other magnets.
    answer = answer_of(tmp_path, change(table(WEAK)))
    assert not answer.conventions and effect in {e.name for e in answer.effects} | set().union(*answer.ambiguity)


SEVERAL = Truth(psi=0.95 * PSI, r=1.3 * R, l_q=0.8 * L_Q, v_dead=2.0)


def test_a_reversed_current_beside_several_errors_is_told(tmp_path):
    """At large currents the sign leaves 15 % of the voltage instead of 91 %: the causes behind it are found with it."""
    answer = answer_of(tmp_path, scaled(("i_q",), -1.0)(table(SEVERAL)))
    assert any("i_q has the opposite sign" in problem.message for problem in answer.problems), answer.sentence
    wanted = {"magnet_flux_wb": 0.95 * PSI, "resistance_ohm": 1.3 * R, "inductance_q_h": 0.8 * L_Q}
    assert {key: found(answer)[key] for key in wanted} == pytest.approx(wanted, rel=0.01)
    assert {e.name for e in answer.effects} == {"dead_time", "inductance_q", "magnet_flux", "resistance"}


@pytest.mark.slow
def test_a_scale_of_two_beside_several_usual_errors_is_told_beside_wrong_constants(tmp_path):
    """R, L_d and L_q that are wrong by factors of their own explain the same: a drive file is written by hand."""
    answer = answer_of(tmp_path, scaled(("i_d", "i_q"), 0.5)(table(SEVERAL)))
    assert answer.verdict == "ambiguous" and said(answer, "recorded currents are half the true ones"), answer.sentence
    factors = {"resistance_ohm": 2.6 * R, "inductance_d_h": 2.0 * L_D, "inductance_q_h": 1.6 * L_Q}
    assert {key: found(answer)[key] for key in factors} == pytest.approx(factors, rel=0.06)


@pytest.mark.parametrize("rows", [1, slowly(2), 3])
def test_few_rows_of_a_healthy_drive_are_healthy(tmp_path, rows):
    for first in (0, 4, 10, 20):
        answer = answer_of(tmp_path, {k: v[first : first + rows] for k, v in table().items()})
        assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity


def test_without_u_d_the_q_axis_is_balanced(tmp_path):
    answer = answer_of(tmp_path, without(table(WEAK), "u_d_ref"))
    assert [e.name for e in answer.effects] == ["magnet_flux"] and said(answer, "only the q axis")
    assert found(answer)["magnet_flux_wb"] == pytest.approx(0.95 * PSI, rel=0.005)
    assert np.all(answer.evidence.arrays["before_d"] == 0.0)
    # The d axis has the whole effect of L_q: nothing can be said of it.
    other = answer_of(tmp_path, without(table(Truth(l_q=1.2 * L_Q)), "u_d_ref"))
    assert other.verdict == "no_mismatch" and not other.effects


def test_without_u_d_a_fast_recording_becomes_operating_points(tmp_path):
    points = [(w, 0.0, q) for w in (250.0, 500.0, -300.0) for q in (0.0, 2.0, 4.0, -3.0)]
    columns = without(sampled(10000.0, WEAK, points=points, hold_s=0.3, ramp_s=0.02), "u_d_ref")
    answer = answer_of(tmp_path, columns, file="r.parquet")
    assert "one_axis" in [p.code for p in answer.problems]
    named = {e.name for e in answer.effects} | set().union(*answer.ambiguity)
    assert "magnet_flux" in named


@pytest.mark.parametrize("hertz, hold_s", [slowly(500.0, 1.0), (200.0, 0.6), slowly(1000.0, 0.3)])
def test_logs_of_a_few_hundred_hertz_are_operating_points(tmp_path, hertz, hold_s):
    answer = answer_of(tmp_path, sampled(hertz, WEAK, hold_s=hold_s))
    assert "slow_sampling" in [p.code for p in answer.problems]
    named = {e.name for e in answer.effects} | set().union(*answer.ambiguity)
    assert "magnet_flux" in named and named <= {"magnet_flux", "magnet_temperature", "udc_gain"}
    healthy = answer_of(tmp_path, sampled(hertz, hold_s=hold_s))
    assert healthy.verdict == "no_mismatch" and not healthy.effects


def test_a_bad_part_costs_only_that_part(tmp_path):
    (tmp_path / "drive.toml").write_text(DRIVE)
    good = write(tmp_path / "good.csv", table(WEAK))
    no_current = write(tmp_path / "no_current.csv", without(table(), "i_q"))
    too_short = write(tmp_path / "short.csv", {k: v[:30] for k, v in made(500).items()})
    answer = diagnose([no_current, good, too_short], tmp_path / "drive.toml")
    assert [e.name for e in answer.effects] == ["magnet_flux"]
    findings = {p.action: p.message for p in answer.problems if p.code == "part_left_out"}
    assert set(findings) == {"no_current.csv is not used", "short.csv is not used"}
    assert "missing i_q" in findings["no_current.csv is not used"]
    assert "at least 400 are needed" in findings["short.csv is not used"]
    with pytest.raises(RecordingError, match="missing i_q"):
        diagnose([no_current], tmp_path / "drive.toml")


def test_fast_and_slow_recordings_together(tmp_path):
    (tmp_path / "drive.toml").write_text(DRIVE)
    fast = write(tmp_path / "fast.csv", made(6000, u_dc_gain=1.0))
    answer = diagnose([fast, write(tmp_path / "points.csv", table())], tmp_path / "drive.toml")
    assert answer.verdict == "no_mismatch" and said(answer, "for harmonics and sampling instants, diagnose fast.csv")


def test_several_slow_recordings_are_joined(tmp_path):
    (tmp_path / "drive.toml").write_text(DRIVE)
    files = [write(tmp_path / "a.csv", held(table(WEAK))), write(tmp_path / "b.csv", sampled(500.0, WEAK, hold_s=0.6))]
    answer = diagnose([*files, write(tmp_path / "c.csv", table(WEAK, seed=9))], tmp_path / "drive.toml")
    assert [e.name for e in answer.effects] == ["magnet_flux"]


AREA = [(w, d, q) for w in (250.0, 500.0, -300.0) for d in (-4.0, -2.0, 0.0) for q in (-5.0, -3.0, -1.5, 0.0, 2.0, 4.0)]


@pytest.mark.parametrize("points, written", [(AREA, True), ([(w, 0.4 * q, q) for w, _, q in AREA], False)])
def test_flux_map_of_a_table(tmp_path, points, written):
    """The q axis saturates: L_q is a quarter smaller at rated current.  Currents on a line leave no map."""
    from fluxproof.diagnosis.ground.plant_section import read_flux_map
    from fluxproof.diagnosis.session import run

    flux_q = lambda i_q: L_Q * i_q * (1.0 - 0.25 * np.abs(i_q) / RATED)  # noqa: E731
    columns = table(points=points, noise_v=0.02, noise_a=0.0)
    columns["u_d_ref"] -= columns["omega_e"] * (flux_q(columns["i_q"]) - L_Q * columns["i_q"])
    (tmp_path / "drive.toml").write_text(DRIVE)
    (tmp_path / "out").mkdir()
    for name in ("flux_map.csv", "diagnosis.json"):
        (tmp_path / "out" / name).write_text("of an earlier run")
    answer = run(write(tmp_path / "r.csv", columns), tmp_path / "drive.toml", tmp_path / "out")
    assert (tmp_path / "out" / "flux_map.csv").exists() == written == said(answer, "flux_map.csv"), answer.sentence
    if written:
        chart = read_flux_map(tmp_path / "out" / "flux_map.csv")
        assert np.abs(chart.psi_q_wb - flux_q(chart.i_q_a)).max() < 0.002 * flux_q(RATED)
        assert np.abs(chart.psi_d_wb - (PSI + L_D * chart.i_d_a)[:, None]).max() < 0.002 * PSI


def test_constants_survive_in_the_improved_drive(tmp_path):
    from fluxproof.diagnosis.session import run

    (tmp_path / "drive.toml").write_text(DRIVE + "[constants]\nu_dc = 563.0\n")
    run(write(tmp_path / "r.csv", table(WEAK)), tmp_path / "drive.toml", tmp_path / "out")
    improved = load_nominal(tmp_path / "out" / "drive_improved.toml")
    assert improved.constants == {"u_dc": 563.0}
    assert improved.machine.magnet_flux_wb == pytest.approx(0.95 * PSI, rel=0.005)
