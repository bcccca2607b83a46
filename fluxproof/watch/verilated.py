# SPDX-License-Identifier: BSD-3-Clause
"""The RTL itself as a source: the core in Verilator drives the simulated motor, again and again the same quarter of a
second, and its samples leave as packets."""

from __future__ import annotations

import queue
import threading
import time

import numpy as np

from fluxproof.cosim.closed_loop import run_now
from fluxproof.cosim.driven_plant import INPUT_PORTS, PlantPeriods
from fluxproof.cosim.scenarios import everything
from fluxproof.cosim.verilated_device import VerilatedDevice
from golden_model import fluxproof
from golden_model.drive import Drive
from golden_model.io.telemetry_words import PACKET, pack
from golden_model.registers import RegisterSet

WAITING = 2000  # packets that wait for the reader; the simulation waits, too


class Verilated:
    """Runs in a thread of its own; begins with building the core, a minute the first time."""

    def __init__(self, drive: Drive, register_set: RegisterSet) -> None:
        self.drive, self.register_set, self.breaks = drive, register_set, 0
        self.made: queue.Queue[bytes] = queue.Queue(WAITING)
        self.ending, self.failure = threading.Event(), None
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def read(self) -> bytes:
        if self.failure is not None:
            raise self.failure
        parts = []
        while len(parts) < WAITING:
            try:
                parts.append(self.made.get_nowait())
            except queue.Empty:
                break
        if not parts:
            time.sleep(0.02)
        return b"".join(parts)

    def close(self) -> None:
        self.ending.set()

    def why_silent(self) -> str:
        return "the simulation has made no sample yet, expected one after some seconds: leave it more --seconds"

    def _run(self) -> None:
        try:
            while not self.ending.is_set():
                self._scene()
        except Exception as error:
            self.failure = error

    def _scene(self) -> None:
        """From a reset to the end of the scenario."""
        scenario = everything(self.drive)
        device, plant = VerilatedDevice(self.register_set.config), PlantPeriods(self.drive, scenario)
        run_now(device.start(self.register_set.values, int(scenario.enable[0])))
        for k in range(len(scenario)):
            inputs = plant.inputs(k)
            got = run_now(device.period(inputs, int(scenario.enable[k])))
            plant.advance(k, got.edge_clocks * (plant.period_s / got.clocks), got.gate_words)
            sample = fluxproof.Sample._make((*(inputs[name] for name in INPUT_PORTS), got.running))
            words = pack(k, sample._asdict() | {name: got.observed[name] for name in PACKET})
            self._give(np.array(words, "<u4").tobytes())
            if self.ending.is_set():
                return

    def _give(self, packet: bytes) -> None:
        """The packet to the reader; the simulation waits while it has too many."""
        while not self.ending.is_set():
            try:
                self.made.put(packet, timeout=0.2)
                return
            except queue.Full:
                continue
