# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof_hil: a drive without a motor; software that knows nothing of it runs on its registers."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.host.bring_up import compiled
from cocotb_tests.support.host.hil_board import HilBoard
from cocotb_tests.support.needs import skip_without_ghdl5
from cocotb_tests.support.recordings.dumps import recording
from fluxproof.checkout import ROOT
from fluxproof.command import main
from fluxproof.diagnosis.ground.plant_section import plant_of
from fluxproof.diagnosis.replay import digital
from fluxproof.hil.load import erase_words, load_words
from fluxproof.plant import Bus, FluxMap
from fluxproof.project import hil
from golden_model import drive as drives
from golden_model.drive_keys import DriveError
from golden_model.front_ends import Encoder
from golden_model.io import board_map, motor_map
from golden_model.io.register_map import OKAY

HALF = 1700  # clocks of half a period: a step of the motor is 0.5 us; with 1/J of this shaft no longer one fits
RPM = 9.549297
GRID = np.mgrid[:3, :3].reshape(2, 9).astype(float)
LOADED, PACKET_BYTES = 40, 96  # packets until bring_up.c has loaded the registers


@pytest.fixture(scope="module")
def drive():
    return drives.with_carrier(drives.load(PAPER), HALF)


def test_every_word_of_a_motor_fits_its_register(drive):
    """The rotor is held meanwhile; tables of zeros are left to the block RAM, and erased where others were there."""
    plant, ports = plant_of(PAPER), motor_map.registers()
    machine = dataclasses.replace(plant.machine, saturation_q_per_a2=4e-3, cogging_amplitude_nm=0.1, cogging_order=12)
    bus = Bus(1e-3, 0.1, True, 10.0)
    for words in (load_words(drive, machine, plant.inverter, plant.sensors, bus), erase_words()):
        for name, value in words:
            assert ports[name].port.low <= value <= ports[name].port.high and ports[name].kind.writable, name
    words = load_words(drive, machine, plant.inverter, plant.sensors)
    assert words[0] == ("motor_start", 1) and words[-1] == ("motor_start", 0)
    written = {name for name, _ in words}
    assert set(ports) - written == {n for n in ports if not n.startswith("motor_") or not ports[n].kind.writable}
    assert sum(name == "motor_table_write" for name, _ in words) > 4000


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sensors": {"eccentricity_once_rad": 0.01}}, r"\[plant.sensors\] eccentricity_once_rad = 0.01"),
        ({"machine": {"iron_conductance_s": 1e-4}}, r"\[plant.machine\] iron_conductance_s = 0.0001"),
        ({"machine": {"flux_map": FluxMap.from_points(*GRID, *GRID)}}, r"\[plant.machine\] flux_map"),
        ({"machine": {"inertia_kgm2": 1e-7}}, r"motor: k_j = .* does not fit"),
    ],
)
def test_what_the_motor_does_not_have_is_refused(drive, changes, said):
    plant = plant_of(PAPER)
    names = ("machine", "inverter", "sensors")
    parts = {n: dataclasses.replace(getattr(plant, n), **changes.get(n, {})) for n in names}
    with pytest.raises(DriveError, match=said):
        load_words(drive, *parts.values())
    with pytest.raises(DriveError, match=r'\[encoder\] kind = "biss"'):
        load_words(dataclasses.replace(drive, encoder=Encoder("biss")), plant.machine, plant.inverter, plant.sensors)


def words_of(tmp_path, *lines: str) -> dict[str, int]:
    """The last word of each register in motor_registers.h of paper001 with further lines of [plant.*]."""
    file = tmp_path / "drive.toml"
    file.write_text("\n".join([PAPER.read_text(), *lines]))
    text = hil.header(str(file), drives.with_carrier(drives.load(file), HALF))
    return {name: int(value) for value, name in re.findall(r"(-?\d+)\}, /\* (\w+)", text)}


