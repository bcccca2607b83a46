# SPDX-License-Identifier: BSD-3-Clause
"""EMF runs: terminal voltages of a machine that is driven without current."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PSI
from cocotb_tests.support.recordings.bench_logs import emf
from cocotb_tests.support.recordings.from_equations import DRIVE, U_DC, T, made, nominal_of, write
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.recording import RecordingError, from_columns
from fluxproof.diagnosis.inference.converge import fit_of_set
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.ingest.emf import angle_of
from fluxproof.diagnosis.loading.load import load_recording


def answer_of(folder, columns, file="scope.csv"):
    (folder / "drive.toml").write_text(DRIVE)
    return diagnose(write(folder / file, columns), folder / "drive.toml")


def found(answer):
    return {k: e.value for effect in answer.effects for k, e in effect.parameters.items()}


def lines(columns):
    """Two line-to-line voltages and nothing else."""
    u_a, u_b, u_c = (columns[f"u_{x}"] for x in "abc")
    return {"t": columns["t"], "u_ab": u_a - u_b, "u_bc": u_b - u_c}


def test_magnet_flux_of_three_voltages_and_speed(tmp_path):
    answer = answer_of(tmp_path, emf(psi=0.97 * PSI))
    assert answer.verdict == "explained" and found(answer) == {"magnet_flux_wb": pytest.approx(0.97 * PSI, rel=0.001)}
    assert any("angle offset cannot be diagnosed" in note for note in answer.notes)
    healthy = answer_of(tmp_path, emf(psi=PSI))
    assert healthy.verdict == "no_mismatch" and not healthy.effects


def test_line_voltages_alone_suffice(tmp_path):
    answer = answer_of(tmp_path, lines(emf(psi=0.97 * PSI, speeds=(-400.0, -150.0))))
    assert found(answer) == {"magnet_flux_wb": pytest.approx(0.97 * PSI, rel=0.001)}
    recording = load_recording(tmp_path / "scope.csv", nominal_of(tmp_path))
    assert np.median(recording["omega_e"][:1000]) == pytest.approx(-400.0, rel=1e-3)


def test_any_two_of_the_line_voltages(tmp_path):
    x = emf(psi=0.97 * PSI, seconds=0.2)
    y = {"t": x["t"], "u_bc": x["u_b"] - x["u_c"], "u_ca": x["u_c"] - x["u_a"]}
    assert found(answer_of(tmp_path, y)) == {"magnet_flux_wb": pytest.approx(0.97 * PSI, rel=0.002)}


def test_a_common_voltage_of_the_probes_cancels(tmp_path):
    columns = emf(psi=0.97 * PSI, seconds=0.2)
    for name in ("u_a", "u_b", "u_c"):
        columns[name] = columns[name] + 20.0 * np.sin(314.0 * columns["t"]) + 5.0
    assert found(answer_of(tmp_path, columns)) == {"magnet_flux_wb": pytest.approx(0.97 * PSI, rel=0.002)}


@pytest.mark.parametrize("speeds, rate", [((400.0,), 50e3), ((150.0, 400.0), 200e3), ((-300.0, 200.0), 10e3)])
def test_flux_and_fifth_harmonic(tmp_path, speeds, rate):
    answer = answer_of(
        tmp_path, emf(psi=0.97 * PSI, fifth=0.04, speeds=speeds, rate=rate, seconds=0.3), "scope.parquet"
    )
    assert {e.name for e in answer.effects} == {"magnet_flux", "emf_harmonics"}
    # A voltage of order 5 is a flux linkage of a fifth of it.
    assert found(answer)["order_6"] == pytest.approx(0.97 * 0.04 / 5, rel=0.02)
    assert found(answer)["magnet_flux_wb"] == pytest.approx(0.97 * PSI, rel=0.001)


def test_coasting_and_a_slow_instrument(tmp_path):
    rate = 2500.0
    t = np.arange(round(2.0 * rate)) / rate
    omega = 450.0 * np.exp(-t / 1.5)
    angles = (0.3 + np.cumsum(omega) / rate)[:, None] - 2 * np.pi / 3 * np.arange(3)
    e = -omega[:, None] * 0.9 * PSI * np.sin(angles) + 0.2 * np.random.default_rng(4).standard_normal((len(t), 3))
    answer = answer_of(tmp_path, {"t": t, "u_a": e[:, 0], "u_b": e[:, 1], "u_c": e[:, 2]})
    assert found(answer) == {"magnet_flux_wb": pytest.approx(0.9 * PSI, rel=0.003)}


def test_phase_order_against_the_recorded_speed(tmp_path):
    columns = emf(psi=0.97 * PSI, seconds=0.2)
    columns["u_b"], columns["u_c"] = columns["u_c"], columns["u_b"]
    answer = answer_of(tmp_path, columns)
    assert [p.action for p in answer.problems if p.code == "swapped_phases"] == ["u_b and u_c are exchanged"]
    assert found(answer) == {"magnet_flux_wb": pytest.approx(0.97 * PSI, rel=0.002)}


def probe(columns, name="u_ab"):
    """One voltage and nothing else."""
    lines_of = {"u_ab": columns["u_a"] - columns["u_b"], "u_ca": columns["u_c"] - columns["u_a"]}
    return {"t": columns["t"], name: lines_of.get(name, columns.get(name))}


@pytest.mark.parametrize("name, rate", [("u_ab", 50e3), ("u_ab", 2000.0), ("u_ca", 611.0), ("u_a", 211.0)])
def test_one_probe_with_few_samples_of_a_turn(tmp_path, name, rate):
    columns = emf(psi=0.97 * PSI, fifth=0.04, rate=rate, seconds=0.5 if rate > 1e4 else 6.0)
    answer = answer_of(tmp_path, probe(columns, name))
    assert {e.name for e in answer.effects} == {"magnet_flux", "emf_harmonics"}
    assert found(answer)["magnet_flux_wb"] == pytest.approx(0.97 * PSI, rel=0.002)
    assert found(answer)["order_6"] == pytest.approx(0.97 * 0.04 / 5, rel=0.05)
    assert any("not recorded are taken to be alike" in note for note in answer.notes)


def test_one_probe_that_rests_and_spins_up(tmp_path):
    rate = 500.0
    t = np.arange(round(20 * rate)) / rate
    omega = np.interp(t, [0, 5, 7, 15, 17, 20], [0, 0, 300.0, 300.0, 0, 0])
    theta = np.cumsum(omega) / rate
    u = np.sqrt(3) * 0.9 * PSI * omega * np.cos(theta) + 0.02 * np.random.default_rng(4).standard_normal(len(t))
    answer = answer_of(tmp_path, {"t": t, "u_ab": u})
    assert found(answer) == {"magnet_flux_wb": pytest.approx(0.9 * PSI, rel=0.003)}


def test_one_probe_at_a_wandering_speed_shows_no_harmonic(tmp_path):
    """7.1 samples of a turn show order 13 beside the fundamental; the blocks of a window are one observation."""
    rate, rng = 500.0, np.random.default_rng(4)
    t = np.arange(round(20 * rate)) / rate
    wander = np.convolve(rng.standard_normal(len(t)), np.hanning(100), "same")
    omega = 440.0 * (1.0 + 0.01 * wander / wander.std())
    theta = np.cumsum(omega) / rate
    u = np.sqrt(3) * PSI * omega * np.cos(theta) + 0.02 * rng.standard_normal(len(t))
    answer = answer_of(tmp_path, {"t": t, "u_ab": u})
    assert answer.verdict == "no_mismatch" and not answer.minor and not answer.remainder


def test_one_probe_of_noise_is_refused(tmp_path):
    t = np.arange(4000) / 500.0
    with pytest.raises(RecordingError, match="no sine wave|samples of an electrical turn"):
        answer_of(tmp_path, {"t": t, "u_ab": np.random.default_rng(4).standard_normal(len(t))})


def test_refusals_name_the_reason(tmp_path):
    twice = emf(seconds=0.2)
    twice["omega_e"] = 2.0 * twice["omega_e"]
    wrong = answer_of(tmp_path, twice)
    assert wrong.verdict == "bad_recording" and "pole_pairs" in wrong.sentence
    cases = {
        "samples of an electrical turn": emf(rate=140.0, seconds=8.0, speeds=(400.0,)),
        "need a time column": {k: v for k, v in emf(seconds=0.1).items() if k != "t"},
        "without current only": emf(seconds=0.1) | {"i_a": np.full(10000, 3.0)[: 2 * round(0.1 * 50e3)]},
        "whole electrical turn": {k: v[:200] for k, v in emf().items()},
    }
    for words, columns in cases.items():
        with pytest.raises(RecordingError, match=words):
            answer_of(tmp_path, columns)


def test_gaps_separate_runs(tmp_path):
    columns = emf(psi=0.97 * PSI, seconds=0.4)
    keep = np.abs(columns["t"] - 0.2) > 0.05
    columns = {k: v[keep] for k, v in columns.items()}
    recording = load_recording(write(tmp_path / "scope.csv", columns), nominal_of(tmp_path))
    assert np.count_nonzero(~recording.joined) == 2 and len(np.unique(recording.meta["run"])) == 2
    assert found(answer_of(tmp_path, columns)) == {"magnet_flux_wb": pytest.approx(0.97 * PSI, rel=0.002)}


def test_emf_run_beside_a_fast_recording_separates_bus_and_magnets(tmp_path):
    (tmp_path / "drive.toml").write_text(DRIVE)
    files = [write(tmp_path / "scope.csv", emf(psi=PSI)), write(tmp_path / "drive.csv", made(8000, u_dc_gain=1.05))]
    answer = diagnose(files, tmp_path / "drive.toml")
    assert found(answer) == {"udc_gain": pytest.approx(0.05, abs=0.001)}


def test_emf_run_beside_a_fast_recording_decides_between_gains(tmp_path):
    """The gain of the bus is none of the oscilloscope's: its blocks keep their volts."""
    other = DRIVE.replace(f"magnet_flux_wb = {PSI}", f"magnet_flux_wb = {PSI / 0.92}")
    assert other != DRIVE
    (tmp_path / "drive.toml").write_text(other)
    files = [write(tmp_path / "scope.csv", emf(psi=PSI)), write(tmp_path / "drive.csv", made(8000, u_dc_gain=1.05))]
    values = found(diagnose(files, tmp_path / "drive.toml"))
    assert values == {"udc_gain": pytest.approx(0.05, abs=0.001), "magnet_flux_wb": pytest.approx(PSI, rel=5e-4)}


