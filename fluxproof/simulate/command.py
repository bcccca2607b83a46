# SPDX-License-Identifier: BSD-3-Clause
"""The subcommand ``fluxproof simulate drive.toml [--out DIR]``: report.html and simulation.json.

Exit status: 0 stable and settled without a trip, 1 otherwise, with the reason in one line on stderr.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from fluxproof.diagnosis.whole_drive import load_drive, stated_plant
from fluxproof.files import refuse_overwriting, stem_of, write_json, write_text
from fluxproof.quote import say
from fluxproof.stage import together
from golden_model.drive_keys import DriveError

DATA, REPORT = "simulation.json", "report.html"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.add_argument("drive", metavar="drive.toml", help="the drive in SI units, see docs/drives/")
    parser.add_argument("--out", metavar="DIR", help="folder of the report; default build/simulate/NAME")


def run(args: argparse.Namespace) -> int:
    """Simulate, write both files, say the result."""
    began = time.monotonic()
    folder = Path(args.out) if args.out else Path("build") / "simulate" / stem_of(args.drive)
    refuse_overwriting([folder / DATA, folder / REPORT], [args.drive])
    drive = load_drive(args.drive)
    _say("loading the model")
    from fluxproof.simulate.session import simulate  # takes seconds, which a typing error should not wait for

    try:
        with together(folder, (DATA, REPORT)) as stage:
            data, pages = simulate(drive, Path(args.drive).name, _say, stated_plant(args.drive))
            write_json(stage / DATA, data)
            write_text(stage / REPORT, pages())
    except DriveError as error:
        _clear()
        raise DriveError(f"{args.drive}: {error}") from None
    _clear()
    for line in summary(data):
        say(line)
    say(f"{folder / REPORT} ({time.monotonic() - began:.1f} s)")
    if data["status"] != "ok":
        say(f"fluxproof: {args.drive}: {data['reason']}", sys.stderr)
        return 1
    return 0


def summary(data: dict) -> list[str]:
    """The result for the terminal."""
    lines = [f"{data['drive']}: {data['status'].replace('_', ' ')}: {data['reason']}"]
    for name, m in data["margins"].items():
        parts = (("crossover_hz", "Hz"), ("phase_margin_deg", "degrees"), ("gain_margin_db", "dB"))
        said = ", ".join("–" if m[key] is None else f"{m[key]:.4g} {unit}" for key, unit in parts)
        lines.append(f"  {name}: crossover, phase and gain margin {said}")
    told = {
        "Speed": ("speed_overshoot", "load_dip", "load_recovery"),
        "Currents": ("current_overshoot", "current_overshoot_at_top_speed", "peak_current", "ripple_peak_to_peak"),
        "Voltage and power": ("voltage_margin_at_rated_point", "power_fed_back_peak"),
        "Supply": (
            "energy_fed_back_at_once",
            "bus_voltage_highest",
            "bus_voltage_on_its_capacitor_alone",
            "brake_resistor_at_most",
            "brake_resistor_on_from",
        ),
        "Position": ("time_of_the_move", "following_error_largest", "position_error_at_the_end"),
        "Speed range": ("base_speed", "speed_with_torque_with_references", "speed_with_torque_at_i_d_zero"),
        "Trip at the top speed": ("speed_of_the_trip", "rectified_emf", "u_dc_high", "bus_voltage_after_the_trip"),
        "Heat": ("copper_loss_at_rated_current",),
    }
    for group, names in told.items():
        if group in data["figures"]:
            found = data["figures"][group]
            shown = ((name.replace("_", " "), found[name]) for name in names if name in found)
            lines.append("  " + ", ".join(f"{name} {_value(f)}" for name, f in shown))
    lines.append(f"  not modelled: {'; '.join(line.split(':')[0] for line in data['not_modelled'])}")
    return lines


def _value(figure: dict) -> str:
    return "–" if figure["value"] is None else f"{figure['value']:.4g} {figure['unit']}"


def _say(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\rsimulate: {text}\x1b[K", end="", file=sys.stderr, flush=True)


def _clear() -> None:
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)
