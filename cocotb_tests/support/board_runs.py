"""The closed loop of a board as a run: start from standstill, a rotor that is off its index, a snapshot."""

from __future__ import annotations

import numpy as np

from cocotb_tests.support.board_loop import BoardLoop
from fluxproof.checkout import ROOT
from fluxproof.cosim.board_clock import STATUS
from fluxproof.golden_model.drive import load
from fluxproof.golden_model.formats import PU, TURN

DRIVE = ROOT / "docs" / "drives" / "paper001.toml"
RPM, BEFORE_INDEX = 600.0, 0.05  # rad of the shaft from the start to the index
SNAP_AT, TURNS_BACK = 110, 1200


def start_from_standstill() -> BoardLoop:
    """Enabled once the registers are written; 600 rpm; after 0.12 s to -600 rpm; a snapshot on the way."""
    drive = load(DRIVE)
    reference = PU.to_int(RPM * 2 * np.pi / 60 * drive.machine.pole_pairs / drive.bases.omega_me_rad_s)
    offset = TURN.to_int(drive.machine.pole_pairs * BEFORE_INDEX / (2 * np.pi))
    writes = {
        24: {"theta_offset": offset, "enable": 1},
        26: {"speed_mode": 1, "omega_ref": reference},
        SNAP_AT: {"take_snapshot": 1},
        TURNS_BACK: {"omega_ref": -reference},
    }
    return BoardLoop(drive, writes, theta_m=-BEFORE_INDEX)


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