def test_blocks_of_an_emf_run_show_magnets_only(tmp_path):
    nominal = nominal_of(tmp_path)
    view = view_of(load_recording(write(tmp_path / "scope.csv", emf(seconds=0.2)), nominal), nominal)
    seen = view.visible(CATALOGUE)
    assert {"magnet_flux", "emf_harmonics"} <= set(seen)
    assert not {"dead_time", "delay", "udc_gain", "encoder_offset", "current_offset", "iron_loss"} & set(seen)


def test_angle_of_the_fundamental():
    rng = np.random.default_rng(0)
    theta = 0.5 + 300.0 * T * np.arange(4001)
    flux = PSI * np.exp(1j * theta) + 0.02 * PSI * np.exp(-5j * theta)
    u = np.diff(flux) / T + 0.1 * rng.standard_normal(4000)
    error = np.angle(np.exp(1j * (angle_of(u, T) - theta[:-1])))
    inside = np.isfinite(error)
    assert 3700 < inside.sum() < 3900 and np.abs(error[inside]).max() < 2e-3


def spin_down():
    """(columns, angle (n,)) of a healthy machine that slows down evenly, sampled every 50 us."""
    t = np.arange(40000) * 50e-6
    omega = 1200.0 - 550.0 * t
    theta = 1200.0 * t - 275.0 * t**2
    e = -omega[:, None] * PSI * np.sin(theta[:, None] - 2 * np.pi / 3 * np.arange(3))
    e = e + 0.3 * np.random.default_rng(4).standard_normal(e.shape)
    return {"t": t, "u_ab": e[:, 0] - e[:, 1], "u_bc": e[:, 1] - e[:, 2]}, theta


