# SPDX-License-Identifier: BSD-3-Clause
"""The core in Verilator on the example's motor, as long as it is wanted, with three events; packets to the standard
output.

    python -m studies.live.core drive.toml --uio uio | telemetry_server - 5555 127.0.0.1 uio

A bench imposes the speeds of all operating points, again and again.  Each line on the standard input is the next event:
the machine's resistance rises; a line of the encoder is lost, so that the code steps to and fro at its place; one bit
of one packet is wrong; the end.  ``--uio``: a file in the place of the registers, in which first_fault stands.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import re
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fluxproof.cosim.closed_loop import FLAGS, run_now
from fluxproof.cosim.driven_plant import INPUT_PORTS, PlantPeriods
from fluxproof.cosim.verilated_device import VerilatedDevice
from fluxproof.diagnosis.example import motor
from fluxproof.plant import IMPOSED_SPEED, Inverter, Machine, SwitchingPlant
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.drive import Drive
from golden_model.generated.register_names import ADDRESSES
from golden_model.io.telemetry_words import LAYOUT, PACKET, pack
from golden_model.registers import registers

TURNS = 500  # of all operating points: more than any machine needs
EVENTS = "resistance", "line", "bit", "end"
RESISTANCE = 1.5  # times that of the drive file
WRONG_SIGNAL, WRONG_BIT = "i_d", 5
FIRST = FLAGS.index("first_fault")


def slow_drive(path: Path) -> Path:
    """The example's drive with a slow clock and ideal gates, written to ``path``: 500 clocks a period, not 20,000."""
    text = motor.DRIVE_FILE.read_text(encoding="utf-8")
    for key, value in (("clock_hz", "5e6"), ("dead_time_s", "1e-9")):
        text, count = re.subn(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE)
        if count != 1:
            raise ValueError(f"{motor.DRIVE_FILE}: {key} stands there {count} times")
    path.write_text(text, encoding="utf-8")
    return path


def send(drive: Drive, asked: Sequence[str], out, uio: Path) -> dict[str, int]:
    """Packets until as many lines as EVENTS are in ``asked``; the numbers of the samples at which each event began."""
    register_set, scenario = registers(drive), motor.scenario(drive, TURNS)
    described = Machine.from_mapping(vars(drive.machine))
    warm = dataclasses.replace(described, resistance_ohm=RESISTANCE * described.resistance_ohm)
    device = VerilatedDevice(register_set.config)
    plant = PlantPeriods(drive, scenario, machine=described, mode=IMPOSED_SPEED)
    run_now(device.start(register_set.values, 1))
    at: dict[str, int] = {}
    window, lost_code = bytearray(4096), 0
    for k in range(len(scenario)):
        due = EVENTS[: len(asked)]
        inputs = plant.inputs(k)
        plant.rows.clear()
        if "resistance" in due and "resistance" not in at:
            plant.plant.params = SwitchingPlant(warm, Inverter(), IMPOSED_SPEED).params
            at["resistance"] = k
        if "line" in due and "line" not in at and abs(scenario.load[k]) > 10.0:
            at["line"], lost_code = k, inputs["position_code"]
        if "line" in at:
            inputs["position_code"] = lost_code ^ (k & 1)
        got = run_now(device.period(inputs, 1))
        plant.advance(k, got.edge_clocks * (plant.period_s / got.clocks), got.gate_words)
        sample = fluxproof.Sample._make((*(inputs[name] for name in INPUT_PORTS), got.running))
        words = np.array(pack(k, sample._asdict() | {name: got.observed[name] for name in PACKET}), "<u4")
        if "bit" in due and "bit" not in at:
            at["bit"] = k
            words[LAYOUT[WRONG_SIGNAL].word] ^= 1 << WRONG_BIT
        if got.flags[FIRST] != window[ADDRESSES["first_fault"]]:
            window[ADDRESSES["first_fault"] : ADDRESSES["first_fault"] + 2] = got.flags[FIRST].to_bytes(2, "little")
            with open(uio, "r+b") as file:  # in its place: the server has mapped it
                file.write(window)
        out.write(words.tobytes())
        out.flush()
        if "end" in due:
            return at | {"end": k}
    raise RuntimeError(f"no end was asked for within {len(scenario)} samples")


def main() -> int:
    """Send and say on stderr at which samples the events were."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("drive", type=Path, help="the drive file that slow_drive wrote")
    parser.add_argument("--uio", type=Path, required=True)
    args = parser.parse_args()
    args.uio.touch()
    asked: list[str] = []
    threading.Thread(target=lambda: asked.extend(iter(sys.stdin.readline, "")), daemon=True).start()
    print(json.dumps(send(drives.load(args.drive), asked, sys.stdout.buffer, args.uio)), file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
