# SPDX-License-Identifier: BSD-3-Clause
"""The blind benchmark: its simulator satisfies flux balance and energy conservation, its seal detects changes."""

from __future__ import annotations

import json
import zlib

import numpy as np
import pytest

from cocotb_tests.support.drives import BUS, L_D, PAIRS, PSI, R
from studies.blind import cases, damage, forms, generate, identifiable, params, plans, unknown
from studies.blind.again import further_recording, requested_plan
from studies.blind.build import Build, fresh
from studies.blind.design import LINES, Design
from studies.blind.machines import random_nominal
from studies.blind.magnetics import current, flux
from studies.blind.seal import SealError, seal, truth_path, unseal
from studies.blind.simulator import simulate

MACHINE = {
    "pole_pairs": PAIRS,
    "resistance_ohm": R,
    "inductance_d_h": L_D,
    "inductance_q_h": 0.0181,
    "magnet_flux_wb": PSI,
}
T = 1e-4


def _drive(**motor):
    w = 2.0 * np.pi * 400.0
    gains = (w * 0.016, w * 1.53, w * 0.018, w * 1.53)
    control = params.Control(*gains, 0.01607, 0.0181, 0.165, 1.0, 1, 0.95, 0.03, 2e-4, 0, 0.0, 0.0, 5.0)
    drive = params.ideal(MACHINE, 0.0016, control, T)
    return drive._replace(motor=drive.motor._replace(**motor))


