# SPDX-License-Identifier: BSD-3-Clause
"""docs/software/bring_up.c on the golden model and on the RTL behind AXI: the motor turns, errors are reported."""

from __future__ import annotations

import dataclasses
import math
import re
import shutil
import signal
import subprocess

import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.host.bring_up import SOFTWARE, compiled
from cocotb_tests.support.host.golden_board import GoldenBoard
from cocotb_tests.support.host.rtl_board import RtlBoard
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.cosim import verilog
from golden_model import drive as drives
from golden_model.board_registers import board_generics
from golden_model.io import board_map, motor_map
from golden_model.io.fault_latch import NAMES
from scripts.registers.rdl import version_word

RPM = 30 / math.pi


@pytest.fixture(scope="module")
def drive():
    """The paper's drive with fewer clocks per period, faster; its resolver has the motor's pole pairs.

    The register pole_pairs is then 1, as with Hall sensors, and tells no program how fast the shaft turns.
    """
    drive = drives.with_carrier(drives.load(PAPER), 100)
    sensors = dataclasses.replace(drive.sensors, position_pole_pairs=drive.machine.pole_pairs)
    return dataclasses.replace(drive, sensors=sensors)


@pytest.fixture(scope="module")
def program(drive, tmp_path_factory):
    bus = ROOT / "cocotb_tests" / "support" / "host" / "bus_pipe.c"
    return compiled(tmp_path_factory.mktemp("bring_up"), drive, bus)


def test_compiles_for_linux_on_a_zynq(drive, tmp_path):
    assert compiled(tmp_path, drive, SOFTWARE / "bus_uio.c").exists()


@pytest.fixture(params=["golden", "rtl"])
def board(request, drive):
    """A function that makes a board with a drive at rest."""
    if request.param == "golden":
        return lambda **options: GoldenBoard(drive, version_word(), **options)
    try:
        verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
    return lambda **options: RtlBoard(drive, **options)


@pytest.mark.parametrize("board", ["golden", slowly("rtl")], indirect=True)
def test_brings_the_motor_to_speed_and_stops_it(board, drive, program):
    board = board()
    done = board.run(program, "300")
    assert done.returncode == 0, done.stdout + done.stderr
    said = re.search(r"300 rpm wanted, ([\d.]+) rpm measured", done.stdout)
    assert said, done.stdout
    turned = board.speeds[round(0.39 / board.period_s)] * RPM
    assert abs(turned - 300) < 3 and abs(float(said[1]) - turned) < 12, (turned, said[1])
    assert abs(board.speeds[-1] * RPM) < 3
    assert "stopped, gates off" in done.stdout and board.gate_word == 0
    assert f"bus {drive.inverter.dc_bus_v:.1f} V" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("heartbeat_s", [0.1, 4e-3])
def test_the_program_writes_within_its_own_heartbeat(drive, tmp_path, heartbeat_s):
    """4 ms is shorter than the zero check before the gates go on, and than a step of the ramp."""
    try:
        verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
    drive = dataclasses.replace(drive, protection=dataclasses.replace(drive.protection, heartbeat_s=heartbeat_s))
    program = compiled(tmp_path, drive, ROOT / "cocotb_tests" / "support" / "host" / "bus_pipe.c")
    board = RtlBoard(drive)
    done = board.run(program, "300")
    assert done.returncode == 0 and "stopped, gates off" in done.stdout, done.stdout + done.stderr
    flags = board_map.registers()["fault_flags"].address
    assert not board.read(flags)[1] >> NAMES.index("host_lost") & 1
    board.write(board_map.registers()["enable"].address, 1)
    for _ in range(round(1.1 * heartbeat_s / board.period_s)):
        board.run_period()
    assert board.read(flags)[1] >> NAMES.index("host_lost") & 1, "the heartbeat is not watched here"


def test_a_board_with_other_front_ends_is_refused(tmp_path):
    """The header of a drive file with front ends has their generics; the program compares them before it loads."""
    drive = drives.load(DRIVES / "servo_24v.toml")
    program = compiled(tmp_path, drive, ROOT / "cocotb_tests" / "support" / "host" / "bus_pipe.c")
    for name in ("encoder", "currents", "spi_lines"):
        board = GoldenBoard(drive, version_word())
        wanted = board_generics(drive)[name]
        given = board_generics(drive) | {name: wanted + 1}
        addresses = {board_map.registers()[n].address: value for n, value in given.items()}
        read, written = board.read, []
        board.read = lambda address, read=read, at=addresses: (0, at[address]) if address in at else read(address)
        board.write = lambda address, word, written=written: written.append((address, word)) or 0
        done = board.run(program)
        assert done.returncode == 1, done.stdout
        assert f"{name.upper()} = {wanted + 1}, drive_registers.h is for {wanted}" in done.stderr, done.stderr
        assert written == [(board_map.registers()["enable"].address, 0)]


