# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of a healthy drive with one mistake of convention each, in the recording or in the drive file.

MISTAKES: {name: Mistake}.  A log has phase currents and duties, or, for mistakes of dq quantities, the currents and
voltages of the drive's own dq frame.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pandas as pd
import tomlkit

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import DRIVE, DWELL, GRID, RAMP, columns

PHASES = ("i_a", "i_b", "i_c")
DUTIES = ("d_a", "d_b", "d_c")
PAIRS = DRIVE.machine.pole_pairs
TURNS = np.exp(2j * np.pi / 3 * np.arange(3))


@dataclasses.dataclass(frozen=True)
class Mistake:
    """found: codes of the conventions that must be told, or words of the finding of a check; may be told as a rival.

    log: function of the columns that makes the mistake; file: {key of the drive file: factor}; dq: a dq log.
    """

    found: str
    log: object = None
    file: dict = dataclasses.field(default_factory=dict)
    dq: bool = False


def scaled(names, factor):
    """The columns of ``names`` times a factor."""
    return lambda c: {**c, **{n: c[n] * factor for n in names if n in c}}


def moved(names, source):
    """Columns exchanged: ``names`` take the values of ``source``."""
    return lambda c: {**c, **{n: c[s] for n, s in zip(names, source, strict=True)}}


def turned(radians):
    return lambda c: {**c, "theta_e": np.mod(c["theta_e"] + radians, 2 * np.pi)}


def frame(radians):
    """Currents and voltages in a dq frame that is ahead of the rotor's."""
    turn = np.exp(-1j * radians)

    def change(c):
        pairs = [(d, q, (c[d] + 1j * c[q]) * turn) for d, q in (CURRENTS_DQ, VOLTAGES_DQ)]
        return {**c, **{d: z.real for d, _, z in pairs}, **{q: z.imag for _, q, z in pairs}}

    return change


def of_the_shaft(factor=1.0):
    """The mechanical angle [rad times factor], which passes through a turn once in pole_pairs electrical turns."""
    return lambda c: {**c, "theta_e": np.mod(np.unwrap(c["theta_e"]) / PAIRS, 2 * np.pi) * factor}


def all_of(*changes):
    def change(c):
        for one in changes:
            c = one(c)
        return c

    return change


