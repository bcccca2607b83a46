# SPDX-License-Identifier: BSD-3-Clause
"""Above base speed: the torque table, what it promises, and the core that follows it."""

import dataclasses
import json
import math

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from fluxproof.cosim.golden_loop import simulate
from fluxproof.plant import IMPOSED_SPEED
from fluxproof.print_registers import c_lines, load_list
from golden_model import drive as drives
from golden_model import torque_table
from golden_model.control import current_limit, current_reference, reference_table, voltage_limit
from golden_model.control.reference_table import BLANK, COLUMNS, ROWS, WORDS
from golden_model.formats import PU
from golden_model.registers import registers
from golden_model.units import to_si
from studies.speed import figures
from studies.speed.drives import over_the_border, scene, weakened

DRIVE = weakened(DRIVES / "paper001.toml")
SET = registers(DRIVE)


@pytest.mark.parametrize("l_d, l_q, psi", [(20e-3, 20e-3, 0.165), (10e-3, 40e-3, 0.06), (10e-3, 60e-3, 0.0)])
def test_table_has_the_least_current_within_both_circles(l_d, l_q, psi):
    """Surface, interior and reluctance machine: each point gives its torque, no point of a grid gives it cheaper."""
    machine = dataclasses.replace(DRIVE.machine, inductance_d_h=l_d, inductance_q_h=l_q, magnet_flux_wb=psi)
    flux, i_max = torque_table.linear(machine), 5.0
    table = torque_table.build(flux, machine.pole_pairs, i_max)
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(-i_max, i_max, 301), np.linspace(0.0, i_max, 151)))
    d, q = flux(x, y)
    inside = np.hypot(x, y) <= i_max
    torques, fluxes = 1.5 * machine.pole_pairs * (d * y - q * x), np.hypot(d, q)
    for row in (24, ROWS - 1):
        for column in range(4, COLUMNS - 1, 8):
            i_d, i_q = table.i_d_a[row, column], table.i_q_a[row, column]
            wanted = column / (COLUMNS - 1) * table.top_nm[row]
            if wanted <= 0.0:
                continue
            d, q = flux(i_d, i_q)
            assert 1.5 * machine.pole_pairs * (d * i_q - q * i_d) == pytest.approx(wanted, rel=5e-3)
            assert np.hypot(d, q) <= table.flux_wb[row] * 1.005 and np.hypot(i_d, i_q) <= i_max * 1.001
            cheaper = inside & (torques >= wanted) & (fluxes <= table.flux_wb[row] * 0.995)
            cheaper &= np.hypot(x, y) < 0.985 * np.hypot(i_d, i_q)
            assert not cheaper.any(), (row, column)


def test_references_of_any_table_stay_in_the_current_circle():
    """Random words, torques, speeds: references are within i_max, and i_q has the torque's sign."""
    rng, i_max = np.random.default_rng(3), 30000
    table = rng.integers(PU.lo, PU.hi + 1, BLANK.shape)
    circle, late = current_limit.State(), current_reference.State()
    i_d_table = i_q_table = sign = before = 0
    for _ in range(3000):
        circle, (i_d, i_q_max) = current_limit.step(circle, i_d_table, i_max)
        late, (i_q,) = current_reference.step(late, i_q_table, i_q_max, 1)
        assert i_d**2 + i_q**2 <= i_max**2
        assert i_q * before >= 0
        before = sign
        torque = int(rng.integers(-100000, 100000))
        x = reference_table.Inputs(int(rng.integers(0, 65536)), torque, int(rng.integers(1 << 15, 3 << 15)))
        i_d_table, i_q_table, _, _ = reference_table.step_table(x, table)
        sign = 1 if torque >= 0 else -1


