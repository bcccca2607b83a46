# SPDX-License-Identifier: BSD-3-Clause
"""The situations: a row each, with the drives and speeds it is tried on; a new one is a function and a row of TABLE.

A situation takes a drive and a part of the rated speed, and returns (what was seen, whether it is what is wanted).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from fluxproof.checkout import DRIVES
from fluxproof.cosim.axi_clock import writes_in
from fluxproof.cosim.board_clock import PINS
from fluxproof.cosim.fault_run import FaultRun, edges_run, serial_run
from golden_model.drive import Drive, load, with_carrier
from golden_model.drive_keys import needed
from golden_model.io import board_faults, fault_latch
from golden_model.registers import registers
from studies.rough.board import RoughBoard
from studies.rough.rtl import Beside

CARRIER_HALF = 250
PEAK, WRONG_WAY_DEG = 1.5, 10.0  # of the current limit; of the shaft against the direction
BEFORE_INDEX, LOADING = 0.1, 40  # rad of the shaft; periods in which the registers are loaded
EDGES, ABSOLUTE = ("servo_24v",), ("drone_24v", "spindle_400v", "paper001", "emrax228")
HALLS = ("hub_36v",)
SPEEDS = (0.03, 0.1, 0.3, 0.8)
ALLOWED_S = {0.03: 0.05, 0.1: 0.005, 0.3: 0.005, 0.8: 0.005}  # until a lost encoder is named
HALL_ALLOWED_S = 0.1  # an edge tells the speed
SILENT = 20  # periods without a write
BACKWARD_ALLOWED_S = 0.6  # stall_s, and the way of the slowest speed regulator to the current limit
UNSEEN_ALLOWED_S = 0.15  # the same where emf_check cannot see the EMF: stall_s, and the way to the current limit


class Situation(NamedTuple):
    """A row: its name, what is wanted in words, the drives, the parts of the rated speed, the function."""

    name: str
    wanted: str
    drives: tuple[str, ...]
    speeds: tuple[float, ...]
    play: Callable[[Drive, float], tuple[str, bool]]


def drive_of(name: str, passes: int = 1) -> Drive:
    """The drive file at a slow clock; its index is believed at the first pass unless the situation is about that."""
    drive = load(DRIVES / f"{name}.toml")
    if drive.machine.inertia_kgm2 <= 0.0:
        drive = replace(drive, machine=replace(drive.machine, inertia_kgm2=1e-2))
    drive = with_carrier(drive, CARRIER_HALF)
    return replace(drive, encoder=replace(drive.encoder, index_passes=passes)) if drive.encoder.kind == "abz" else drive


def verdict(board: RoughBoard, names: tuple[str, ...], within_s: float | None = None, since: int = 0):
    """(seen, good): a fault of these names, in time, below the peak, and not far the wrong way."""
    took = None if board.fault_period is None else (board.fault_period - since + 1) * board.drive.sample_time_s
    peak, back = board.peak_a / board.drive.current_limit_a, -math.degrees(board.farthest[0])
    good = bool(set(board.faults) & set(names)) and board.tripped and peak < PEAK and back < WRONG_WAY_DEG
    good = good and (within_s is None or (took is not None and took <= within_s))
    named = ", ".join(board.faults) or "no fault"
    late = "" if took is None or within_s is None else f" after {took * 1e3:.1f} ms"
    return f"{named}{late}, peak {peak:.2f} of the limit, {board.gates_on} clocks with gates on", good


def running(drive: Drive, part: float) -> RoughBoard:
    """A healthy drive in speed mode at a part of the rated speed, the shaft turning through its index before."""
    omega = max(part, SPEEDS[0]) * drive.machine.rated_speed_rad_s
    before = BEFORE_INDEX + omega * LOADING * drive.sample_time_s
    board = RoughBoard(drive, theta_m=-before, omega_m=omega)
    board.run(LOADING + round(1.5 * BEFORE_INDEX / omega / drive.sample_time_s), clear_encoder=1)
    turns = drive.machine.pole_pairs * before / (2 * math.pi)
    board.run(3, theta_offset=round(turns * 2**18) % 2**18, speed_mode=1, omega_ref=board.speed(part))
    board.run_s(0.02, enable=1)
    board.farthest = [0.0, 0.0]
    return board


def healthy(drive: Drive, part: float) -> tuple[str, bool]:
    board = running(drive, part)
    board.run_s(0.05)
    return f"{', '.join(board.faults) or 'no fault'}, {board.gates_on} clocks with gates on", not board.faults


def before_the_index(drive: Drive, _part: float) -> tuple[str, bool]:
    board = RoughBoard(drive, theta_m=-BEFORE_INDEX)
    board.run(80, speed_mode=1, omega_ref=board.speed(0.1))
    board.run_s(0.02, enable=1)
    seen, good = verdict(board, ("no_index",))
    return seen, good and board.gates_on == 0


def stuck_z(level: int):
    def play(drive: Drive, _part: float) -> tuple[str, bool]:
        omega = 0.3 * drive.machine.rated_speed_rad_s
        board = RoughBoard(drive, theta_m=-BEFORE_INDEX, omega_m=omega)
        board.spoil = lambda pins, board: pins["pin_z"].__setitem__(slice(None), level)
        board.run(round(2.2 * 2 * math.pi / omega / drive.sample_time_s))
        board.run_s(0.005, enable=1)
        seen, good = verdict(board, ("no_index",))
        return seen, good and board.gates_on == 0

    return play


def spike(drive: Drive, _part: float) -> tuple[str, bool]:
    """A pulse of 300 ns on Z at rest, in the phase of the index."""
    board = RoughBoard(drive, theta_m=100.3 / needed(drive.encoder.counts) * 2 * math.pi)
    clocks = max(round(300e-9 * board.clock_hz), 5)

    def spoil(pins, board):
        if board.period == 40:
            pins["pin_z"][100 : 100 + clocks] = 1

    board.spoil = spoil
    board.run(60)
    board.run_s(0.005, enable=1)
    seen, good = verdict(board, ("no_index",))
    return seen, good and board.gates_on == 0


def index_twice(drive: Drive, _part: float) -> tuple[str, bool]:
    """Two turns by hand, then enabled."""
    omega = 0.5 * drive.machine.rated_speed_rad_s
    board = RoughBoard(drive, theta_m=-BEFORE_INDEX, omega_m=omega)
    board.run(round(1.3 * 2 * math.pi / omega / drive.sample_time_s))
    offset = drive.machine.pole_pairs * BEFORE_INDEX / (2 * math.pi) * 2**18
    board.run(4, theta_offset=round(offset) % 2**18, speed_mode=1, omega_ref=board.speed(0.5))
    board.run_s(0.02, enable=1)
    return f"{', '.join(board.faults) or 'no fault'}, referenced {board.referenced}", (
        board.referenced and not board.faults and board.gates_on > 0
    )


def held(board: RoughBoard) -> None:
    """From the next period on the encoder shows what it shows now."""
    kept: dict[str, int] = {}

    def spoil(pins, _board):
        for name in ("pin_a", "pin_b", "pin_z", "hall_a", "hall_b", "hall_c", "position_in"):
            kept.setdefault(name, int(pins[name][0]))
            pins[name][:] = kept[name]

    board.spoil = spoil


def dead(board: RoughBoard) -> None:
    """From the next period on all lines are 0."""

    def spoil(pins, _board):
        for name in ("pin_a", "pin_b", "pin_z"):
            pins[name][:] = 0

    board.spoil = spoil


def below_the_emf_check(drive: Drive, part: float) -> bool:
    """Whether the EMF of this speed is smaller than emf_check's limit without a current.

    A field that stands with the frozen code then holds the rotor before its EMF contradicts: what is left is the stall,
    as soon as the speed regulator has come to the current limit.
    """
    m, si = drive.machine, {row.name: row.si for row in registers(drive).rows}
    omega = part * m.pole_pairs * m.rated_speed_rad_s
    return m.magnet_flux_wb * omega < si["emf_min"] + si["emf_w"] * omega


def lost(how: Callable[[RoughBoard], None], names: tuple[str, ...]):
    def play(drive: Drive, part: float) -> tuple[str, bool]:
        board = running(drive, part)
        if board.faults:
            return f"{', '.join(board.faults)} before the encoder is lost", False
        since = board.period
        how(board)
        board.until_off(UNSEEN_ALLOWED_S)
        allowed = HALL_ALLOWED_S if drive.encoder.kind == "hall" else ALLOWED_S[part]
        board.farthest[0] = 0.0  # at this speed nothing turns the wrong way
        if below_the_emf_check(drive, part):
            seen, good = verdict(board, (*names, "stall"), UNSEEN_ALLOWED_S, since)
            return seen, good or (not board.faults and board.peak_a < drive.current_limit_a)
        return verdict(board, names, allowed, since)

    return play


def counts_backward(drive: Drive, part: float) -> tuple[str, bool]:
    """An encoder that counts the wrong way, from rest: the field turns away from the rotor, which trembles."""
    board = RoughBoard(drive, theta_m=BEFORE_INDEX)
    reverse = 1 - board.set.values.reverse
    board.run(LOADING, speed_mode=1, omega_ref=board.speed(part), reverse=reverse)
    board.run(1, enable=1)
    board.until_off(BACKWARD_ALLOWED_S)
    return verdict(board, ("stall", "encoder_lost"), BACKWARD_ALLOWED_S, LOADING)


def hall_levels(levels: tuple[int | None, ...], enabled: bool):
    """Levels of the three lines, None: as the sensor shows it; from before the enable on, or while it runs."""

    def play(drive: Drive, part: float) -> tuple[str, bool]:
        def spoil(pins, _board):
            for x, level in zip("abc", levels, strict=True):
                if level is not None:
                    pins[f"hall_{x}"][:] = level

        if enabled:
            board = running(drive, part)
            if board.faults:
                return f"{', '.join(board.faults)} before", False
            board.spoil = spoil
            board.until_off(0.3)
            board.farthest[0] = 0.0
            return verdict(board, ("hall_code", "position"))
        board = RoughBoard(drive)
        board.spoil = spoil
        board.run(80)
        board.run_s(0.005, enable=1)
        seen, good = verdict(board, ("hall_code",))
        return seen, good and board.gates_on == 0

    return play


def trip_and_clear(drive: Drive, _part: float) -> tuple[str, bool]:
    """Tripped by the pin; then a pulse at each of 12 clocks from the begin of a write of clear_trip on."""
    board = running(drive, 0.0)
    ran = bool(board.golden.state.wires.running)
    unseen = 0
    for at in range(12):
        board.spoil = lambda pins, board: pins["trip"].__setitem__(slice(300, 301), 1)
        board.run(1)
        board.spoil = lambda pins, board, at=at: pins["trip"].__setitem__(slice(at, at + 1), 1)
        board.run(1, clear_trip=1)
        board.spoil = lambda pins, board: None
        board.run(2)
        unseen += not board.tripped
    board.run(4, clear_trip=1)
    return f"{unseen} of 12 trips cleared unseen", ran and unseen == 0 and not board.tripped


def silent_host(drive: Drive, part: float) -> tuple[str, bool]:
    """The host writes once more and then no longer than the heartbeat; it is named, and the gates go off."""
    board = running(drive, part)
    board.run(1, heartbeat=SILENT)
    board.run_s(0.0, clear_encoder=0)
    early, since = board.tripped, board.period - 1
    board.run(2 * SILENT)
    seen, good = verdict(board, ("host_lost",), (SILENT + 2) * drive.sample_time_s, since)
    return seen, good and not early


def written_at_speed(drive: Drive, part: float) -> tuple[str, bool]:
    """Still settings far from theirs while the drive runs: refused, and it runs on; with the gates off one is taken."""
    board = running(drive, part)
    values = board.golden.registers.values
    wrong = {"reverse": 1 - values["reverse"], "k_u_max": values["k_u_max"] // 2, "k_delay": 0, "gain_a": 0}
    wrong |= {"pole_pairs": values["pole_pairs"] % 63 + 1, "dead_time": 1, "min_pulse": 2, "position_source": 1}
    for name, value in wrong.items():
        board.run(1, **{name: value})
    board.run_s(0.01)
    refused, ran = board.golden.refused[:], not board.faults and bool(board.golden.state.wires.running)
    board.run(2, enable=0)
    board.run(2, k_delay=0)
    taken = values["k_delay"] == 0 and board.golden.refused == refused
    return f"{len(refused)} of {len(wrong)} refused, {', '.join(board.faults) or 'no fault'}", (
        refused == list(wrong) and ran and taken
    )


def scripted(make: Callable[[], FaultRun], names: frozenset[str]):
    """The script of fluxproof/cosim/fault_run.py, without a motor: all of these faults trip in their turn."""

    def play(_drive: Drive, _part: float) -> tuple[str, bool]:
        run, found = make(), set()
        rtl = None if RoughBoard.watched is None else Beside(run.golden)
        if RoughBoard.watched is not None and rtl is not None:
            RoughBoard.watched.append(rtl)
        for chunk in run.run(run.periods):
            if rtl is not None:
                rtl.period({name: chunk.inputs[name] for name in PINS}, writes_in(chunk.inputs), chunk.seen)
            state = run.golden.state
            for of, first in ((board_faults, state.of_faults.first), (fault_latch, state.of_core.of_fault_latch.first)):
                found |= {name for k, name in enumerate(of.NAMES) if first >> k & 1}
        return ", ".join(sorted(found)), names <= found

    return play


ALL = (*EDGES, *HALLS, *ABSOLUTE)
LOST = ("encoder_lost", "position")
NAMED = "encoder_lost or position in 5 ms, in 50 ms at 3 %; where emf_check cannot see the EMF: or stall in 150 ms, or"
NAMED += " less than the current limit"
TABLE = (
    Situation("healthy", "no fault", ALL, (0.0, *SPEEDS), healthy),
    Situation("enabled before the index", "no_index, gates never on", EDGES, (0.0,), before_the_index),
    Situation("index dead, two turns by hand", "no_index, gates never on", EDGES, (0.3,), stuck_z(0)),
    Situation("Z stuck at 1, two turns by hand", "no_index, gates never on", EDGES, (0.3,), stuck_z(1)),
    Situation("spike of 300 ns on Z at rest", "no_index, gates never on", EDGES, (0.0,), spike),
    Situation("index met twice", "runs", EDGES, (0.5,), index_twice),
    Situation("A and B frozen", NAMED, EDGES, SPEEDS, lost(held, LOST)),
    Situation("all lines of A/B/Z dead", NAMED, EDGES, SPEEDS, lost(dead, LOST)),
    Situation("code frozen", NAMED, ABSOLUTE, SPEEDS, lost(held, LOST)),
    Situation("counts the wrong way", "stall or encoder_lost in 0.6 s", ABSOLUTE, (0.3,), counts_backward),
    Situation("Hall sensors frozen", "encoder_lost in 100 ms", HALLS, (0.3, 0.8), lost(held, ("encoder_lost",))),
    Situation("Hall code 111 at the enable", "hall_code, gates never on", HALLS, (0.0,), hall_levels((1, 1, 1), False)),
    Situation("Hall code 000 at the enable", "hall_code, gates never on", HALLS, (0.0,), hall_levels((0, 0, 0), False)),
    Situation("Hall code 111", "hall_code", HALLS, (0.0, 0.25, 0.8), hall_levels((1, 1, 1), True)),
    Situation("one Hall sensor at 0", "hall_code", HALLS, (0.25, 0.8), hall_levels((0, None, None), True)),
    Situation("one Hall sensor at 1", "hall_code", HALLS, (0.25, 0.8), hall_levels((None, 1, None), True)),
    Situation("a trip at a write of clear_trip", "stays off", ("servo_24v", "spindle_400v"), (0.0,), trip_and_clear),
    Situation(
        "a script: SSI encoder silent, fast overcurrent, host, trip",
        "each named",
        ("spindle_400v",),
        (0.0,),
        scripted(serial_run, frozenset(("position_lost", "converter_over", "host_lost", "trip"))),
    ),
    Situation(
        "a script: index wrong and lost, host, trip",
        "each named",
        ("servo_24v",),
        (0.0,),
        scripted(edges_run, frozenset(("index_wrong", "host_lost", "trip"))),
    ),
    Situation("settings written that need the gates off", "refused, runs on", ALL, (0.6,), written_at_speed),
    Situation("the host is silent", "host_lost in the heartbeat's time", ALL, (0.3,), silent_host),
)
PASSES = {"enabled before the index": 2, "index dead, two turns by hand": 2, "Z stuck at 1, two turns by hand": 2,
          "spike of 300 ns on Z at rest": 2, "index met twice": 2}  # fmt: skip