CURRENTS_DQ, VOLTAGES_DQ = ("i_d", "i_q"), ("u_d_ref", "u_q_ref")
ROOT2, ROOT3, POWER = math.sqrt(2.0), math.sqrt(3.0), math.sqrt(1.5)
RL = ("resistance_ohm", "inductance_d_h", "inductance_q_h")
MISTAKES = {
    # the recording
    "currents in rms": Mistake("currents_rms", scaled(PHASES, 1 / ROOT2)),
    "currents peak to peak": Mistake("currents_double", scaled(PHASES, 2.0)),
    "currents at half": Mistake("currents_half", scaled(PHASES, 0.5)),
    "dq currents in rms": Mistake("currents_rms", scaled(CURRENTS_DQ, 1 / ROOT2), dq=True),
    "dq currents power-invariant": Mistake("currents_power_invariant", scaled(CURRENTS_DQ, POWER), dq=True),
    "dq currents and voltages power-invariant": Mistake(
        "dq_power_invariant", scaled((*CURRENTS_DQ, *VOLTAGES_DQ), POWER), dq=True
    ),
    "dq voltages in rms": Mistake("voltages_rms", scaled(VOLTAGES_DQ, 1 / ROOT2), dq=True),
    "dq voltages line to line": Mistake("voltages_line", scaled(VOLTAGES_DQ, ROOT3), dq=True),
    "dq voltages line to line in rms": Mistake("voltages_line_rms", scaled(VOLTAGES_DQ, ROOT3 / ROOT2), dq=True),
    "currents and voltages in rms": Mistake("dq_rms", scaled((*CURRENTS_DQ, *VOLTAGES_DQ), 1 / ROOT2), dq=True),
    "angle in degrees": Mistake("degrees", scaled(("theta_e",), 180 / np.pi)),
    "angle of the shaft": Mistake("rad of the shaft", of_the_shaft()),
    "angle of the shaft in degrees": Mistake("degrees of the shaft", of_the_shaft(180 / np.pi)),
    "speed of the shaft": Mistake("rad/s of the shaft", scaled(("omega_e",), 1 / PAIRS)),
    "speed in rpm": Mistake("rpm of the shaft", scaled(("omega_e",), 30 / np.pi / PAIRS)),
    "duties in percent": Mistake("percent", scaled(DUTIES, 100.0)),
    "currents in mA": Mistake("mA", scaled(PHASES, 1000.0)),
    "currents b and c swapped": Mistake("b and c are swapped", moved(("i_b", "i_c"), ("i_c", "i_b"))),
    "duties b and c swapped": Mistake("b and c are swapped", moved(("d_b", "d_c"), ("d_c", "d_b"))),
    "currents in the order b, c, a": Mistake("order", moved(PHASES, ("i_b", "i_c", "i_a"))),
    "currents with the opposite sign": Mistake("opposite sign", scaled(PHASES, -1.0)),
    "angle against the currents": Mistake("rotates against", scaled(("theta_e", "omega_e"), -1.0)),
    "d and q swapped": Mistake(
        "axes", moved((*CURRENTS_DQ, *VOLTAGES_DQ), (*CURRENTS_DQ[::-1], *VOLTAGES_DQ[::-1])), dq=True
    ),
    "i_q with the opposite sign": Mistake("the speed has the wrong sign", scaled(("i_q", "u_q_ref"), -1.0), dq=True),
    "speed with the opposite sign": Mistake("the speed has the wrong sign", scaled(("omega_e",), -1.0), dq=True),
    "d axis with the opposite sign": Mistake(
        "i_d and u_d_ref have the opposite sign", scaled(("i_d", "u_d_ref"), -1.0), dq=True
    ),
    "dq currents with the opposite sign": Mistake(
        "i_d and i_q have the opposite sign", scaled(CURRENTS_DQ, -1.0), dq=True
    ),
    "i_d alone with the opposite sign": Mistake("i_d has the opposite sign", scaled(("i_d",), -1.0), dq=True),
    "i_q alone with the opposite sign": Mistake("i_q has the opposite sign", scaled(("i_q",), -1.0), dq=True),
    "u_q alone with the opposite sign": Mistake("u_q_ref has the opposite sign", scaled(("u_q_ref",), -1.0), dq=True),
    "i_d and i_q swapped": Mistake("i_d and i_q are swapped", moved(CURRENTS_DQ, CURRENTS_DQ[::-1]), dq=True),
    "u_d and u_q swapped": Mistake("u_d_ref and u_q_ref are swapped", moved(VOLTAGES_DQ, VOLTAGES_DQ[::-1]), dq=True),
    "dq voltages at half": Mistake("voltages_half", scaled(VOLTAGES_DQ, 0.5), dq=True),
    "dq currents in mA": Mistake("mA", scaled(CURRENTS_DQ, 1000.0), dq=True),
    "frame of the q axis": Mistake("angle_90", frame(np.pi / 2), dq=True),
    "frame 120 degrees behind": Mistake("angle_minus_120", frame(-2 * np.pi / 3), dq=True),
    "angle of the q axis": Mistake("angle_90", turned(np.pi / 2)),
    "angle 90 degrees behind": Mistake("angle_minus_90", turned(-np.pi / 2)),
    "angle 60 degrees ahead": Mistake("angle_60", turned(np.pi / 3)),
    "angle 120 degrees behind": Mistake("in the order b, c, a", turned(-2 * np.pi / 3)),
    "angle 180 degrees off": Mistake("angle_180", turned(np.pi)),
    "angle 30 degrees ahead": Mistake("angle_30", turned(np.pi / 6)),
    "bus at half": Mistake("bus_half", scaled(("u_dc",), 0.5)),
    # the drive file
    "R and L line to line": Mistake("machine_line_rl", file=dict.fromkeys(RL, 2.0)),
    "R line to line": Mistake("resistance_line", file={"resistance_ohm": 2.0}),
    "L line to line": Mistake("inductances_line", file=dict.fromkeys(RL[1:], 2.0)),
    "psi line to line": Mistake("psi_line", file={"magnet_flux_wb": ROOT3}),
    "psi in rms": Mistake("psi_rms", file={"magnet_flux_wb": 1 / ROOT2}),
    "psi line to line in rms": Mistake("psi_line_rms", file={"magnet_flux_wb": ROOT3 / ROOT2}),
    "psi per turn of the shaft": Mistake("psi_of_shaft", file={"magnet_flux_wb": PAIRS}),
    "psi per turn of the shaft, line to line in rms": Mistake(
        "psi_line_rms_of_shaft", file={"magnet_flux_wb": PAIRS * POWER}
    ),
    "psi per 1000 rpm, line to line in rms": Mistake(
        "psi_line_rms_krpm", file={"magnet_flux_wb": PAIRS * POWER * 1000 / 60 * 2 * math.pi}
    ),
    "psi as Nm per A rms": Mistake("psi_torque_rms", file={"magnet_flux_wb": 1.5 * PAIRS * ROOT2}),
    "psi in mWb": Mistake("psi_milli", file={"magnet_flux_wb": 1e3}),
    "L in mH": Mistake("inductances_milli", file=dict.fromkeys(RL[1:], 1e3)),
    "R in milliohm": Mistake("resistance_milli", file={"resistance_ohm": 1e3}),
    "R, L and psi line to line": Mistake(
        "machine_line", file={**dict.fromkeys(RL, 2.0), "magnet_flux_wb": ROOT3}
    ),
    "poles for pole pairs, angle of the shaft": Mistake("pole_pairs", of_the_shaft(), {"pole_pairs": 2}),
    "half the pole pairs, angle of the shaft": Mistake("pole_pairs", of_the_shaft(), {"pole_pairs": 0.5}),
    "sample time twice": Mistake("sample_time_s", file={"sample_time_s": 2.0}),
    "sample time half": Mistake("sample_time_s", file={"sample_time_s": 0.5}),
    # two at once
    "R and L line to line, currents in rms": Mistake(
        "machine_line_rl currents_rms", scaled(PHASES, 1 / ROOT2), dict.fromkeys(RL, 2.0)
    ),
}  # fmt: skip