def run(torque_nm, times, seconds=0.4, **changes):
    """Paper 001's motor at a multiple of its rated speed: (result, mean torque of the last quarter [Nm])."""
    chosen = SET._replace(values=SET.values._replace(**changes))
    n = round(seconds / DRIVE.sample_time_s)
    speed = np.minimum(np.linspace(0.3, 1.7, n), 1.0) * times * DRIVE.machine.rated_speed_rad_s
    scenario = scene(DRIVE, np.full(n, torque_nm), speed)
    result = simulate(DRIVE, chosen, scenario, dead_time_s=DRIVE.inverter.dead_time_s, mode=IMPOSED_SPEED)
    return result, float(result.plant["torque"][-n // 4 :].mean())


@pytest.mark.parametrize("torque_nm, times", [(2.0, 0.5), (-2.0, 0.5), (2.0, 2.0), (-2.0, 2.0)])
def test_torque_is_the_one_asked_for(torque_nm, times):
    """Newton metres of both signs below and above base speed, within 2 % of the rated 3.9 Nm."""
    _, torque = run(torque_nm, times)
    assert torque == pytest.approx(torque_nm, abs=0.08)


def test_above_base_speed_there_is_torque_within_the_circle_and_it_is_released():
    """2.5 times the rated speed: what the table promises; i_d is back at zero when the drive is slow again."""
    result, torque = run(20.0, 2.5)
    assert torque > 0.97 * to_si("torque", result.state.torque_max, DRIVE) > 1.0
    u = np.hypot(result.observed["u_d"], result.observed["u_q"])
    assert (u <= result.observed["u_max"] + 1).all() and not result.observed["sample_trip"].any()
    n = 4000
    speed = DRIVE.machine.rated_speed_rad_s * np.concatenate(
        [np.linspace(0.3, 2.5, n // 2), np.linspace(2.5, 0.3, n // 2)]
    )
    slow = simulate(DRIVE, SET, scene(DRIVE, np.full(n, 1.0), speed), mode=IMPOSED_SPEED)
    assert slow.plant["i_d"].min() < -3.0 and abs(slow.plant["i_d"][-200:].mean()) < 0.1


def test_weakened_too_far_the_d_axis_has_the_whole_circle():
    """The q axis' EMF has its voltage before u_d, unless lambda_d < 0 and u_d is at its upper end: i_d ran away."""
    u_max, emf = 40000, 30000
    beside = math.isqrt(u_max**2 - emf**2)
    for lambda_d, asked, room in ((1, 60000, beside), (-1, 0, beside), (-1, -60000, beside), (-1, 60000, u_max)):
        state, _ = voltage_limit.step(voltage_limit.State(), asked, 0, 0, emf, 0, 0, u_max, lambda_d)
        _, (u_d, *_) = voltage_limit.step(state, 60000, 0, 0, emf, 0, 0, u_max, lambda_d)
        assert u_d == pytest.approx(room, abs=3)


@pytest.mark.slow
def test_demands_beyond_what_exists_while_the_bus_moves():
    """A reluctance machine whose q axis kept its EMF's voltage with lambda_d < 0 ran away to 2.9 of its limit."""
    case = figures.cases()[1]
    plane = torque_table.Plane(case.truth, case.drive.machine.pole_pairs, case.drive.current_limit_a)
    trips, peak, *_ = figures.hostile(case, plane, 1e-3)
    assert trips["ours"] == 0 and peak["ours"] < 1.6


def test_estimate_is_right_from_the_start():
    """The leg loss of the drive file: torque within 3 % from 50 ms on, and flux_faults bit 5 stays clear."""
    first = round(0.05 / DRIVE.sample_time_s)

    def worst(**changes):
        result, _ = run(2.5, 0.3, 0.3, **changes)
        estimate = to_si("torque", result.observed["torque"], DRIVE)
        off = np.abs(estimate - result.plant["torque"])[first:].max() / 2.5
        return off, ((result.observed["flux_faults"] >> 5) & 1).mean()

    off, flagged = worst()
    assert off < 0.03 and flagged == 0.0
    assert worst(v_start=0)[0] > 0.03


def test_without_the_table_every_bit_is_as_before():
    """REFERENCES = 1 with use_table = 0 gives the same outputs as REFERENCES = 0."""
    off = SET._replace(values=SET.values._replace(use_table=0))
    plain = off._replace(config=off.config._replace(references=0))
    n = 400
    scenario = scene(DRIVE, np.full(n, 1.0), np.full(n, 50.0))
    one, other = (simulate(DRIVE, s, scenario, mode=IMPOSED_SPEED).observed for s in (off, plain))
    assert all(np.array_equal(one[name], other[name]) for name in one)


def test_registers_command_writes_the_table(tmp_path):
    """The C header and the JSON list hold the words that load the RAM."""
    loads = [w["value"] for w in load_list(SET) if w["name"] == "table_word"]
    ram = np.zeros_like(BLANK)
    for word in loads:
        if word & reference_table.WRITE:
            value = word & 0x3FFFF
            axis, address = (word >> 29) & 1, (word >> 18) & 0x7FF
            ram[axis, address] = value - (1 << 18) * (value >> 17)
    assert np.array_equal(ram, SET.table) and SET.table.reshape(2, ROWS, WORDS)[0, -1, COLUMNS] > 0
    text = "\n".join(c_lines("d.toml", DRIVE, SET))
    assert "#define FLUXPROOF_REFERENCES 1" in text and f"0x{loads[5]:08X}" in text
    plain = drives.load(DRIVES / "paper001.toml")
    assert "torque_table" not in "\n".join(c_lines("d.toml", plain, registers(plain)))
    assert json.dumps(load_list(registers(plain)))


@pytest.mark.slow
def test_rtl_over_the_border():
    """The RTL in Verilator equals the golden core over base speed, bus sag and stop."""
    from fluxproof.cosim.runs import InVerilator, Named

    job = InVerilator("test_over_the_border", Named("studies.speed.drives:over_the_border", (128, 600)))
    job.carry_out()
    assert job.problem is None and job.summary()["periods_compared"] == len(over_the_border(128, 600))