def test_angle_of_a_machine_that_slows_down(tmp_path):
    """The mean over a turn is 0.08 rad ahead at the end, which was told as an unknown voltage of the d axis."""
    columns, theta = spin_down()
    recording = load_recording(write(tmp_path / "scope.parquet", columns), nominal_of(tmp_path))
    error = np.angle(np.exp(1j * (recording["theta_e"] - np.interp(recording["t"], columns["t"], theta))))
    assert np.abs(error).max() < 0.01 and np.abs(error).mean() < 5e-4


def test_an_angle_without_a_whole_turn_is_no_gap(tmp_path):
    """Noise let some rows beyond the first unknown one near the end have a whole turn around them."""
    recording = load_recording(write(tmp_path / "scope.parquet", spin_down()[0]), nominal_of(tmp_path))
    assert not recording.problems, recording.problems
    reversal = emf(seconds=1.0, speeds=(-300.0, 200.0))
    recording = load_recording(write(tmp_path / "r.parquet", lines(reversal)), nominal_of(tmp_path))
    assert not recording.problems and len(np.unique(recording.meta["run"])) == 2


def test_an_effect_without_columns_is_no_solution(tmp_path):
    """At i = 0 cross-saturation has no columns: it is no candidate, and was a KeyError."""
    x, nominal = emf(rate=1 / T, psi=PSI), nominal_of(tmp_path)
    nothing, n = np.zeros(len(x["t"])), len(x["t"])
    theta = np.mod(0.4 + np.cumsum(np.append(0.0, x["omega_e"][:-1])) * T, 2 * np.pi)
    columns = {"t": x["t"], "i_a": nothing, "i_b": nothing, "i_c": nothing, "theta_e": theta, "omega_e": x["omega_e"]}
    columns |= {f"d_{p}": np.roll(0.5 + x[f"u_{p}"] / U_DC, -1) for p in "abc"} | {"u_dc": np.full(n, U_DC)}
    view = view_of(from_columns(columns, T), nominal)
    setup = Setup(view, CATALOGUE, np.ones(len(view), bool))
    able = Problem(setup).able()
    assert "magnet_flux" in able
    for name in ("cross_saturation", "saturation", "current_scale", "inductance_q"):
        assert name not in able and not any(fit_of_set(setup, [name]).c[name].values())
