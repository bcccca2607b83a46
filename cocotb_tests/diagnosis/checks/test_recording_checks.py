# SPDX-License-Identifier: BSD-3-Clause
"""Checks of a recording: each fault is found, named and corrected; physical effects cause no findings."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import FAST, T, codes, dq_made, made, nominal_of, write
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.checks import STAGES, checks
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.replay.telemetry import write_dump
from golden_model import drive as drives
from golden_model.fluxproof import Sample
from golden_model.io import telemetry_words
from golden_model.registers import registers


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


EFFECTS = {
    "clean": {}, "offset": {"offset": 0.25}, "gain": {"gain": (1.05, 0.96, 1.0)}, "encoder": {"encoder": 0.35},
    "udc": {"u_dc_gain": 1.1}, "noise": {"noise": 0.1}, "slow": {"speed": 40.0}, "reverse": {"speed": -400.0},
    "standstill": {"speed": 0.0}, "fast": {"speed": 1200.0},
}  # fmt: skip


@pytest.mark.parametrize("effect", EFFECTS)
def test_physical_effects_are_no_findings(tmp_path, nominal, effect):
    recording = load_recording(write(tmp_path / "r.parquet", made(**EFFECTS[effect])), nominal)
    assert codes(recording) == []
    assert recording.usable.all() and recording.joined[:-1].all()


def shaft(table):
    """Torque of a shaft (n,) [Nm]: that of the q current, as the inductances are nearly equal, less a friction."""
    i = (2 / 3) * sum(table[f"i_{x}"] * np.exp(2j * np.pi / 3 * k) for k, x in enumerate("abc"))
    return 6 * 0.165 * (i * np.exp(-1j * table["theta_e"])).imag - 0.3


def test_a_torque_that_drives_is_no_finding(tmp_path, nominal):
    table = made()
    recording = load_recording(write(tmp_path / "r.parquet", table | {"torque": shaft(table)}), nominal)
    assert codes(recording) == []


def test_wrong_machine_data_are_no_swapped_phases(tmp_path, nominal):
    machine = dataclasses.replace(nominal.machine, resistance_ohm=4.0, magnet_flux_wb=0.12, inductance_q_h=0.03)
    recording = load_recording(write(tmp_path / "r.parquet", made()), dataclasses.replace(nominal, machine=machine))
    assert codes(recording) == []


def drop(table, rows):
    return {name: np.delete(v, rows) for name, v in table.items()}


def edit(table, **columns):
    return table | columns


def held(values, first, last):
    values = values.copy()
    values[first:last] = values[first]
    return values


def with_nan(values, *rows):
    values = values.copy()
    values[list(rows)] = np.nan
    return values


def same(*names):
    """The recording has these columns unchanged."""
    return lambda r, x: all(np.allclose(r[name], x[name], rtol=1e-3, atol=1e-9) for name in names)


def unused(first, last):
    """None of these rows is used."""
    return lambda r, x: not r.usable[first:last].any() and r.usable[: first - 1].all()


# name: (fault, code, column, first row, what the recording must be afterwards)
FAULTS = {
    "gap": (lambda x: drop(x, slice(1000, 1040)), "gap", "t", 1000, lambda r, x: not r.joined[999]),
    "dropped unseen": (
        lambda x: edit(drop(x, [1000, 2000]), t=np.arange(3998) * T), "dropped", "theta_e", 1000,
        lambda r, x: not r.joined[999] and not r.joined[1998] and r.joined[:900].all(),
    ),
    "repeated unseen": (
        lambda x: {n: np.insert(v, 1000, v[999]) if n != "t" else np.arange(4001) * T for n, v in x.items()},
        "repeated", "", 1000, lambda r, x: not r.usable[1000] and r.usable.sum() == 4000,
    ),
    "duplicate rows": (
        lambda x: {n: np.insert(v, 1000, v[999]) for n, v in x.items()}, "duplicate", "t", 1000,
        lambda r, x: len(r) == 4000 and r.joined[:-1].all(),
    ),
    "rows out of order": (
        lambda x: {n: v[np.r_[0:100, 101, 100, 102 : len(v)]] for n, v in x.items()}, "time_order", "t", 101,
        lambda r, x: np.array_equal(r["theta_e"], x["theta_e"]) and not r.joined[99],
    ),
    "all rows out of order": (
        lambda x: {n: v[np.random.default_rng(5).permutation(len(v))] for n, v in x.items()}, "time_order", "t", None,
        lambda r, x: np.array_equal(r["theta_e"], x["theta_e"]) and r.joined[:-1].all(),
    ),
    "clock restart": (
        lambda x: {n: np.concatenate([v, v]) for n, v in x.items()}, "time_order", "t", 4000,
        lambda r, x: len(r) == 8000 and not r.joined[3999] and (np.diff(r["t"]) > 0).all(),
    ),
    "coarse time": (
        lambda x: edit(x, t=np.round(x["t"], 3)), "coarse_time", "t", None,
        lambda r, x: np.allclose(r["t"], x["t"], atol=1e-3) and r.joined[:-1].all(),
    ),
    "time in ms": (lambda x: edit(x, t=x["t"] * 1e3), "unit", "t", 0, same("t")),
    "time in us": (lambda x: edit(x, t=x["t"] * 1e6), "unit", "t", 0, same("t")),
    "not a number": (
        lambda x: edit(x, i_b=with_nan(x["i_b"], 10, 11, 500)), "missing", "i_b", 10,
        lambda r, x: (~r.usable).sum() == 3 and np.isfinite(r["i_b"]).all(),
    ),
    "infinite": (
        lambda x: edit(x, u_dc=np.where(np.arange(4000) == 7, np.inf, x["u_dc"])), "missing", "u_dc", 7,
        lambda r, x: not r.usable[7],
    ),
    "no time in a row": (lambda x: edit(x, t=with_nan(x["t"], 9)), "missing", "t", 9, lambda r, x: not r.joined[8]),
    "clipped": (
        lambda x: edit(x, i_a=np.clip(x["i_a"], -2.5, 2.5)), "clipped", "i_a", None,
        lambda r, x: r.usable[np.abs(x["i_a"]) < 2.3].mean() > 0.9 and not r.usable[np.abs(x["i_a"]) > 3.0].any(),
    ),
    "stuck current": (
        lambda x: edit(x, i_b=held(x["i_b"], 1500, 2000)), "stuck", "i_b", 1500, unused(1500, 2000),
    ),
    "dead current": (
        lambda x: edit(x, i_a=np.full(4000, 0.02)), "stuck", "i_a", 0,
        lambda r, x: np.allclose(r["i_a"], x["i_a"], atol=0.05) and r.usable.all(),
    ),
    "lost current": (
        lambda x: edit(x, i_b=np.full(4000, np.nan)), "missing", "i_b", 0,
        lambda r, x: np.allclose(r["i_b"], x["i_b"], atol=0.05) and r.usable.all(),
    ),
    "angle of another shaft": (
        lambda x: edit(x, theta_e=1.3 * np.unwrap(x["theta_e"]), omega_e=1.3 * x["omega_e"]), "no_fit", "", 0,
        lambda r, x: r.usable.all(),
    ),
    "stuck angle": (
        lambda x: edit(x, theta_e=held(x["theta_e"], 1500, 2000)), "stuck", "theta_e", 1500,
        unused(1500, 2000),
    ),
    "stuck duty": (
        lambda x: edit(x, d_c=held(x["d_c"], 1500, 2500)), "stuck", "d_c", 1500, unused(1500, 2500),
    ),
    "degrees": (
        lambda x: edit(x, theta_e=np.degrees(x["theta_e"])), "unit", "theta_e", 0,
        same("theta_e"),
    ),
    "angle of the shaft": (
        lambda x: edit(x, theta_e=np.mod(np.unwrap(x["theta_e"]) / 4, 2 * np.pi)), "unit", "theta_e", 0,
        lambda r, x: np.allclose(np.exp(1j * r["theta_e"]), np.exp(1j * x["theta_e"])),
    ),
    "both of the shaft": (
        lambda x: edit(x, theta_e=np.unwrap(x["theta_e"]) / 4, omega_e=x["omega_e"] / 4), "unit", "theta_e", 0,
        same("omega_e"),
    ),
    "rpm": (
        lambda x: edit(x, omega_e=x["omega_e"] / 4 * 60 / 2 / np.pi), "unit", "omega_e", 0,
        same("omega_e"),
    ),
    "speed of the shaft": (
        lambda x: edit(x, omega_e=x["omega_e"] / 4), "unit", "omega_e", 0, same("omega_e"),
    ),
    "speed with a wrong scale": (
        lambda x: edit(x, omega_e=x["omega_e"] * 1.37), "angle_speed", "omega_e", 0,
        same("omega_e"),
    ),
    "percent": (
        lambda x: edit(x, **{n: x[n] * 100 for n in ("d_a", "d_b", "d_c")}), "unit", "d_a", 0,
        same("d_b"),
    ),
    "milliamps": (
        lambda x: edit(x, **{n: x[n] * 1e3 for n in ("i_a", "i_b", "i_c")}), "unit", "i_a", 0,
        same("i_c"),
    ),
    "millivolts": (lambda x: edit(x, u_dc=x["u_dc"] * 1e3), "unit", "u_dc", 0, same("u_dc")),
    "currents swapped": (
        lambda x: edit(x, i_b=x["i_c"], i_c=x["i_b"]), "swapped_phases", "i_b", 0, same("i_b"),
    ),
    "currents turned": (
        lambda x: edit(x, i_a=x["i_b"], i_b=x["i_c"], i_c=x["i_a"]), "swapped_phases", None, 0,
        lambda r, x: np.array_equal(r["i_a"], x["i_a"]) and np.array_equal(r["i_b"], x["i_b"]),
    ),
    "duties swapped": (
        lambda x: edit(x, d_a=x["d_b"], d_b=x["d_a"]), "swapped_phases", "d_a", 0, same("d_a"),
    ),
    "currents reversed": (
        lambda x: edit(x, i_a=-x["i_a"], i_b=-x["i_b"], i_c=-x["i_c"]), "sign", "i_a", 0,
        same("i_c"),
    ),
    "angle reversed": (
        lambda x: edit(x, theta_e=-x["theta_e"]), "rotation", "theta_e", 0, same("omega_e"),
    ),
    "angle and speed reversed": (
        lambda x: edit(x, theta_e=-x["theta_e"], omega_e=-x["omega_e"]), "rotation", "theta_e", 0,
        same("omega_e"),
    ),
    "speed reversed": (
        lambda x: edit(x, omega_e=-x["omega_e"]), "sign", "omega_e", 0, same("omega_e"),
    ),
    "torque of a load": (
        lambda x: edit(x, torque=-shaft(x)), "sign", "torque", 0,
        lambda r, x: np.array_equal(r["torque"], shaft(x)),
    ),
    "currents that do not belong together": (
        lambda x: edit(x, i_c=x["i_c"] * 0.2), "current_sum", "i_c", None,
        lambda r, x: np.array_equal(r["i_c"], 0.2 * x["i_c"]),
    ),
    "duty above one": (
        lambda x: edit(x, d_a=np.where(np.arange(4000) == 50, 1.2, x["d_a"])), "duty_range", "d_a", 50,
        lambda r, x: not r.usable[50] and r["d_a"].max() <= 1.0,
    ),
    "bus at zero": (
        lambda x: edit(x, u_dc=np.where(np.arange(4000) == 50, 0.0, x["u_dc"])), "u_dc_range", "u_dc", 50,
        lambda r, x: not r.usable[50],
    ),
    "another bus": (lambda x: edit(x, u_dc=x["u_dc"] / 3), "u_dc_range", "u_dc", 0, lambda r, x: r.usable.all()),
    "slow": (
        lambda x: {n: v[::40] for n, v in x.items()}, "slow_sampling", "t", 0, lambda r, x: r.slow and not r.fatal,
    ),
    "word": (
        lambda x: edit(x, i_a=np.where(np.arange(4000) == 50, "bad", x["i_a"].astype(str))), "not_a_number", "i_a", 50,
        lambda r, x: not r.usable[50],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_is_found_and_corrected(tmp_path, nominal, name):
    fault, code, column, row, afterwards = FAULTS[name]
    table = made()
    recording = load_recording(write(tmp_path / "r.csv", fault(table)), nominal)
    found = [p for p in recording.problems if p.code == code]
    assert found, recording.problems
    problem = found[0]
    assert column is None or problem.column == column
    assert row is None or problem.row == row
    assert problem.action and not recording.fatal and problem.count > 0
    assert "\n" not in problem.message
    assert afterwards(recording, table)
    assert len(recording.usable) == len(recording.joined) == len(recording)
    # No other findings than those that follow from the fault.
    follows = {
        "not_a_number": {"missing"},
        "clipped": {"stuck"},
        "u_dc_range": {"no_fit"},
        "missing": {"gap"} if column == "t" else set(),
    }
    assert set(codes(recording)) <= {code} | follows.get(code, set())
    json.dumps([dataclasses.asdict(p) for p in recording.problems])


FATAL = {
    "short": (lambda x: {n: v[:100] for n, v in x.items()}, "too_short"),
    "other sample time": (
        lambda x: edit(x, t=x["t"] * 1.25, theta_e=np.mod(np.arange(4000) * 0.05, 6.28)),
        "sample_time",
    ),
    "no current": (lambda x: edit(x, i_a=np.full(4000, np.nan), i_b=np.full(4000, np.nan)), "missing"),
    "angle stands": (lambda x: edit(x, theta_e=np.ones(4000)), "stuck"),
    "huge currents": (lambda x: edit(x, **{n: x[n] * 1e5 for n in ("i_a", "i_b", "i_c")}), "unit"),
    "duties in counts": (
        lambda x: edit(x, **{n: np.round(x[n] * 5000) for n in ("d_a", "d_b", "d_c")}),
        "unit",
    ),
    "modulation index": (lambda x: edit(x, **{n: 2 * x[n] - 1 for n in ("d_a", "d_b", "d_c")}), "unit"),
    "amperes as milliamps": (lambda x: edit(x, **{n: x[n] * 1e-3 for n in ("i_a", "i_b", "i_c")}), "unit"),
    "dead bus": (lambda x: edit(x, u_dc=np.zeros(4000)), "unit"),
}


def test_a_time_that_stands_is_no_time(tmp_path, nominal):
    recording = load_recording(write(tmp_path / "r.csv", edit(made(), t=np.full(4000, 1.74223e9))), nominal)
    assert not recording.fatal and np.allclose(np.diff(recording["t"]), T)
    assert any("the same in all rows and tells no time" in note for note in recording.meta["notes"])


@pytest.mark.parametrize("name", FATAL)
def test_uncorrectable_faults_are_fatal(tmp_path, nominal, name):
    fault, code = FATAL[name]
    recording = load_recording(write(tmp_path / "r.csv", fault(made())), nominal)
    assert recording.fatal and [p.code for p in recording.problems if p.fatal] == [code]


def test_a_dq_log_with_the_speed_of_the_other_direction(tmp_path, nominal):
    table = dq_made()
    recording = load_recording(write(tmp_path / "r.csv", edit(table, omega_e=-table["omega_e"])), nominal)
    assert codes(recording) == ["slow_sampling", "rotation"]
    np.testing.assert_allclose(recording["omega_e"], table["omega_e"])
    recording = load_recording(write(tmp_path / "r.csv", edit(table, omega_e=table["omega_e"] / 4)), nominal)
    assert codes(recording) == ["slow_sampling", "unit"]
    np.testing.assert_allclose(recording["omega_e"], table["omega_e"])


def test_one_gap_is_singular(tmp_path, nominal):
    table = {name: np.delete(values, 2000) for name, values in made().items()}
    recording = load_recording(write(tmp_path / "r.csv", table), nominal)
    assert [p.message for p in recording.problems] == ["1 gap, about 1 row missing"]


def test_every_check_has_a_stage():
    assert {m.STAGE for m in checks()} == set(STAGES)
    stage = {m.__name__.rpartition(".")[2]: m.STAGE for m in checks()}
    assert len(checks()) == len(stage)
    assert all(stage[other] == m.STAGE for m in checks() for other in getattr(m, "AFTER", ()))


@pytest.mark.slow
def test_nothing_but_what_a_check_names_orders_a_stage():
    """All tests of this folder hold in the other order of the checks that name none."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "cocotb_tests.support.diagnoses.backward_checks"]
    done = subprocess.run([*command, str(Path(__file__).parent)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("bad", [np.nan, slowly(np.inf), slowly(1e300)])
@pytest.mark.parametrize("name", [name for name in FAST if name not in ("t", "u_dc")])
def test_a_value_that_is_missing_in_every_second_row_leaves_nothing_to_balance(tmp_path, nominal, name, bad):
    """No two usable rows follow each other then, which is a finding and no exception."""
    table = made(700)
    table[name] = np.where(np.arange(700) % 2, bad, table[name])
    recording = load_recording(write(tmp_path / "r.csv", table), nominal)
    assert [(p.code, p.column) for p in recording.problems] == [("missing", name), ("too_short", "")]
    assert recording.fatal and not (recording.usable[1:] & recording.usable[:-1]).any()


def test_a_missing_value_is_told_with_its_line(tmp_path, nominal):
    """The header is line 1; a row without a time, which is left out, counts too."""
    table = made(700)
    table |= {"t": with_nan(table["t"], 5), "i_b": with_nan(table["i_b"], 20)}
    recording = load_recording(write(tmp_path / "r.csv", table), nominal)
    assert "i_b: 1 value missing or not finite, the first in line 22" in [p.message for p in recording.problems]


def test_a_dump_of_another_drive_is_told_by_what_differs(tmp_path):
    """Not by its sample time alone, which would be a log at another rate."""
    servo, rows = drives.load(DRIVES / "servo_24v.toml"), np.zeros(500, np.int64)
    samples, seen = dict.fromkeys(Sample._fields, rows), dict.fromkeys(telemetry_words.PACKET, rows)
    dump = write_dump(tmp_path / "r.fluxdump", servo, registers(servo), samples, seen, counter=np.arange(500))
    for other, wanted in (("drone_24v", "sample time 50 us, not 25; current at full code 16.5 A, not 20;"),
                          ("paper001", "sample time 50 us, not 100; ")):  # fmt: skip
        found = load_recording(dump, load_nominal(DRIVES / f"{other}.toml")).problems
        assert any(p.fatal and f"another drive than the drive file's: {wanted}" in p.message for p in found), found
    found = load_recording(dump, load_nominal(DRIVES / "servo_24v.toml")).problems
    assert not any("another drive" in p.message for p in found)


def test_a_missing_value_makes_no_third_sensor(tmp_path, nominal):
    """The interpolated value breaks the sum of three currents of which one was computed, in a row that is not used."""
    table = made()
    table["i_c"] = -table["i_a"] - table["i_b"]
    table["i_a"] = with_nan(table["i_a"], 2001)
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    assert codes(recording) == ["missing"] and view_of(recording, nominal).i_abc is None


def test_swapped_currents_show_where_they_are_large(tmp_path, nominal):
    """At most points of this recording the noise of the voltage hides how much better the exchange is."""
    table = {name: values[np.r_[400:2000, 3000:3700]] for name, values in made(noise=0.04).items()}
    swapped = table | {"i_a": table["i_b"], "i_b": table["i_a"]}
    recording = load_recording(write(tmp_path / "r.parquet", swapped), nominal)
    assert codes(recording) == ["gap", "swapped_phases"] and same("i_a", "i_b")(recording, table)


def test_a_documented_prefix_is_named_beside_the_nameplate(tmp_path, nominal):
    table = made()
    header = {f"{name} [mA]" if name in ("i_a", "i_b", "i_c") else name: values for name, values in table.items()}
    (finding,) = load_recording(write(tmp_path / "r.csv", header), nominal).problems
    assert finding.code == "unit" and finding.fatal
    assert "as documented" in finding.message and "rated_current_a" in finding.message and "1000" in finding.message


def test_inductances_that_are_too_large_are_no_prefix_of_the_currents(tmp_path, nominal):
    """Without currents any balance is met: a table of a motor at 17 A was refused, as it needed a millionth of them."""
    machine = nominal.machine
    large = {key: 8.0 * getattr(machine, key) for key in ("inductance_d_h", "inductance_q_h")}
    wrong = dataclasses.replace(nominal, machine=dataclasses.replace(machine, **large))
    path = write(tmp_path / "r.parquet", {name: values[400:1300] for name, values in made().items()})
    assert "unit" not in codes(load_recording(path, wrong))


def test_an_angle_in_rad_under_a_header_in_degrees(tmp_path, nominal):
    table = made()
    header = {f"{name} [deg]" if name == "theta_e" else name: values for name, values in table.items()}
    recording = load_recording(write(tmp_path / "r.csv", header), nominal)
    (finding,) = recording.problems
    assert (finding.code, finding.column) == ("unit", "theta_e") and "0.01745 rad is stated" in finding.message
    assert same("theta_e", "omega_e")(recording, table)