def test_temperatures_and_filter_of_a_drive_file(tmp_path):
    """A hot motor without bodies is one of other values; with bodies the registers let it warm from there."""
    cold = words_of(tmp_path)
    assert cold["motor_k_filter"] == cold["motor_heating"] == cold["motor_tcr_winding"] == 0
    hot = ["[plant.machine]", "temperature_winding_c = 80", "temperature_magnet_c = 80"]
    hot += ["resistance_temp_coeff_per_k = 0.004", "magnet_temp_coeff_per_k = -0.001"]
    still = words_of(tmp_path, *hot)
    assert still["motor_r_a"] / cold["motor_r_a"] == pytest.approx(1.24, rel=1e-5)
    assert still["motor_psi_m"] / cold["motor_psi_m"] == pytest.approx(0.94, rel=1e-5)
    assert still["motor_tcr_winding"] == 0 and still["motor_ambient"] == 80 << 6
    bodies = ["[plant.hil]", "winding_j_per_k = 100", "winding_s = 60", "magnet_s = 90", "current_filter_s = 5e-6"]
    warm = words_of(tmp_path, *hot, *bodies)
    assert all(warm[f"motor_{name}"] == cold[f"motor_{name}"] for name in ("r_a", "psi_m"))
    assert warm["motor_psi_start"] == still["motor_psi_m"] and warm["motor_ambient"] == 80 << 6
    assert all(warm[f"motor_{name}"] for name in ("heating", "k_winding", "k_magnet", "tcr_winding", "tcr_magnet"))
    assert warm["motor_k_filter"] * 2**-17 == pytest.approx(-math.expm1(-17 / 34e6 / 5e-6), rel=1e-4)
    with pytest.raises(DriveError, match=r"\[plant.hil\] needs winding_s, magnet_s as well"):
        words_of(tmp_path, *bodies[:2])
    with pytest.raises(DriveError, match=r"temperature_magnet_c = 60 differs from temperature_winding_c = 80"):
        words_of(tmp_path, *hot[:2], "temperature_magnet_c = 60", *bodies)


@pytest.mark.slow
def test_bring_up_turns_the_motor_in_the_rtl(drive, tmp_path, capsys):
    """bring_up.c as it is, in Verilator: nothing but clocks outside; the motor's registers on the same bus.

    dump and watch take the telemetry of this run; the golden core says the same of every sample of its own.
    """
    skip_without_ghdl5()
    plant = plant_of(PAPER)
    board = HilBoard(drive, plant.machine, plant.inverter, plant.sensors, Bus(1e-3, 10.0, True))
    loaded = dict(load_words(drive, plant.machine, plant.inverter, plant.sensors))
    assert board.value("motor_psi_m") == loaded["motor_psi_m"]
    assert board.write(motor_map.registers()["motor_i_a"].address, 0) != OKAY
    program = compiled(tmp_path, drive, ROOT / "cocotb_tests" / "support" / "host" / "bus_pipe.c")
    assert board.write(board_map.registers()["telemetry_enable"].address, 1) == OKAY
    done = board.run(program, "300")
    assert done.returncode == 0, done.stdout + done.stderr
    said = re.search(r"300 rpm wanted, ([\d.]+) rpm measured", done.stdout)
    assert said and abs(float(said[1]) - 300) < 12, done.stdout
    assert abs(max(board.speeds) * RPM - 300) < 12 and abs(board.speeds[-1] * RPM) < 5
    assert board.gate_word == 0 and board.value("motor_shoot_through") == 0
    fallen = min(board.buses) / loaded["motor_u_dc"]  # the capacitor behind its source, while the shaft accelerates
    assert 0.9 < fallen < 1.0
    file, capture, dump = (tmp_path / name for name in ("drive.toml", "capture.bin", "run.fluxdump"))
    file.write_text(PAPER.read_text().replace("clock_hz = 200e6", f"clock_hz = {drive.core.clock_hz}"))
    capture.write_bytes(board.capture()[LOADED * PACKET_BYTES :])
    assert main(["dump", str(capture), "--drive", str(file), "-o", str(dump)]) == 0
    replayed, notes = digital.replay(recording(dump))
    assert replayed.checked and replayed.first_difference is None and replayed.samples > 5000, notes
    watch = ["watch", str(capture), "--drive", str(file), "--no-page", "--every", "0", "--seconds", "0.5"]
    assert main(watch) == 0
    out = capsys.readouterr().out
    rows = re.search(r"^([\d,]+) rows, 0 lost, 0 bad bytes, 0 breaks", out, re.MULTILINE)
    assert rows and f"digital: equal over {rows[1]} samples" in out, out  # though the stream begins behind sample 0
