# SPDX-License-Identifier: BSD-3-Clause
"""The comparison with other methods: each names the effect of a synthetic recording, and its figures can be wrong."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.slow import slowly
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.holdout import holdout_blocks
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from studies.compare import __main__ as command
from studies.compare.data import Data, holdout_rms, neighbour_rms
from studies.compare.methods import METHODS, PACKAGES, TITLES, tuned
from studies.compare.naming import dominant, one_factor
from studies.compare.run import answer_of_names, summary
from studies.compare.table import html, markdown, rows

DRIVE = """[machine]
pole_pairs = 4
resistance_ohm = 1.53
inductance_d_h = 0.016
inductance_q_h = 0.024
magnet_flux_wb = 0.165
rated_current_a = 5.0
[inverter]
dc_bus_v = 563.0
pwm_frequency_hz = 10000.0
"""
PERIOD, BUS, PHASES = 1e-4, 563.0, np.exp(2j * np.pi / 3 * np.arange(3))
POINTS = [(0, 4.5), (0, -4.5), (0, 1.5), (-3, 0), (-3, 3.5), (-1.5, -2.5), (0, 0)]
SPEEDS = [40, -45, 420, -400, 800, -600]
EFFECTS = {
    "resistance": {"r": 1.84},
    "magnet_flux": {"psi": 0.157},
    "inductance_q": {"l_q": 0.027},
    "encoder_offset": {"turn": 0.05},
    "dead_time": {"v_dead": 6.0},
    "emf_harmonics": {"sixth": 0.01},
}


def _recorded(r=1.53, l_d=0.016, l_q=0.024, psi=0.165, turn=0.0, v_dead=0.0, sixth=0.0):
    """Columns of a drive with exact current control; voltages from its flux balance."""
    dwell, rng = 450, np.random.default_rng(3)
    points = [(w, *i) for w in SPEEDS for i in POINTS]
    omega, d, q = (np.repeat([float(p[k]) for p in points], dwell) for k in range(3))
    theta = np.concatenate([[0.0], np.cumsum(omega[:-1] * PERIOD)])
    i_s = (d + 1j * q) * np.exp(1j * theta)
    flux = l_d * d + psi * (1.0 + sixth * np.cos(6 * theta)) + 1j * l_q * q
    flux_s = flux * np.exp(1j * theta)
    x = 0.5 * (i_s + np.roll(i_s, -1))
    u = r * x + (np.roll(flux_s, -1) - flux_s) / PERIOD
    legs = v_dead * np.clip((x[:, None] * np.conj(PHASES)).real / 0.1, -1.0, 1.0)
    u = np.roll(u + (2 / 3) * (legs @ PHASES), -1)  # this row's duties act in the next interval
    noisy = (i_s[:, None] * np.conj(PHASES)).real + 0.005 * rng.standard_normal((len(u), 3))
    duties = 0.5 + (u[:, None] * np.conj(PHASES)).real / BUS
    columns = {"t": np.arange(len(u)) * PERIOD, "theta_e": theta + turn, "omega_e": omega}
    columns |= {f"i_{x}": noisy[:, k] for k, x in enumerate("abc")}
    columns |= {f"d_{x}": duties[:, k] for k, x in enumerate("abc")}
    return columns | {"u_dc": np.full(len(u), BUS)}


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    path = tmp_path_factory.mktemp("compare") / "drive.toml"
    path.write_text(DRIVE)
    return load_nominal(path)


def _data(nominal, **changes):
    view = view_of(from_columns(_recorded(**changes), PERIOD), nominal)
    return Data(view, misfit(view), holdout_blocks(view))


@pytest.mark.parametrize("method", [slowly(m) if m == "joint" else m for m in METHODS])
def test_names_one_effect_and_none(nominal, method):
    if method in PACKAGES:
        pytest.importorskip(PACKAGES[method], reason=f"{PACKAGES[method]} is not installed (make setup)")
    settings, module, found = tuned()["methods"][method], METHODS[method], {}
    for effect, changes in {"": {}, **EFFECTS}.items():
        data = _data(nominal, **changes)
        fitted = module.fit(data, **settings["fit"])
        found[effect] = module.names(fitted, **settings["names"])
        before, after = (holdout_rms(x, data.held) for x in (data.misfit["u"].mean(axis=1), fitted.left))
        if effect and effect != "emf_harmonics":  # a harmonic leaves little in the mean of a block
            assert before > 0.4 and after < 0.6 * before, f"{effect}: {before} V, {after} V after"
    assert found.pop("") == []
    right = sum(names == [effect] for effect, names in found.items())
    assert right >= len(EFFECTS) - 1, found


def test_neighbours_separate_noise_from_misfit():
    rng, run = np.random.default_rng(1), np.repeat(np.arange(400), 3)
    left = 5.0 * run + 0.2 * (rng.standard_normal(len(run)) + 1j * rng.standard_normal(len(run)))
    assert neighbour_rms(left, run) == pytest.approx(0.2 * 2**0.5, rel=0.1)
    assert np.isnan(neighbour_rms(left, np.arange(len(run))))


def test_rules_of_naming():
    three = ["resistance", "inductance_d", "inductance_q"]
    assert one_factor(three, dict.fromkeys(three, 0.03)) == ["current_scale"]
    assert one_factor(three, {**dict.fromkeys(three, 0.03), "resistance": -0.03}) == three
    four = [*three, "magnet_flux"]
    assert one_factor(four, dict.fromkeys(four, 0.02)) == ["udc_gain"]
    sizes = {"resistance": 5.0, "delay": 0.4, "friction": 2.0}
    assert dominant(sizes, 0.3, 0.0, 3.0) == ["delay", "resistance"]
    assert dominant(sizes, 0.3, 0.1, 1.0) == ["friction", "resistance"]


def _case(stratum, *names):
    effects = [{"name": n} for n in names]
    return {"case": "case_0001", "stratum": stratum, "effects": effects, "identifiable": {"all": True}}


def test_figures_and_table():
    fit = {"seconds": 2.0, "holdout_v": 0.3, "noise_v": 0.2}
    cases = [
        (_case("single", "delay"), answer_of_names(["delay"]) | fit),
        (_case("single", "delay"), answer_of_names(["delay", "cogging"]) | fit),
        (_case("pair", "delay", "cogging"), answer_of_names(["delay"]) | fit),
        (_case("healthy"), answer_of_names([]) | fit),
        (_case("healthy"), answer_of_names(["delay"]) | fit),
        (_case("healthy"), {"error": "broken"}),
    ]
    s = summary(cases)
    assert s["single_named_right"]["value"] == 0.5 and s["single_truth_among_names"]["value"] == 1.0
    assert s["pairs_exactly_right"]["value"] == 0.0 and s["confidently_wrong"]["k"] == 2
    assert s["false_alarm_healthy"]["k"] == 2 and s["breakdowns"] == 1
    assert s["holdout_over_floor"] == pytest.approx({"median": 1.5, "p95": 1.5, "n": 3})
    result = {
        "seed": 7,
        "tuned_on_seed": 8,
        "cases": {"single": 2, "pair": 1, "healthy": 3},
        "methods": dict.fromkeys(TITLES, s),
    }
    assert len({len(row) for row in rows(result)}) == 1 and len(rows(result)) == len(TITLES) + 1
    assert "50 %" in markdown(result) and "on seed 8" in markdown(result)
    assert html(result).count("<tr>") == len(TITLES) + 1


def test_rejects_the_tuning_seed(capsys):
    for package in PACKAGES.values():
        pytest.importorskip(package, reason=f"{package} is not installed (make setup)")
    assert command.main(["--seed", str(tuned()["seed"])]) == 2
    assert "used to tune" in capsys.readouterr().err