def dq_log(c) -> dict:
    """The columns as the drive itself logs them: dq currents, and references valid in the middle of their period."""
    turn = np.exp(1j * c["theta_e"])
    i = 2 / 3 * sum(c[n] * t for n, t in zip(PHASES, TURNS, strict=True)) / turn
    duties = 2 / 3 * sum(c[n] * t for n, t in zip(DUTIES, TURNS, strict=True))
    ahead = c["omega_e"] * DRIVE.sample_time_s * (DRIVE.control.duty_applied_after_samples + 0.5)
    u = duties * c["u_dc"] / turn * np.exp(-1j * ahead)
    log = {n: c[n] for n in ("t", "theta_e", "omega_e", "u_dc")}
    return {**log, "i_d": i.real, "i_q": i.imag, "u_d_ref": u.real, "u_q_ref": u.imag}


def written(mistake, folder, deviations=None):
    """(recording, drive file) of a mistake in a folder; deviations: of ``columns``, for a drive that is not healthy."""
    c = dict(columns(GRID, **(deviations or {})))
    c = dq_log(c) if mistake.dq else c
    c = mistake.log(c) if mistake.log else c
    recording, drive = folder / "recording.parquet", folder / "drive.toml"
    pd.DataFrame(c).to_parquet(recording)
    document = tomlkit.parse(PAPER.read_text())
    for key, factor in mistake.file.items():
        section = next(s for s in ("machine", "control", "inverter") if key in document[s])
        value = float(document[section][key]) * factor
        document[section][key] = int(value) if key == "pole_pairs" else value
    drive.write_text(tomlkit.dumps(document))
    return recording, drive


def table_of(recording, path):
    """A table with one row for each operating point of a written dq log, without a time."""
    log, rows = pd.read_parquet(recording), RAMP + DWELL
    points = [log.iloc[k * rows + RAMP + 250 : (k + 1) * rows - 20].mean() for k in range(len(GRID))]
    pd.DataFrame(points)[["i_d", "i_q", "u_d_ref", "u_q_ref", "omega_e", "u_dc"]].to_csv(path, index=False)
    return path