def test_trip_during_bring_up_stops_it(board, program):
    board = board(trip_at=0.3)
    done = board.run(program, "300")
    assert done.returncode == 1
    assert re.search(r"bring_up: tripped at \d+ rpm: first_fault 0x80", done.stderr), done.stderr
    assert board.time < 0.33 and board.gate_word == 0


def test_no_bus_voltage_no_gates(board, program):
    board = board()
    board.u_dc = 0.0
    done = board.run(program)
    assert done.returncode == 1 and "no bus voltage" in done.stderr, done.stderr
    assert board.gate_word == 0


def test_torque_mode(board, drive, program):
    """A current without speed mode; the torque in Nm; beyond the speed it was given it stops."""
    done = board().run(program, "0.5", "A", "2000")
    assert done.returncode == 0, done.stdout + done.stderr
    said = re.search(r"0.50 A wanted, i_q ([\d.]+) A measured, .* torque ([\d.]+) Nm", done.stdout)
    assert abs(float(said[1]) - 0.5) < 0.1
    wanted = 1.5 * drive.machine.pole_pairs * drive.machine.magnet_flux_wb * float(said[1])
    assert 0.9 * wanted < float(said[2]) < 1.4 * wanted  # the dead time is not learnt yet, see README, limits
    fast = board()
    done = fast.run(program, "0.5", "A", "10")
    assert done.returncode == 1 and re.search(r"1\d rpm, 10 allowed", done.stderr), done.stderr
    fast.run_period()
    assert fast.gate_word == 0


@pytest.mark.parametrize("number", [signal.SIGINT, slowly(signal.SIGTERM), signal.SIGBUS], ids=lambda n: n.name)
def test_gates_are_off_after_a_signal(board, program, number):
    """Ctrl-C, a service manager's stop and a bus error while the motor turns."""
    board = board()
    board.signal = (0.25, number)
    done = board.run(program, "300")
    assert done.returncode == 1 and "gates off" in done.stderr, done.stderr
    assert max(board.speeds) * RPM > 100
    board.run_period()
    assert board.gate_word == 0 and board.time < 0.3


def test_usage(board, program):
    done = board().run(program, "0.5", "A")
    assert done.returncode == 2 and "usage" in done.stderr