def _course(n, omega=100.0, i_d=-1.0, i_q=3.0):
    one = np.ones(n + 1)
    return params.Course(
        BUS * one,
        0 * one,
        omega * one,
        0 * one,
        np.ones((3, n + 1)),
        one,
        np.zeros((3, n + 1)),
        0 * one,
        np.full(n, i_d),
        np.where(np.arange(n) // 300 % 2, i_q, -i_q).astype(float),
    )


def _run(drive, n=1500, substeps=1, **course):
    return simulate(drive, _course(n, **course), np.random.default_rng(0), substeps=substeps, trace=True)


def _misfit(trace, resistance):
    """Flux balance of every period [V], from true currents and the nominal flux, stator frame."""
    i, turn = trace["i_alpha"] + 1j * trace["i_beta"], np.exp(1j * trace["theta_true"])
    z = i / turn
    psi = turn * (MACHINE["inductance_d_h"] * z.real + 0.165 + 1j * MACHINE["inductance_q_h"] * z.imag)
    u = trace["u_mean_alpha"] + 1j * trace["u_mean_beta"]
    return (u - resistance * (trace["i_mean_alpha"] + 1j * trace["i_mean_beta"]))[:-1] - np.diff(psi) / T


def test_flux_balance_holds_and_notices_a_wrong_resistance():
    _, trace = _run(_drive())
    assert np.abs(_misfit(trace, 1.53)).max() < 1e-9
    assert np.abs(_misfit(trace, 1.54)).max() > 0.01


def test_duties_are_in_force_one_period_later():
    columns, trace = _run(_drive())
    a, b, c = (columns[k] for k in ("d_a", "d_b", "d_c"))
    u = BUS * ((2 * a - b - c) / 3.0 + 1j * (b - c) / np.sqrt(3.0))
    applied = trace["u_mean_alpha"] + 1j * trace["u_mean_beta"]
    assert np.abs(u[:-1] - applied[1:]).max() < 1e-9
    assert np.abs(u - applied).max() > 1.0


def test_energy_is_kept():
    _, trace = _run(_drive(r_a=1e-12, r_b=1e-12, r_c=1e-12))
    z = (trace["i_alpha"] + 1j * trace["i_beta"]) * np.exp(-1j * trace["theta_true"])
    stored = 0.75 * (MACHINE["inductance_d_h"] * z.real**2 + MACHINE["inductance_q_h"] * z.imag**2)
    given, taken = trace["work_in"][:-1].sum(), trace["work_out"][:-1].sum()
    assert given - taken == pytest.approx(stored[-1] - stored[0], abs=1e-4 * np.abs(trace["work_in"]).sum())
    assert abs(given) > 100.0 * abs(given - taken - stored[-1] + stored[0])


def test_halving_the_step_changes_nothing_visible():
    bridge = _drive().bridge._replace(dead_s=2e-6, i_zone=0.05)
    drive = _drive(self_q=params.SELF_TANH, sat_q=8.0, cross=params.CROSS_LEVELLING, c_x=1e-5, i_x=5.0)
    drive = drive._replace(bridge=bridge)
    coarse, fine = _run(drive)[0], _run(drive, substeps=2)[0]
    assert np.abs(coarse["i_a"] - fine["i_a"]).max() < 3e-3  # of 3 A; the duties' steps make 1 mA of it
    assert np.abs(coarse["i_a"] - fine["i_a"]).max() > 0.0


def test_dead_time_takes_its_voltage():
    drive = _drive()
    drive = drive._replace(bridge=drive.bridge._replace(dead_s=2e-6, i_zone=0.02))
    columns, trace = _run(drive, omega=2.0, i_d=0.0)
    a, b, c = (columns[k][:-1] for k in ("d_a", "d_b", "d_c"))
    lost = BUS * ((2 * a - b - c) / 3.0 + 1j * (b - c) / np.sqrt(3.0))
    lost = lost - (trace["u_mean_alpha"] + 1j * trace["u_mean_beta"])[1:]
    legs = np.sign(np.stack([columns[k][1:] for k in ("i_a", "i_b", "i_c")]))
    wanted = BUS * 2e-6 / T * ((2 * legs[0] - legs[1] - legs[2]) / 3.0 + 1j * (legs[1] - legs[2]) / np.sqrt(3.0))
    clear = np.min(np.abs([columns[k][1:] for k in ("i_a", "i_b", "i_c")]), axis=0) > 0.4
    assert np.median(np.abs(lost - wanted)[clear]) < 0.02 * np.median(np.abs(wanted[clear]))


@pytest.mark.parametrize("cross", range(5))
@pytest.mark.parametrize("kind", range(7))
def test_flux_is_reciprocal_and_inverts(kind, cross):
    m = _drive(
        self_d=kind,
        self_q=kind if kind != params.SELF_SHIFTED else params.SELF_TANH,
        shift_d=3.0,
        sat_d=0.004 if kind == params.SELF_CUBIC else 9.0,
        sat_q=0.004 if kind == params.SELF_CUBIC else 9.0,
        cross=cross,
        c_x=1e-4,
        i_x=4.0,
    ).motor
    h = 1e-4
    for i_d, i_q in ((-3.0, 4.0), (1.0, -5.0), (-0.5, 0.2)):
        psi_d, psi_q, dd, dq, qq = flux(m, i_d, i_q)
        by_d = [(x - y) / (2 * h) for x, y in zip(flux(m, i_d + h, i_q)[:2], flux(m, i_d - h, i_q)[:2], strict=True)]
        by_q = [(x - y) / (2 * h) for x, y in zip(flux(m, i_d, i_q + h)[:2], flux(m, i_d, i_q - h)[:2], strict=True)]
        assert (by_d[0], by_q[0], by_d[1], by_q[1]) == pytest.approx((dd, dq, dq, qq), abs=1e-8)
        assert current(m, psi_d, psi_q, 0.0, 0.0) == pytest.approx((i_d, i_q), abs=1e-7)


def _misfit_of(effect, size=0.5):
    """Mean misfit and +-2 lines of each segment, simulated without noise, and the prediction of design.py [V]."""
    rng = np.random.default_rng(4)
    n = random_nominal(rng)
    plan = plans.grid_plan(rng, n)
    plan.segments, plan.ripple = (
        [s for s in plan.segments if abs(s[0]) > 0.25 * n.omega_rated][:12],
        (0.0, 300.0, 0.0),
    )
    b = fresh(rng, n, plan, True)
    if effect:
        forms.apply(effect, b, np.random.default_rng(7), size, forms.CATALOGUE)
    b.change(
        "sensor",
        noise_a=0.0,
        lsb_a=0.0,
        theta_noise=0.0,
        theta_lsb=0.0,
        u_noise=0.0,
        u_lsb=0.0,
        omega_exact=1,
    )
    b.change("control", duty_lsb=1e-9)
    c, _ = b.record(np.random.default_rng(1))
    m, period = n.machine, n.period_s

    def clarke(x):
        return (2 * c[x + "a"] - c[x + "b"] - c[x + "c"]) / 3.0 + 1j * (c[x + "b"] - c[x + "c"]) / np.sqrt(3.0)

    i, turn = clarke("i_"), np.exp(1j * c["theta_e"])
    z = i / turn
    psi = turn * (m["inductance_d_h"] * z.real + m["magnet_flux_wb"] + 1j * m["inductance_q_h"] * z.imag)
    u = clarke("d_")[:-2] * 0.5 * (c["u_dc"][1:-1] + c["u_dc"][2:])
    r = u - m["resistance_ohm"] * 0.5 * (i[1:-1] + i[2:]) - np.diff(psi)[1:] / period
    theta = c["theta_e"][1:-1] + 0.5 * c["omega_e"][1:-1] * period
    r = r * np.exp(-1j * theta)
    design = Design(cases.Case(1, "single", b))
    design.weight[:] = 1.0
    half = design.truth().reshape(2, len(LINES), -1)
    found, foreseen = [], []
    for line, order in (("mean", 0), ("-2", -2)):
        ends = np.cumsum([s[3] for s in plan.segments])
        for k, (end, s) in enumerate(zip(ends, plan.segments, strict=True)):
            part = slice(end - s[3] // 2, end - 3)
            found.append(np.mean(r[part] * np.exp(-1j * order * theta[part])))
            foreseen.append(half[0, LINES.index(line), k] + 1j * half[1, LINES.index(line), k])
    return np.array(found), np.array(foreseen), n.voltage_limit


def test_no_effect_no_misfit():
    found, foreseen, limit = _misfit_of(None)
    assert np.abs(found).max() < 3e-4 * limit and np.abs(foreseen).max() < 1e-9


@pytest.mark.parametrize(
    "effect",
    [
        "resistance",
        "magnet_flux",
        "inductance_d",
        "inductance_q",
        "saturation",
        "cross_saturation",
        "iron_loss",
        "delay",
        "encoder_offset",
        "current_gain",
        "current_scale",
        "udc_gain",
        "phase_resistance_asymmetry",
        "dead_time",
    ],
)
def test_simulated_misfit_equals_the_predicted_one(effect):
    found, foreseen, limit = _misfit_of(effect)
    assert np.abs(foreseen).max() > 2e-4 * limit
    assert np.vdot(foreseen, found).real / np.vdot(foreseen, foreseen).real == pytest.approx(1.0, abs=0.08)
    assert np.abs(found - foreseen).max() < 3e-4 * limit + 0.12 * np.abs(foreseen).max()


def test_every_effect_has_another_form():
    assert len(forms.EFFECTS) == 22 and len(unknown.KINDS) >= 8
    for name, (_, kinds) in forms.EFFECTS.items():
        assert kinds[0] == "catalogue" and len(kinds) >= 2, name


def test_strata_fill_the_count_and_numbers_say_nothing():
    entries = generate.listing(5, 300, None)
    assert [k for k, _, _ in entries] == list(range(1, 301))
    assert {s for _, s, _ in entries} == set(cases.STRATA)
    healthy = [k for k, s, _ in entries if s == "healthy"]
    assert 100 < np.mean(healthy) < 200 and np.std(healthy) > 60
    singles = {cases.make(5, k, s, t).names[0] for k, s, t in entries if s == "single"}
    assert singles == set(forms.EFFECTS)


def test_cases_are_reproducible():
    one, two = (cases.make(3, 8, "pair", 2) for _ in range(2))
    assert one.effects == two.effects and one.build.nominal == two.build.nominal
    assert cases.make(4, 8, "pair", 2).build.nominal != one.build.nominal


def test_unidentifiable_cases_are_marked():
    for turn in range(80):
        case = cases.make(1, 500 + turn, "one_point", turn)
        if case.names == ["magnet_flux"]:
            break
    judged = identifiable.judge(case)
    assert judged["all"] is False and judged["rivals"]
    grid = cases.make(1, 3, "single", 2 * sorted(forms.EFFECTS).index("magnet_flux"))
    assert grid.names == ["magnet_flux"] and identifiable.judge(grid)["all"]


def test_damage_changes_the_columns():
    rng = np.random.default_rng(0)
    nominal = random_nominal(rng)
    for name, spoil in damage.KINDS.items():
        columns = {
            k: np.sin(np.arange(3000.0) + j)
            for j, k in enumerate(("t", "i_a", "i_b", "i_c", "theta_e", "u_dc", "d_a", "d_b", "d_c"))
        }
        for k in ("i_a", "i_b", "i_c"):
            columns[k] = columns[k] * nominal.machine["rated_current_a"]
        before = {k: v.copy() for k, v in columns.items()}
        assert spoil(columns, rng, nominal), name
        assert any(len(columns[k]) != len(before[k]) or not np.array_equal(columns[k], before[k]) for k in columns), (
            name
        )


def test_request_is_limited_to_the_drive():
    case = cases.make(1, 1, "healthy", 0)
    n = case.build.nominal
    plan = requested_plan(case, {"omega_e": 1e6, "i_d": 0.0, "i_q": 1e5})
    omega, i_d, i_q, rows = plan.segments[0]
    assert n.voltage(omega, i_d, i_q) <= 0.85 * n.voltage_limit and rows > 100
    assert i_q == pytest.approx(n.machine["rated_current_a"])


def test_unreachable_point_is_approached(monkeypatch):
    """A flux map without a current for the flux leads to a request with less current."""
    case, asked = cases.make(1, 1, "healthy", 0), {"omega_e": 50.0, "i_d": 0.0, "i_q": 1e5}
    rated = case.build.nominal.machine["rated_current_a"]

    def record(self, rng, plan, x_start):
        i_q = plan.segments[0][2]
        if i_q > 0.8 * rated:
            raise ZeroDivisionError
        return {"i_q": i_q}, None

    monkeypatch.setattr(Build, "record", record)
    assert further_recording(case, asked, 1, 0, 0)["i_q"] == pytest.approx(0.7 * rated)
    monkeypatch.setattr(Build, "record", lambda *args, **more: 1 / 0)
    with pytest.raises(RuntimeError, match="does not reach"):
        further_recording(case, asked, 1, 0, 0)


def test_seal_notices_a_change(tmp_path):
    folder = tmp_path / "seed1"
    folder.mkdir()
    seal(folder, {"seed": 1, "cases": []})
    assert unseal(folder) == {"seed": 1, "cases": []}
    assert folder not in truth_path(folder).parents
    truth_path(folder).write_bytes(zlib.compress(json.dumps({"seed": 1, "cases": [1]}).encode()))
    with pytest.raises(SealError, match="changed after sealing"):
        unseal(folder)
    truth_path(folder).unlink()
    with pytest.raises(SealError, match="cannot be read"):
        unseal(folder)
