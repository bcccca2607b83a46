# SPDX-License-Identifier: BSD-3-Clause
"""Rows in which the gates are off are set aside and told; a drive without current whose control runs loses none."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import codes, dq_made, made, nominal_of, write
from fluxproof.diagnosis.loading.load import load_recording

CURRENTS, DUTIES = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c")
TRIP = 2400


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def tripped(first=TRIP, last=4000, duty=None, **more):
    """A recording whose gates are off from row ``first`` to ``last``; duty: of all legs, None: the last ones stay."""
    table, rng = made(), np.random.default_rng(3)
    for name in CURRENTS:
        table[name][first:last] = 0.01 * rng.normal(size=last - first)
    for name in DUTIES:
        table[name][first:last] = table[name][first] if duty is None else duty
    return table | more


TRIPS = {
    "duties at nought": {"duty": 0.0},
    "duties at a half": {"duty": 0.5},
    "frozen duties": {},
    "on again": {"last": 3200, "duty": 0.0},
    "before it is enabled": {"first": 0, "last": 1500, "duty": 0.5},
}


@pytest.mark.parametrize("name", TRIPS)
def test_rows_with_constant_commands_and_no_current_are_not_used(tmp_path, nominal, name):
    first, last = TRIPS[name].get("first", TRIP), TRIPS[name].get("last", 4000)
    recording = load_recording(write(tmp_path / "r.parquet", tripped(**TRIPS[name])), nominal)
    assert codes(recording) == ["gates_off"] and not recording.fatal
    assert recording.problems[0].row == first and recording.problems[0].count == last - first
    assert f"from {first * 1e-4:g}" in recording.problems[0].message
    assert not recording.usable[first:last].any()
    assert recording.usable[: max(first - 1, 0)].all() and recording.usable[last + 1 :].all()


def living(**more):
    """A recording without current from row TRIP on, whose duties go on."""
    table, rng = made(), np.random.default_rng(3)
    for name in CURRENTS:
        table[name][TRIP:] = 0.01 * rng.normal(size=4000 - TRIP)
    return table | more


@pytest.mark.parametrize("flag", [{"fault": (0.0, 17.0)}, {"fault_code": (0.0, 3.0)}, {"enable": (1.0, 0.0)}])
def test_a_recorded_flag_tells_it_where_no_current_flows(tmp_path, nominal, flag):
    (name, (on, off)), after = next(iter(flag.items())), np.arange(4000) >= TRIP
    recording = load_recording(write(tmp_path / "r.parquet", living(**{name: np.where(after, off, on)})), nominal)
    assert codes(recording) == ["gates_off"] and "flag" in recording.problems[0].message
    assert not recording.usable[TRIP:].any() and recording.usable[: TRIP - 1].all()


def test_a_flag_in_rows_with_current_is_a_warning(tmp_path, nominal):
    table = made() | {"fault": (np.arange(4000) >= TRIP).astype(float)}
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    assert codes(recording) == [] and recording.usable.all()
    assert any("fault says" in note for note in recording.meta["notes"])


def test_a_current_that_is_asked_for_and_does_not_flow(tmp_path, nominal):
    asked = {"i_q_ref": np.full(4000, 3.0)}
    recording = load_recording(write(tmp_path / "r.parquet", living(**asked)), nominal)
    assert codes(recording) == ["gates_off"] and not recording.usable[TRIP:].any()


def still(speed):
    """No current: the duties follow the EMF, at rest they are constant."""
    table = made(speed=speed, noise=0.0)
    u = 1j * table["omega_e"] * 0.165 * np.exp(1j * (table["theta_e"] + 1.5e-4 * table["omega_e"]))
    legs = (u[:, None] * np.exp(-2j * np.pi / 3 * np.arange(3))).real / 563.0 + 0.5
    rng = np.random.default_rng(4)
    table |= {name: 0.004 * rng.normal(size=4000) for name in CURRENTS}
    return table | dict(zip(DUTIES, legs.T, strict=True))


@pytest.mark.parametrize("speed", [400.0, -90.0, 0.0])
def test_a_control_that_holds_no_current_loses_no_row(tmp_path, nominal, speed):
    recording = load_recording(write(tmp_path / "r.parquet", still(speed)), nominal)
    assert "gates_off" not in codes(recording) and recording.usable.all()


def test_references_at_nought_of_a_coasting_slow_log(tmp_path, nominal):
    table = dq_made()
    after = np.arange(2000) >= 1500
    for name in ("i_d", "i_q", "u_d_ref", "u_q_ref"):
        table[name] = np.where(after, 0.0, table[name])
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    assert codes(recording) == ["slow_sampling", "gates_off"] and np.flatnonzero(~recording.usable)[0] >= 1499


def test_references_without_noise_at_constant_speed_are_kept(tmp_path, nominal):
    table = {"t": np.arange(600) * 0.05, "omega_e": np.repeat([100.0, 300.0, 500.0], 200), "i_d": np.zeros(600)}
    table |= {"i_q": np.zeros(600), "u_d_ref": np.zeros(600), "u_q_ref": 0.165 * table["omega_e"]}
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    assert "gates_off" not in codes(recording) and recording.usable.all()


def test_a_shaft_that_coasts_to_rest_after_a_trip(tmp_path, nominal):
    """It stands for most of the time without commands, which hid that it had coasted."""
    table = dq_made()
    n, at = len(table["t"]), 1200
    table["omega_e"] = np.where(np.arange(n) < at, table["omega_e"], 300.0 * np.exp(-(np.arange(n) - at) / 12.0))
    for name in ("i_d", "i_q", "u_d_ref", "u_q_ref"):
        table[name] = np.where(np.arange(n) < at, table[name], 0.0)
    recording = load_recording(write(tmp_path / "r.csv", table), nominal)
    (off,) = [p for p in recording.problems if p.code == "gates_off"]
    assert off.row == at and f"from {table['t'][at]:g} s the gates are off" in off.message
    assert not recording.usable[at:].any()
