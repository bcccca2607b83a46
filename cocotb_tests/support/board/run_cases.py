# SPDX-License-Identifier: BSD-3-Clause
"""The closed loop of a board as a run: a start from standstill off the index; drive files with their own pins."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from cocotb_tests.support.board.loop_bench import BoardLoop, with_abz_and_spi
from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import DRIVES
from fluxproof.cosim.board_clock import STATUS
from fluxproof.cosim.fault_run import edges_run, serial_run
from golden_model.drive import load
from golden_model.formats import PU, TURN
from golden_model.io.board_faults import NAMES

DRIVE = PAPER
RPM, BEFORE_INDEX = 600.0, 0.05  # rad of the shaft from the start to the index
CARRIER_HALF = 250
SHORT_HALF = 80  # a frame of the converters and a sample fit into 160 clocks
SNAP_AT, TURNS_BACK = 110, 1200
HUB_PERIODS = 44
PART = 0.2  # of the rated speed


def start_from_standstill(carrier_half: int = CARRIER_HALF) -> BoardLoop:
    """Enabled once the registers are written and irq is cleared, the angle before the index being known here (no_index
    is ignored); 600 rpm; after 0.12 s to -600 rpm; a snapshot on the way."""
    drive = with_abz_and_spi(load(DRIVE), carrier_half)
    loop = BoardLoop(drive, {}, theta_m=-BEFORE_INDEX)
    reference = PU.to_int(RPM * 2 * np.pi / 60 * drive.machine.pole_pairs / drive.bases.omega_me_rad_s)
    offset = TURN.to_int(drive.machine.pole_pairs * BEFORE_INDEX / (2 * np.pi))
    loop.writes |= {
        loop.settled + 1: {"irq_clear": 15, "board_ignore": 1 << NAMES.index("no_index")},
        loop.settled + 2: {"theta_offset": offset, "enable": 1},
        loop.settled + 4: {"speed_mode": 1, "omega_ref": reference},
        SNAP_AT: {"take_snapshot": 1},
        TURNS_BACK: {"omega_ref": -reference},
    }
    return loop


def of_drive(
    name: str,
    clock_hz: float | None = None,
    periods: int = 400,
    omega_m: float = 0.0,
    ahead: float = 0.0,
    estimators: bool = True,
    trip_at: int | None = None,
) -> BoardLoop:
    """A drive file with its own front ends, all registers from the file: to PART of its rated speed, half-way back.

    ``clock_hz``: another clock of the core, for a file whose front ends take it.  ``omega_m`` [rad/s]: speed at the
    start, where the encoder is ``ahead`` of the rotor [mechanical rad], which theta_offset knows.  GHDL is much faster
    without ``estimators``.  ``trip_at``: period with a pulse of a clock at the trip pin.
    """
    drive = load(DRIVES / f"{name}.toml")
    if clock_hz is not None:
        drive = replace(drive, core=replace(drive.core, clock_hz=clock_hz))
    if drive.encoder.kind == "abz":  # the shaft stands at the index at the start
        drive = replace(drive, encoder=replace(drive.encoder, index_passes=1))
    offset = -drive.machine.pole_pairs * ahead % (2 * np.pi)
    drive = replace(drive, sensors=replace(drive.sensors, theta_offset_rad=offset))
    if not estimators:
        drive = replace(drive, core=replace(drive.core, estimators=False))
    loop = BoardLoop(drive, {}, theta_m=ahead, omega_m=omega_m)
    rated = drive.machine.rated_speed_rad_s * drive.machine.pole_pairs
    reference, begin = PU.to_int(PART * rated / drive.bases.omega_me_rad_s), loop.settled
    loop.writes |= {
        begin: {"telemetry_enable": 1},
        begin + 1: {"clear_encoder": 1},
        begin + 2: {"enable": 1},
        begin + 3: {"speed_mode": 1, "omega_ref": reference},
        begin + (2 * (periods - begin)) // 3: {"omega_ref": -reference},
    }
    if trip_at is not None:
        loop.trips[trip_at] = slice(150, 151)
    return loop


def before_the_index() -> BoardLoop:
    """Two passes of the index are asked for and the shaft stands: enabled, cleared again, then with a forced angle."""
    drive = with_abz_and_spi(load(DRIVE), SHORT_HALF)
    drive = replace(drive, encoder=replace(drive.encoder, index_passes=2))
    loop = BoardLoop(drive, {}, theta_m=-BEFORE_INDEX)
    at = loop.settled
    loop.writes |= {
        at + 1: {"enable": 1},
        at + 6: {"clear_trip": 1},
        at + 9: {"position_source": 1},
        at + 11: {"clear_trip": 1},
    }
    return loop


def clear_at_a_trip() -> BoardLoop:
    """Runs; each third period trips, and two later a write of clear_trip meets another pulse at the pin, a clock later
    each time; cleared at last.
    """
    loop = start_from_standstill(SHORT_HALF)
    at = loop.settled + 4
    for k in range(12):
        loop.writes[at + 3 * k] = {"clear_trip": 1}
        loop.trips[at + 3 * k] = slice(k, k + 1)
        loop.trips[at + 3 * k + 2] = slice(50, 51)
    loop.writes[at + 3 * 12 + 1] = {"clear_trip": 1}
    return loop


# Sectors forward: 101, 100, 110, 010, 011, 001 of the lines a, b, c
HALL_SPOILS = {"111 at enable": (1, 1, 1), "111": (1, 1, 1), "000": (0, 0, 0), "skipped": (0, 1, 1)}


def hall_spoiled(name: str, clock_hz: float = 8e6) -> BoardLoop:
    """The hub, enabled, with levels of its Hall sensors from a period on that they cannot have; "good": none."""
    drive = load(DRIVES / "hub_36v.toml")
    drive = replace(drive, core=replace(drive.core, clock_hz=clock_hz, estimators=False))
    loop = BoardLoop(drive, {}, theta_m=0.052 * 0.9)
    at = loop.settled
    begin = at - 2 if name == "111 at enable" else at + 6
    loop.writes |= {at: {"clear_encoder": 1}, at + 1: {"enable": 1}, at + 3: {"i_q_ext": PU.to_int(0.05)}}

    def spoil(number, inputs):
        if name in HALL_SPOILS and number >= begin:
            for x, level in zip("abc", HALL_SPOILS[name], strict=True):
                inputs[f"hall_{x}"][:] = level

    loop.spoil = spoil
    return loop


RUNS = {
    "faults, serial and modulators": serial_run,
    "faults, edges": edges_run,
    "before the index": before_the_index,
    "clear at a trip": clear_at_a_trip,
    **{f"Hall sensors: {name}": partial(hall_spoiled, name) for name in HALL_SPOILS},
    "standstill": start_from_standstill,
    "standstill, short periods": lambda: start_from_standstill(SHORT_HALF),
    # The shaft turns such that two edges of the Hall sensors come in time
    "hub_36v, slow clock": lambda: of_drive("hub_36v", 8e6, HUB_PERIODS, 38.0, 0.052, False, HUB_PERIODS - 1),
}


def first_difference(got: np.ndarray, wanted: np.ndarray, names, number: int) -> str | None:
    """What differs first in a chunk; None where nothing does."""
    if np.array_equal(got, wanted):
        return None
    row, column = np.argwhere(got != wanted)[0]
    pair = f"{got[row, column]} instead of {wanted[row, column]}"
    return f"period {number}, clock {row}: {names[column]} is {pair}"


def status(chunk) -> dict[str, int]:
    """The status registers of the front ends at a chunk's end."""
    return dict(zip(STATUS, chunk.status[-1].tolist(), strict=True))
