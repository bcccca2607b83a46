# SPDX-License-Identifier: BSD-3-Clause
"""The sealed generator against physics and against itself, never against the tool: voltages, energy, codes."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fluxproof.checkout import ROOT
from studies.blind import __main__ as blind
from studies.blind import generate
from studies.blind.sealed import cases, inverter, magnetics, params, plan, record, sensors
from studies.blind.sealed.drives import KINDS, random_drive
from studies.blind.sealed.faults import FAULTS, UNKNOWN
from studies.blind.sealed.write import write_case

TURNS = np.exp(2j * np.pi / 3 * np.arange(3))
IRON = ("saturation", "cross_saturation", "emf_harmonics")


def _case(kind, faults=(), unknown=(), seed=1, free=False, bits=16):
    """A case with two held points (the first once more at the end) and chosen physics."""
    rng = np.random.default_rng([seed, sorted(KINDS).index(kind)])
    drive = random_drive(rng, (kind,))
    a = 0.6 * drive.current
    omega = 0.6 * plan.top_speed(drive, [(-0.5 * a, a), (-0.2 * a, -a)])
    points = [(omega, -0.5 * a, a, 0.0), (-0.5 * omega, -0.2 * a, -a, 0.0), (omega, -0.5 * a, a, 0.0)]
    load = 0.3 * drive.rated_torque
    points = [(w, d, q, load) for w, d, q, _ in points] if free else points
    ramp = 0.2 * drive.rated_torque / drive.inertia * drive.pole_pairs if free else omega / 0.05
    way = plan.course(drive, points, 2000, ramp, 0.0)
    course = plan.Plan("speed" if free else "bench", *way)
    real = record.healthy(rng, drive, course, bits)
    control = record.controller(rng, drive, course, slow=True)._replace(bandwidth=2 * np.pi * 100.0)
    for name in faults:
        FAULTS[name](real, drive, rng, 1.0)
    for name in unknown:
        UNKNOWN[name](real, drive, rng, 1.0)
    return cases.Case("healthy", drive, course, real, control)


def _short(case, rows=250):
    """The same case with its first two points only."""
    (a, _), (b, _) = case.plan.held[0], case.plan.held[1 % len(case.plan.held)]
    n = b + rows if b else rows
    course = dataclasses.replace(
        case.plan, goal=case.plan.goal[: n + 1], i_ref=case.plan.i_ref[:n], load=case.plan.load[:n], held=((a, n),)
    )
    return dataclasses.replace(case, plan=course)


def _whole_turns(case, inside, point):
    """Rows of the end of a held point that make whole electrical turns."""
    first, last = case.plan.held[point]
    turn = 2 * np.pi / abs(inside["omega_e"][last - 1]) / case.drive.period
    count = max(1, int((last - first) * 0.6 / turn))
    return slice(last - int(round(count * turn)), last)


def test_it_shares_no_code_with_tool_plant_or_other_generators():
    imported = set()
    for path in sorted((Path(ROOT) / "studies/blind/sealed").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            imported |= set(names + ([node.module] if isinstance(node, ast.ImportFrom) else []))
    rooms = ("fluxproof", "golden_model", "studies")
    own = {n for n in imported if n.split(".")[0] in rooms and not n.startswith("studies.blind.sealed")}
    assert own == {"fluxproof.files"}


@pytest.mark.slow
@pytest.mark.parametrize("kind, faults", [("surface", ()), ("interior", IRON), ("reluctance", ("resistance",))])
def test_mean_voltages_obey_the_stator_equation(kind, faults):
    """u = R i + j omega psi over whole turns, within a thousandth; without saturation psi is the linear one."""
    case = _case(kind, faults)
    _, inside, _ = cases.simulate(case, 1, 1)
    m = case.real.machine
    for point in range(3):
        rows = _whole_turns(case, inside, point)
        u, i, psi = (np.mean(inside[f"{x}_d"][rows]) + 1j * np.mean(inside[f"{x}_q"][rows]) for x in ("u", "i", "psi"))
        omega = inside["omega_e"][rows].mean()
        assert abs(u - m.r * i - 1j * omega * psi) < 1e-3 * abs(u) and abs(m.r * i) > 2e-3 * abs(u)
        if not faults:
            assert abs(psi - m.psi - m.l_d * i.real - 1j * m.l_q * i.imag) < 1e-3 * abs(psi)


@pytest.mark.parametrize("kind", sorted(KINDS))
@pytest.mark.slow
def test_energy_is_kept(kind):
    """Between two equal states, what enters the terminals is heat and shaft work, with all physics of the machine."""
    faults = (*IRON, "iron_loss", "phase_resistance_asymmetry")
    case = _case(kind, faults, ("slotted_saturation", "eccentric_rotor"))
    assert magnetics.convex(case.real.machine, 1.2 * case.drive.current)
    _, inside, _ = cases.simulate(case, 2, 1)
    first, last = case.plan.held[0][1] - 1, case.plan.held[2][1] - 1
    given = {k: inside[k][last] - inside[k][first] for k in inside if k.startswith("e_")}
    turnover = np.abs(np.diff(inside["e_shaft"][first:last])).sum() + given["e_copper"]
    assert given["e_copper"] > 0.0 and given["e_iron"] > 0.0
    left = given["e_in"] - given["e_copper"] - given["e_shaft"] - given["e_iron"]
    assert abs(left) < 1.5e-3 * turnover  # the two states differ by a little field energy
    assert given["e_bus"] == pytest.approx(given["e_in"], abs=1e-6 * turnover)  # lossless switches


def test_torque_and_flux_come_from_one_co_energy():
    """d(dW'/dtheta)/di = dpsi/dtheta, and the slopes of the flux are those of the flux."""
    case = _case("interior", IRON, ("slotted_saturation", "eccentric_rotor"))
    m, i_r = case.real.machine, case.drive.current
    rng = np.random.default_rng(3)

    def flux(d, q, theta):
        return np.array(magnetics.fluxes(m, m.psi, d, q, theta, magnetics.turning(m, theta)[0])[:2])

    def pull(d, q, theta):
        psi = flux(d, q, theta)
        cross = psi[0] * q - psi[1] * d
        return magnetics.torque(m, m.psi, complex(*psi), complex(d, q), theta) / 1.5 / m.pole_pairs - cross

    for d, q, theta in rng.uniform(-1.0, 1.0, (20, 3)) * (i_r, i_r, 3.0):
        h, g = 1e-5 * i_r, 1e-5
        turned = (flux(d, q, theta + g) - flux(d, q, theta - g)) / (2 * g)
        found = [pull(d + h, q, theta) - pull(d - h, q, theta), pull(d, q + h, theta) - pull(d, q - h, theta)]
        assert np.allclose(np.array(found) / (2 * h), turned, rtol=1e-4, atol=1e-6 * m.psi)
        _, _, dd, dq, qq = magnetics.fluxes(m, m.psi, d, q, theta, 0j)
        by_d = (flux(d + h, q, theta) - flux(d - h, q, theta)) / (2 * h)
        by_q = (flux(d, q + h, theta) - flux(d, q - h, theta)) / (2 * h)
        assert np.allclose((dd, dq, dq, qq), (*by_d, *by_q), rtol=1e-5, atol=1e-7 * m.l_d)
        back = magnetics.currents(m, m.psi, complex(*flux(d, q, theta)), theta, 0j)
        assert abs(back - complex(d, q)) < 1e-6 * i_r


def _leg_mean(v, duty, i, u=100.0):
    """Mean voltage of a leg over the second of two equal periods at a constant current."""
    up, down, times = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(v.steps + 40)
    duties, node = np.full(3, duty), 0.0
    inverter.pulses(v, duties, duties, -v.period, up[0], down[0])
    inverter.pulses(v, duties, duties, 0.0, up[1], down[1])
    count = inverter.instants(v, up, down, 0.0, times)
    assert np.max(np.diff(times[:count])) <= v.period / 20 * (1 + 1e-9) and times[0] == 0.0
    for _ in range(2):
        total = 0.0
        for a, b in zip(times[: count - 1], times[1:count], strict=True):
            if b - a > 1e-13:
                state = inverter.state(0.5 * (a + b), up, down, v.dead, 0)
                mean, node = inverter.leg(v, state, node, u, i, b - a)
                total += (b - a) * (mean - inverter.drop(v, i))
    return total / v.period


def test_dead_time_costs_its_share_of_the_bus_in_the_direction_of_the_current():
    v = params.Inverter(1e-4, 100.0, 0.1, 1e-3, dead=2e-6, c_leg=1e-9, i_rated=10.0)
    ideal = v._replace(dead=0.0)
    assert _leg_mean(ideal, 0.7, 5.0) == pytest.approx(70.0, abs=1e-9)
    assert _leg_mean(v, 0.7, 5.0) == pytest.approx(68.0, abs=0.1)
    assert _leg_mean(v, 0.7, -5.0) == pytest.approx(72.0, abs=0.1)
    assert _leg_mean(v, 0.7, 0.0) == pytest.approx(70.0, abs=0.1)
    tail = 0.5 * 100.0 * (1e-9 * 100.0 / 0.1) / 1e-4  # the leg falls with 0.1 A through half the dead time
    assert _leg_mean(v, 0.7, 0.1) == pytest.approx(68.0 + tail, abs=0.02)
    drops = ideal._replace(v_on=1.2, i_on=0.1)
    assert _leg_mean(drops, 0.7, 10.0) == pytest.approx(68.8, abs=1e-6)
    assert _leg_mean(drops, 0.7, -10.0) == pytest.approx(71.2, abs=1e-6)


@pytest.mark.parametrize("free", [False, True])
def test_currents_and_speed_follow_and_codes_are_in_range(free):
    case = _case("interior", free=free, bits=12)
    columns, inside, kept = cases.simulate(case, 4, 1)
    assert record.sound(columns, case.drive, case.plan)
    s, d = case.real.sensors, case.drive
    i = np.stack([kept[f"i_{x}"] for x in "abc"], axis=1)
    seen = 2 / 3 * i @ TURNS * np.exp(-1j * kept["theta_e"])
    wanted = columns["i_d_ref"] + 1j * columns["i_q_ref"]
    for point, (_, last) in enumerate(case.plan.held):
        rows = _whole_turns(case, inside, point)
        assert abs(np.mean(seen[rows] - wanted[rows])) < 5e-3 * d.current
        assert abs(columns["omega_e"][last - 1] / case.plan.goal[last - 1] - 1.0) < 0.05
    assert np.allclose(i / s.lsb, np.round(i / s.lsb), atol=1e-6) and np.abs(i).max() <= s.range_a + s.lsb
    assert np.all((kept["theta_e"] >= -np.pi) & (kept["theta_e"] <= np.pi))
    code = kept["theta_e"] / s.angle_lsb  # pole pairs times the encoder's code
    assert np.allclose(code, np.round(code), atol=1e-4) and np.abs(code).max() <= np.pi / s.angle_lsb + 1e-4
    duties = np.stack([kept[f"d_{x}"] for x in "abc"]) * case.control.ticks
    assert np.allclose(duties, np.round(duties), atol=1e-6)
    assert duties.min() >= 0.02 * case.control.ticks and duties.max() <= 0.98 * case.control.ticks
    assert np.allclose(np.diff(kept["t"]), d.period)


def test_finer_steps_give_the_same_currents():
    case = _short(_case("reluctance", (*IRON, "dead_time", "iron_loss")), 600)
    one = cases.simulate(case, 5, 1)[1]
    case.real.set("inverter", steps=80)
    other = cases.simulate(case, 5, 1)[1]
    for name in ("i_d", "i_q"):
        assert np.abs(one[name] - other[name]).max() < 5e-3 * case.drive.current


@pytest.mark.parametrize("steps", [1, 7])
def test_the_filter_delays_a_ramp_by_its_time_constant(steps):
    """However long the steps are: the converters that sample later by as much see the current itself."""
    tau, slope = 1e-6, np.array([3e5, -1e5, -2e5])
    seen, ends = -tau * slope, np.linspace(0.0, 12 * tau, steps + 1)
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        sensors.anti_alias(tau, end - begin, begin * slope, end * slope, seen)
    assert seen == pytest.approx((ends[-1] - tau) * slope, rel=1e-12)


def test_every_fault_and_unknown_is_drawn():
    assert {cases.make(3, n, "single", n).effects[0]["name"] for n in range(22)} == set(FAULTS)
    assert {cases.make(3, n, "unknown", n).kind for n in range(9)} == set(UNKNOWN)
    for n in range(12):
        case = cases.make(3, n, "triple", n)
        names = {e["name"] for e in case.effects}
        assert len(names) == 3 and not any(clash <= names for clash in cases.CLASHES)
        case = cases.make(3, n, "ambiguous", n)
        assert case.rivals and case.effects[0]["name"] not in sum(case.rivals, [])


@pytest.mark.parametrize("table, name", [(FAULTS, n) for n in FAULTS] + [(UNKNOWN, n) for n in UNKNOWN])
def test_each_fault_is_in_the_recording(table, name):
    """The same noise with and without the fault gives another recording, by several times the noise."""
    case = _short(_case("interior"))
    without = cases.simulate(case, 6, 1)[0]
    table[name](case.real, case.drive, np.random.default_rng(1), 1.0)
    columns = cases.simulate(case, 6, 1)[0]
    scales = {"u_dc": case.drive.bus, "torque": case.drive.rated_torque, "temp_winding": 1e3}
    scales |= {f"i_{x}": case.drive.current for x in "abc"} | {f"d_{x}": 1.0 for x in "abc"}
    change = {k: np.sqrt(np.mean((columns[k] - without[k]) ** 2)) / x for k, x in scales.items()}
    assert max(change.values()) > 1e-3, change


def test_a_seed_gives_the_same_recording_and_another_does_not():
    def columns(seed):
        return cases.simulate(_short(cases.make(seed, 4, "pair", 1)), seed, 4)[2]

    one, same, other = columns(5), columns(5), columns(6)
    assert all(np.array_equal(one[name], same[name]) for name in one)
    assert not np.array_equal(one["i_a"][:100], other["i_a"][:100])


def test_a_case_is_written_with_its_truth(tmp_path):
    entry = write_case(("sealed", 1, 7, "single", 3, tmp_path), generate.write_recording)
    path = tmp_path / entry["case"] / entry["recording"]
    frame = pd.read_csv(path) if path.suffix == ".csv" else pd.read_parquet(path)
    assert len(frame) == entry["rows"] and np.isfinite(frame.to_numpy()).all()
    assert {"t", "i_a", "i_b", "i_c", "theta_e", "omega_e", "u_dc", "d_a", "d_b", "d_c"} <= set(frame.columns)
    assert (path.parent / "drive.toml").read_text().startswith("[machine]")
    assert entry["identifiable"]["all"] and len(entry["effects"]) == 1
    assert generate.strata_of("sealed") == cases.STRATA and sum(cases.STRATA.values()) == pytest.approx(1.0)


def test_the_command_runs_before_the_own_generator_ever_has(tmp_path, monkeypatch):
    monkeypatch.setattr(blind, "FOLDER", tmp_path)
    monkeypatch.setattr(blind, "generate", lambda *a, **k: "digest")
    monkeypatch.setattr(blind, "score", lambda folder, jobs: dict.fromkeys(blind.KEPT, {}))
    assert blind.main(["--generator", "sealed", "--count", "1"]) == 0
    assert '"sealed"' in (tmp_path / "result.json").read_text()


@pytest.mark.parametrize("turn", [0, 1])
def test_an_ambiguous_recording_holds_one_current_only(turn):
    """Nothing of the start, in which the current still rises, is in it."""
    case = cases.make(5, 2, "ambiguous", turn)
    columns, _, kept = cases.simulate(case, 5, 2)
    assert record.sound(columns, case.drive, case.plan)
    seen = 2 / 3 * np.stack([kept[f"i_{x}"] for x in "abc"], axis=1) @ TURNS * np.exp(-1j * kept["theta_e"])
    slow = np.convolve(seen, np.full(50, 0.02), "valid")
    assert np.abs(slow - case.plan.i_ref[0]).max() < 0.12 * case.drive.current
    assert np.abs(slow[:200].mean() - slow[-200:].mean()) < 0.01 * case.drive.current
