# SPDX-License-Identifier: BSD-3-Clause
"""The generator with a magnetic circuit against physics and against itself, never against the tool."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fluxproof.checkout import ROOT
from studies.blind import generate
from studies.blind.circuit import cases, iron, plan, record
from studies.blind.circuit.drives import KINDS, random_real, sheet
from studies.blind.circuit.faults import FAULTS, LATER, MADE, SHEET, UNKNOWN

TURNS = np.exp(2j * np.pi / 3 * np.arange(3))
PERFECT = {
    "machine": dict.fromkeys(
        "iron_m r_a r_b r_c slot emf_6 emf_12 cogging friction g_eddy g_hysteresis".split(), 0.0
    ),
    "inverter": dict.fromkeys("dead t_on t_off c_leg v_switch v_diode r_on".split(), 0.0),
    "sensors": dict.fromkeys("offset_a offset_b offset_c runout resolver hum noise_a noise_v".split(), 0.0)
    | {"gain_a": 1.0, "gain_b": 1.0, "gain_c": 1.0, "bits": 16, "encoder_bits": 17, "bus_every": 1},
}  # fmt: skip


def _real(kind, perfect=False, seed=1):
    real = random_real(np.random.default_rng([seed, sorted(KINDS).index(kind)]), (kind,))[1]
    for part, values in PERFECT.items() if perfect else ():
        real.set(part, **values)
    if perfect:  # a bus that does not move: the recording has it at the sampling instants only
        real.set("inverter", c_bus=1e3 * real.inverter.c_bus, r_bus=1e-3 * real.inverter.r_bus, rectifier=False)
    return real


def _case(kind, real, seconds=0.12):
    """Two held points at opposite speeds."""
    drive = sheet(kind, real)
    a = 0.5 * drive.current
    points = [(-0.5, 0.7), (-0.2, -0.9)]
    omega = 0.7 * plan.top_speed(drive, [(d * a, q * a) for d, q in points])
    held = [(w * omega, d * a, q * a) for w, (d, q) in zip((1.0, -0.6), points, strict=True)]
    return cases.Case("healthy", drive, real, plan.course(drive, held, seconds, 2 * np.pi * 200.0))


def test_it_shares_no_code_with_tool_plant_or_other_generators():
    imported = set()
    for path in sorted((Path(ROOT) / "studies/blind/circuit").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            imported |= set(names + ([node.module] if isinstance(node, ast.ImportFrom) else []))
    rooms = ("fluxproof", "golden_model", "studies")
    own = {n for n in imported if n.split(".")[0] in rooms and not n.startswith("studies.blind.circuit")}
    assert own == {"fluxproof.files"}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["servo", "traction"])
def test_a_linear_machine_obeys_the_stator_equation_in_its_recording(kind):
    """The recorded columns alone, by the documented convention: u = R i + j omega psi within 1.5 thousandths."""
    case = _case(kind, _real(kind, perfect=True))
    kept, d = cases.simulate(case, 1, 1)[1], case.drive
    u, i = (2 / 3 * TURNS @ np.stack([kept[f"{x}_{k}"] for k in "abc"]) for x in "di")
    theta = np.unwrap(kept["theta_e"])
    for first, last in case.plan.held:
        rows = np.arange(first + (last - first) // 2, last - 1)
        omega = (theta[rows[-1]] - theta[rows[0]]) / (len(rows) - 1) / d.period
        rotor = np.exp(-1j * (theta[rows] + 0.5 * omega * d.period))
        u_dq = np.mean(u[rows - 1] * kept["u_dc"][rows] * rotor)  # duties of a row act a period later
        i_dq = np.mean(i[rows] * np.exp(-1j * theta[rows]))
        psi = d.psi + d.l_d * i_dq.real + 1j * d.l_q * i_dq.imag
        assert abs(u_dq - d.r * i_dq - 1j * omega * psi) < 1.5e-3 * abs(u_dq) < 0.05 * d.bus * 1.5


@pytest.mark.parametrize("kind", sorted(KINDS))
@pytest.mark.slow
def test_power_balance_closes(kind):
    """With all physics of the machine: terminals = copper + core and short + shaft + field, to a ten-thousandth."""
    real, rng = _real(kind), np.random.default_rng(4)
    for fault in (*MADE.values(), LATER["iron_loss"], LATER["emf_harmonics"], UNKNOWN["shorted_turns"]):
        fault(real, rng, 1.0)
    real.set("machine", slot=0.03, cogging=0.01 * real.machine.psi * real.machine.rated)
    real.set("inverter", v_switch=0.0, v_diode=0.0, r_on=0.0)
    case = _case(kind, real, 0.05)
    inside = cases.simulate(case, 2, 1)[0]
    given = {k: inside[k][-1] - inside[k][0] for k in inside if k.startswith("e_") or k == "field"}
    turnover = np.abs(np.diff(inside["e_in"])).sum()
    assert min(given["e_copper"], given["e_core"]) > 1e-3 * turnover
    left = given["e_in"] - given["e_copper"] - given["e_core"] - given["e_shaft"] - given["field"]
    assert abs(left) < 1e-4 * turnover
    assert given["e_bus"] == pytest.approx(given["e_in"], abs=1e-6 * turnover)  # switches without drops


def test_current_and_torque_are_derivatives_of_the_energy():
    real, rng = _real("traction"), np.random.default_rng(3)
    for fault in (*MADE.values(), LATER["emf_harmonics"]):
        fault(real, rng, 1.5)
    real.set("machine", slot=0.05)
    m = real.machine
    for i_d, i_q, theta in rng.uniform(-1.0, 1.0, (20, 3)) * (m.rated, m.rated, 3.0):
        h, g = 1e-6 * m.psi, 1e-6
        lam = complex(*iron.linkage(m, m.psi, i_d, i_q, theta)) * np.exp(1j * theta)
        a, b = lam.real, lam.imag

        def energy(a, b, theta):
            return iron.circuit(m, m.psi, a, b, theta)[3]

        i_a, i_b, torque, _ = iron.circuit(m, m.psi, a, b, theta)
        found = (energy(a + h, b, theta) - energy(a - h, b, theta)) / (3 * h)
        other = (energy(a, b + h, theta) - energy(a, b - h, theta)) / (3 * h)
        turned = -m.pole_pairs * (energy(a, b, theta + g) - energy(a, b, theta - g)) / (2 * g)
        assert (found, other) == pytest.approx((i_a, i_b), rel=1e-4, abs=1e-4 * m.rated)
        assert turned == pytest.approx(torque, rel=1e-4, abs=1e-4 * m.pole_pairs * m.psi * m.rated)
        assert complex(i_a, i_b) * np.exp(-1j * theta) == pytest.approx(complex(i_d, i_q), abs=1e-6 * m.rated)


@pytest.mark.parametrize("name", [*FAULTS, *UNKNOWN])
def test_each_fault_is_in_the_recording(name):
    """Other columns or another drive file; the noise is the same with and without, so that it is no difference."""

    warms = name.endswith("_temperature")
    size, seconds, least = (2.0, 0.2, 5e-5) if warms else (1.0, 0.05, 1e-3)

    def columns(fault):
        real, rng = _real("compressor"), np.random.default_rng(1)
        if fault and name in MADE:
            MADE[name](real, rng, size)
        case = _case("compressor", real, seconds)
        if fault and name in {**LATER, **UNKNOWN}:
            {**LATER, **UNKNOWN}[name](real, rng, size)
        if fault and name in SHEET:
            case = dataclasses.replace(case, drive=SHEET[name](case.drive, rng, size)[0])
        return case.drive, cases.simulate(dataclasses.replace(case, torque=True), 6, 1)[1]

    (drive, without), (file, kept) = columns(False), columns(True)
    scales = {"u_dc": drive.bus, "torque": 1.5 * drive.pole_pairs * drive.psi * drive.current, "theta_e": 2.0}
    scales |= {f"i_{x}": drive.current for x in "abc"} | {f"d_{x}": 1.0 for x in "abc"}
    rows = min(len(kept["t"]), len(without["t"]))
    change = {k: np.sqrt(np.mean((kept[k][:rows] - without[k][:rows]) ** 2)) / x for k, x in scales.items()}
    assert file != drive or max(change.values()) > least, change


def test_every_fault_and_unknown_is_drawn():
    drawn = {cases.make(3, n, "single", n).effects[0]["name"] for n in range(16)}
    assert drawn == set(FAULTS) - {"iron_teeth", "angle_late"} | {"sampling_skew"}
    assert {cases.make(3, n, "unknown", n).kind for n in range(4)} == set(UNKNOWN)
    assert [e["name"] for e in cases.make(3, 1, "pair", 3).effects] == ["saturation", "cross_saturation"]


def test_a_seed_gives_the_same_recording_and_another_does_not():
    def columns(seed):
        case = cases.make(seed, 4, "pair", 1)
        rows = 800
        case.plan = dataclasses.replace(case.plan, speed=case.plan.speed[:rows], i_ref=case.plan.i_ref[:rows])
        return cases.simulate(case, seed, 4)[1]

    one, same, other = columns(5), columns(5), columns(6)
    assert all(np.array_equal(one[name], same[name]) for name in one)
    assert not np.array_equal(one["i_a"][:100], other["i_a"][:100])


def test_a_case_is_written_with_its_truth(tmp_path, monkeypatch):
    monkeypatch.setattr(record, "sound", lambda *_: True)
    monkeypatch.setattr(plan, "bench", lambda rng, d: plan.course(d, [(100.0, 0.0, 0.3 * d.current)], 0.1, 1e3))
    entry = generate.generate_case(("circuit", 1, 7, "single", 3, tmp_path))
    frame = pd.read_parquet(tmp_path / entry["case"] / entry["recording"])
    assert len(frame) == entry["rows"] and np.isfinite(frame.to_numpy()).all()
    assert {"t", "i_a", "i_b", "i_c", "theta_e", "omega_e", "u_dc", "d_a", "d_b", "d_c"} <= set(frame.columns)
    assert (tmp_path / entry["case"] / "drive.toml").read_text().startswith("[machine]")
    assert len(entry["effects"]) == 1
    assert generate.strata_of("circuit") == cases.STRATA and sum(cases.STRATA.values()) == pytest.approx(1.0)
