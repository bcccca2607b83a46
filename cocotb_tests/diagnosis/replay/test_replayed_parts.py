# SPDX-License-Identifier: BSD-3-Clause
"""Dumps of a core with torque table, position loop and modes: replayed with the table and the writes that they hold."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.dumps import recording
from fluxproof import dump_capture
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.golden_loop import simulate
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.replay import digital, telemetry
from golden_model import fluxproof
from golden_model.drive_keys import DriveError
from golden_model.motion import to_position
from golden_model.registers import registers
from studies.speed.drives import weakened

ROWS = 900
BEGIN = {"position_mode": 1}
WRITES = {
    150: {"position_target": to_position(0.3)},
    500: {"position_mode": 0, "voltage_mode": 1, "u_q_ext": 4000},
    700: {"voltage_mode": 0},
}


@pytest.fixture(scope="module")
def run():
    """(drive, registers at the start, samples, observed) of a run in position, voltage and torque mode."""
    drive = weakened(PAPER)
    core = dataclasses.replace(drive.core, position_loop=True, modes=True)
    drive = dataclasses.replace(drive, core=core)
    chosen = registers(drive)
    chosen = chosen._replace(values=chosen.values._replace(**BEGIN))
    zeros = np.zeros(ROWS, np.int64)
    torque = np.where(np.arange(ROWS) < 750, 0, 6000)
    scenario = Scenario(
        omega_ref=zeros, load=np.zeros(ROWS), u_dc=np.full(ROWS, drive.inverter.dc_bus_v), i_d_ref=zeros,
        i_q_ext=torque, speed_mode=zeros, enable=zeros + 1, changes=WRITES,
    )  # fmt: skip
    seen = simulate(drive, chosen, scenario).observed
    codes = [seen[f"code_{x}"] for x in ("a", "b", "c", "u_dc", "theta")]
    references = [scenario.omega_ref, scenario.i_d_ref, scenario.i_q_ext, scenario.speed_mode]
    samples = np.stack([*codes, *references, *scenario.slow_inputs(), scenario.enable], axis=1)
    return drive, chosen, samples, seen


def replayed(path, run, chosen=None, changes=WRITES):
    """(result, its notes) of a dump."""
    drive, given, samples, seen = run
    return digital.replay(recording(telemetry.write_dump(path, drive, chosen or given, samples, seen, changes=changes)))


def test_table_and_writes_are_replayed(run, tmp_path):
    got, notes = replayed(tmp_path / "a.dump", run)
    assert got.checked and got.samples == ROWS and got.first_difference is None, notes
    got, notes = replayed(tmp_path / "b.dump", run, changes=None)
    assert not got.checked and "does not hold the targets" in notes[0]


@pytest.mark.slow
def test_a_write_that_is_not_told_is_a_difference(run, tmp_path):
    got, _ = replayed(tmp_path / "a.dump", run, changes={k: v for k, v in WRITES.items() if k != 500})
    assert (got.first_difference or {})["sample"] == 500
    late = {k + 3 * (k == 700): v for k, v in WRITES.items()}
    got, _ = replayed(tmp_path / "b.dump", run, changes=late)
    assert (got.first_difference or {})["sample"] == 700


def test_a_wrong_word_of_the_table_is_a_difference(run, tmp_path):
    table = np.array(run[1].table)
    table[1] += 200
    got, _ = replayed(tmp_path / "a.dump", run, run[1]._replace(table=table))
    assert (got.first_difference or {})["sample"] < 10  # the position loop asks for a torque at once


@pytest.mark.parametrize("key, value", [
    ("table", [[1, 2], [3, 4]]), ("table", "x"), ("changes", [[1, {"nothing": 2}]]), ("changes", [["x", {}]]),
    ("changes", [[1, {"kp_d": 2.5}]]), ("changes", 7),
])  # fmt: skip
def test_a_header_that_is_none_is_refused(run, key, value, tmp_path):
    drive, chosen, samples, seen = run
    path = telemetry.write_dump(tmp_path / "a.dump", drive, chosen, samples, seen, changes={})
    raw = path.read_bytes()
    size = int.from_bytes(raw[8:12], "little")
    header = json.loads(raw[12 : 12 + size]) | {key: value}
    header["checksum"] = telemetry._checksums(header)
    text = json.dumps(header).encode()
    path.write_bytes(raw[:8] + len(text).to_bytes(4, "little") + text + raw[12 + size :])
    with pytest.raises(RecordingError, match=key):
        telemetry.read_dump(path)


def test_changes_of_a_file(tmp_path):
    path = tmp_path / "changes.json"
    path.write_text('[[5, {"position_target": 7}], [5, {"position_mode": 1}], [9, {"kp_d": 3}]]')
    assert dump_capture.changes_of(path) == {5: {"position_target": 7, "position_mode": 1}, 9: {"kp_d": 3}}
    for text in ('{"kp_d": 3}', '[[5, {"kp_d": 1.5}]]', "[[-1, {}]]", '[[1, {"nothing": 2}]]'):
        path.write_text(text)
        with pytest.raises(DriveError):
            dump_capture.changes_of(path)
    assert set(fluxproof.REGISTERS) >= {name for new in WRITES.values() for name in new}
