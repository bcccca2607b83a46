# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof simulate` above base speed: curves of torque over speed, what a trip leaves to the bus."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from fluxproof.diagnosis.report import theme
from fluxproof.simulate import scene, verdict
from fluxproof.simulate.pictures import circles
from fluxproof.simulate.speed_range import speed_range
from fluxproof.simulate.trip import beyond, of_trip, top_speed, trip, unjudged
from golden_model.drive import load
from golden_model.registers import registers

SPINDLE = load(DRIVES / "spindle_400v.toml")
SET = registers(SPINDLE)
FAST = 2.4 * SPINDLE.machine.rated_speed_rad_s


def replaced(drive=SPINDLE, **sections):
    """The drive with other values in some sections."""
    changed = {name: dataclasses.replace(getattr(drive, name), **values) for name, values in sections.items()}
    return dataclasses.replace(drive, **changed)


def at_top(drive, speed=FAST):
    """The trip of a drive whose overspeed is at ``speed`` [rad/s]."""
    rows = [row._replace(represented=speed * 4) if row.name == "omega_trip" else row for row in SET.rows]
    return trip(drive, SET._replace(rows=tuple(rows)))


def test_torque_over_speed_is_that_of_the_equations():
    drive = replaced(machine={"resistance_ohm": 1e-6})
    m, found = drive.machine, speed_range(drive, FAST)
    assert found.with_table.max() == pytest.approx(1.5 * 4 * m.magnet_flux_wb * drive.current_limit_a, rel=2e-3)
    flux = scene.voltage_limit(drive) / 4 / found.speed[1:]
    i_d = (flux**2 - m.magnet_flux_wb**2 - (m.inductance_d_h * drive.current_limit_a) ** 2) / (
        2.0 * m.magnet_flux_wb * m.inductance_d_h
    )  # where both circles meet
    i_q = np.sqrt(np.maximum(drive.current_limit_a**2 - np.minimum(i_d, 0.0) ** 2, 0.0))
    wanted = 1.5 * 4 * m.magnet_flux_wb * i_q
    assert found.with_table[1:] == pytest.approx(wanted, rel=0.02, abs=0.02 * wanted.max())
    alone = np.sqrt(np.maximum(flux**2 - m.magnet_flux_wb**2, 0.0)) / m.inductance_q_h
    wanted = 1.5 * 4 * m.magnet_flux_wb * np.minimum(alone, drive.current_limit_a)
    assert found.without[1:] == pytest.approx(wanted, rel=0.02, abs=0.02 * wanted.max())
    assert found.reach(found.without) == pytest.approx(scene.reach(drive, 0.0), abs=2.0 * found.speed[1])
    assert found.reach(found.with_table) == FAST
    assert np.hypot(*found.points.T).max() <= drive.current_limit_a * (1.0 + 1e-9)


def test_the_title_of_the_circles_is_beside_their_key(monkeypatch):
    """Equal scales make these axes narrow: title and key had shared a line."""
    drawn = []
    monkeypatch.setattr(theme, "picture", lambda _name, figure, _caption: drawn.append(figure))
    circles(SPINDLE, speed_range(SPINDLE, FAST))
    (figure,) = drawn
    figure.draw_without_rendering()
    (axis,) = figure.axes
    title, boxes = axis.title.get_window_extent(), [text.get_window_extent() for text in axis.texts]
    assert len(boxes) == 2 and not any(title.overlaps(box) for box in boxes)


def test_a_trip_above_base_speed_charges_the_capacitor():
    """Behind a diode to the rectified EMF or a little beyond, with a resistor less, not at all on an ideal source."""
    emf = math.sqrt(3.0) * 4 * 0.99 * FAST * SPINDLE.machine.magnet_flux_wb
    alone = replaced(protection={"brake_on_v": None})
    found = at_top(alone)
    assert found.emf_v == pytest.approx(emf)
    assert 0.9 * emf < found.bus_v < 1.3 * emf
    braked = at_top(SPINDLE)
    assert SPINDLE.inverter.dc_bus_v < braked.bus_v < 0.9 * found.bus_v and braked.braking_nm > 0.0
    assert at_top(replaced(alone, supply={"source": "ideal"})).bus_v == pytest.approx(540.0)
    below = at_top(SPINDLE, 0.5 * FAST)
    assert below.emf_v < 540.0 and below.bus_v == 540.0


def test_ratings_judge_it():
    found = at_top(SPINDLE)
    rated = replaced(supply={"capacitor_rated_v": found.bus_v + 1.0}, inverter={"switch_rated_v": 1200.0})
    assert not beyond(rated, found, 540.0) and not unjudged(rated, found)
    assert "capacitor_rated_v" in beyond(rated, found, found.bus_v + 2.0)
    low = replaced(rated, inverter={"switch_rated_v": found.bus_v - 1.0})
    reason = beyond(low, found, 540.0)
    assert "switch_rated_v" in reason and verdict.judge(low, {}, [], reason) == ("overvoltage", reason)
    assert "would judge it" in unjudged(SPINDLE, found) and not beyond(SPINDLE, found, 5000.0)
    assert of_trip(rated, found, 700.0)["switch_rated_v"]["value"] == 1200.0
    assert top_speed(SET, SPINDLE) == pytest.approx(1.2 * SPINDLE.machine.rated_speed_rad_s, rel=0.01)


def test_a_step_of_the_current_is_one_with_the_torque_table_too():
    """i_q_ext is a torque with the table: the step leaves it out, a stage's torque is that of its current."""
    drive = replaced(core={"references": True})
    step, plain = scene.current_step(drive), scene.current_step(SPINDLE)
    assert np.array_equal(step.scenario.i_q_ext, plain.scenario.i_q_ext) and step.scenario.changes[0] == {
        "use_table": 0
    }
    torque = scene.torque_code(drive, 10.0) * drive.torque_base_nm / 65536.0
    assert torque == pytest.approx(10.0 * scene.torque_per_a(drive), rel=1e-3)