@pytest.mark.parametrize("standard", ["c99", "c11", "c17"])
def test_header_in_every_standard(tmp_path, standard):
    """The registers' header compiles by itself, and no member may be stored byte by byte."""
    compiler = shutil.which("gcc") or pytest.skip("there is no C compiler here")
    size = 4 + max(register.address for register in motor_map.registers().values())
    source = f'#include "fluxproof_registers.h"\nint main(void) {{ return sizeof(fluxproof_t) != {size}; }}\n'
    (tmp_path / "main.c").write_text(source)
    command = [compiler, f"-std={standard}", "-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{SOFTWARE}"]
    done = subprocess.run([*command, "main.c", "-o", "main"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert subprocess.run([tmp_path / "main"]).returncode == 0
    assert "packed" not in (SOFTWARE / "fluxproof_registers.h").read_text()


def test_another_core_is_refused(drive, program):
    for change, message in (
        (lambda b: b.registers._constant.update(identification=1), "no Fluxproof core here"),
        (lambda b: b.registers._constant.update(version=0x990000), "core version 0x990000"),
        (
            lambda b: b.registers._constant.update(carrier_half=9),
            "CARRIER_HALF = 9, drive_registers.h is for 100",
        ),
        (lambda b: b.registers._constant.update(clock_hz=100_000_000), "CLOCK_HZ = 100000000, drive_registers.h"),
        (lambda b: b.registers._constant.update(estimators=0), "ESTIMATORS = 0, drive_registers.h is for 1"),
    ):
        board = GoldenBoard(drive, version_word())
        change(board)
        done = board.run(program)
        assert done.returncode == 1 and message in done.stderr, done.stderr
        assert board.number == 0 and board.registers.values["enable"] == 0


def test_failed_register_readback_is_reported(drive, program):
    board = GoldenBoard(drive, version_word())
    write = board.write

    def forgetful(address, word):
        return write(address, word ^ 4 if address == 0x150 else word)

    board.write = forgetful
    done = board.run(program)
    assert done.returncode == 1 and re.search(r"0x150 holds 0x[0-9a-f]+, wanted", done.stderr), done.stderr
    assert board.registers.values["enable"] == 0


def test_a_refused_register_is_named(drive, program):
    board = GoldenBoard(drive, version_word())
    board.write = lambda address, word: 2 if address == 0x170 else 0
    done = board.run(program)
    assert done.returncode == 1 and "refused" in done.stderr and "at 0x170" in done.stderr, done.stderr


@pytest.mark.parametrize(("looks", "status"), [(60, 0), (0, 1)])
def test_the_index_is_looked_for_before_the_encoder_is_believed(tmp_path, monkeypatch, looks, status):
    """With an A/B/Z encoder a field of the host's is turned until the index is there; without it the gates go off."""
    drive = drives.load(DRIVES / "servo_24v.toml")
    bus = ROOT / "cocotb_tests" / "support" / "host" / "bus_memory.c"
    program = compiled(tmp_path, drive, bus)
    monkeypatch.setenv("FLUXPROOF_INDEX_AFTER", str(looks))
    done = subprocess.run([program, "0"], capture_output=True, text=True)
    assert done.returncode == status, done.stdout + done.stderr
    assert ("index found" in done.stdout) == (status == 0)
    if status:
        assert "no index in 2.2 turns" in done.stderr


@pytest.mark.parametrize("number", [signal.SIGQUIT, signal.SIGHUP, signal.SIGSEGV], ids=lambda n: n.name)
@pytest.mark.parametrize("looks", [0, 60])
def test_a_signal_leaves_nothing_behind(tmp_path, monkeypatch, looks, number):
    """In the search of the index, too: the gates are off; the next run starts with the encoder's own angle."""
    drive = drives.load(DRIVES / "servo_24v.toml")
    program = compiled(tmp_path, drive, ROOT / "cocotb_tests" / "support" / "host" / "bus_memory.c")
    monkeypatch.setenv("FLUXPROOF_INDEX_AFTER", str(looks))
    monkeypatch.setenv("FLUXPROOF_SIGNAL", str(int(number)))
    done = subprocess.run([program, "0"], capture_output=True, text=True)
    assert done.returncode == 1 and "gates off" in done.stderr, done.stdout + done.stderr


def test_a_closed_output_does_not_leave_the_motor_running(tmp_path, monkeypatch):
    """`bring_up | head -3`."""
    drive = drives.load(DRIVES / "servo_24v.toml")
    program = compiled(tmp_path, drive, ROOT / "cocotb_tests" / "support" / "host" / "bus_memory.c")
    monkeypatch.setenv("FLUXPROOF_INDEX_AFTER", "60")
    running = subprocess.Popen([program, "0"], stdout=subprocess.PIPE)
    assert running.stdout
    running.stdout.close()
    assert running.wait(timeout=60) == 0


@pytest.mark.parametrize("references", [False, True])
def test_torque_in_newton_metres_with_and_without_the_table(tmp_path, monkeypatch, references):
    """The torque read back is the one asked for, the search of the index and a current leave the table out."""
    drive = drives.load(DRIVES / "servo_24v.toml")
    drive = dataclasses.replace(drive, core=dataclasses.replace(drive.core, references=references))
    program = compiled(tmp_path, drive, ROOT / "cocotb_tests" / "support" / "host" / "bus_memory.c")
    monkeypatch.setenv("FLUXPROOF_INDEX_AFTER", "60")
    for words, said in (("0.1 Nm 100", r"0\.100 Nm wanted, 0\.(100|099) Nm"), ("-0.1 Nm 100", r"-0\.(100|099) Nm est")):
        done = subprocess.run([program, *words.split()], capture_output=True, text=True)
        assert done.returncode == 0 and re.search(said, done.stdout), done.stdout + done.stderr
    done = subprocess.run([program, "2", "A", "100"], capture_output=True, text=True)
    assert done.returncode == 0 and "2.00 A wanted, i_q 2.00 A" in done.stdout, done.stdout + done.stderr
    done = subprocess.run([program, "1e4", "Nm", "100"], capture_output=True, text=True)
    assert done.returncode == 1 and "out of range" in done.stderr
