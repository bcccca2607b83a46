# SPDX-License-Identifier: BSD-3-Clause
"""What the page of `fluxproof watch` tells in a browser: hidden physics, a trip and a wrong bit, planted one by one.

The stream is the telemetry of the golden core on the example's motor, whose magnets, encoder and dead time its drive
file does not know.  Writes build/studies/live.png.
"""

from __future__ import annotations

import dataclasses
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.example import motor
from fluxproof.diagnosis.replay.capture import capture, packets
from fluxproof.plant import IMPOSED_SPEED
from golden_model import drive as drives
from golden_model.io.telemetry_words import COUNTER, LAYOUT
from golden_model.registers import registers
from studies.live.browser import TEXT, Browser

EVERY_S, PATIENCE_S = 5.0, 300.0
OFF_AT, WRONG_AT, WRONG_BIT = 500, 900, 3  # rows of the second part
HIDDEN = ("Dead time", "ncoder offset", "agnet flux")


def parts() -> tuple[np.ndarray, np.ndarray]:
    """Packets: a run over all operating points; then one whose gates go off, with a wrong bit behind."""
    drive = drives.load(motor.DRIVE_FILE)
    register_set, plan = registers(drive), motor.scenario(drive)
    options = {"mode": IMPOSED_SPEED, "machine": motor.machine(drive), "inverter": motor.inverter()}
    options |= {"sensors": motor.sensors(drive)}
    samples, observed, state = capture(drive, register_set, plan, **options)
    first = packets(samples, observed)
    off = dataclasses.replace(plan.first(WRONG_AT + 300))
    off.enable[OFF_AT:] = 0
    samples, observed, _ = capture(drive, register_set, off, state=state, **options)
    second = packets(samples, observed, len(first))
    second[WRONG_AT, LAYOUT["i_q"].word] ^= np.uint32(1 << WRONG_BIT)
    return first, second


def told(picture: Path) -> list[tuple[str, object, object, str, bool]]:
    """(figure, ours, target, unit, good) of every event."""
    first, second = parts()
    number = int(second[OFF_AT, LAYOUT[COUNTER].word])
    with socket.socket() as server, tempfile.TemporaryDirectory() as scratch:
        server.bind(("127.0.0.1", 0))
        server.listen(1)
        command = [sys.executable, "-m", "fluxproof", "watch", f"tcp://127.0.0.1:{server.getsockname()[1]}"]
        command += ["--drive", str(motor.DRIVE_FILE), "--port", "0", "--every", str(EVERY_S)]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None  # a pipe, see above
        client, _ = server.accept()
        try:
            url = child.stdout.readline().split()[-1]
            with client, Browser(url, Path(scratch)) as page:
                client.sendall(first.astype("<u4").tobytes())
                page.until(f"{TEXT}.includes('equal over {len(first):,}')", PATIENCE_S)
                page.until(f"/to sample \\d+: /.test({TEXT})", PATIENCE_S)
                page.picture(picture)
                said = page.js(TEXT)
                named = [name for name in HIDDEN if name in said]

                def event(rows: np.ndarray, text: str) -> float:
                    began = time.monotonic()
                    client.sendall(rows.astype("<u4").tobytes())
                    page.until(f"{TEXT}.includes('{text}')", PATIENCE_S)
                    return time.monotonic() - began

                gates = event(second[:WRONG_AT], f"sample {number}: gates off")
                wrong = int(second[WRONG_AT, LAYOUT[COUNTER].word])
                bit = event(second[WRONG_AT:], f"sample {wrong}, signal i_q, bit {WRONG_BIT}")
        finally:
            child.terminate()
            child.wait()
    return [
        ("page: hidden differences named", len(named), len(HIDDEN), "1", len(named) == len(HIDDEN)),
        ("page: a trip is told after", round(gates, 2), 0.5, "s", gates <= 0.5),
        ("page: a wrong bit is told after", round(bit, 2), 0.5, "s", bit <= 0.5),
    ]
