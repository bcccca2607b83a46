# SPDX-License-Identifier: BSD-3-Clause
"""Runs of the core in parallel with the golden model: the same run in Verilator and in GHDL, each in its own process.

A run is named by the function that makes it (see Named), so that the process that carries it out, a simulator's among
them, can make the same one.  It leaves three files in its folder: progress, result.npz and summary.json.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, Protocol

import numpy as np

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim import ghdl
from fluxproof.cosim.closed_loop import Device, GoldenPeriods, Result, cosimulate, run_now
from fluxproof.cosim.driven_plant import INPUT_PORTS, PlantPeriods, Scenario
from fluxproof.cosim.scenarios import SCENARIOS
from fluxproof.files import write_json
from fluxproof.plant import FREE, Machine, Sensors
from golden_model import drive as drives
from golden_model.fluxproof import Config
from golden_model.registers import RegisterSet, registers

FILES = ("progress", "result.npz", "summary.json")
Progress = Callable[[int, int], None]


class Run(Protocol):
    """A run of a device, compared with the golden model."""

    config: Config

    def __len__(self) -> int:
        """Periods."""
        ...

    async def on(self, device: Device, progress: Progress) -> Result:
        """Carry the run out."""
        ...


@dataclass(frozen=True)
class ClosedLoop:
    """A scenario in closed loop; the fields are the arguments of cosimulate."""

    drive: drives.Drive
    registers: RegisterSet
    scenario: Scenario
    machine: Machine | None = None
    ideal_inverter: bool = False
    sensors: Sensors | None = None
    mode: int = FREE

    @property
    def config(self) -> Config:
        return self.registers.config

    def __len__(self) -> int:
        return len(self.scenario)

    async def on(self, device: Device, progress: Progress) -> Result:
        return await cosimulate(
            device,
            self.drive,
            self.registers,
            self.scenario,
            progress,
            machine=self.machine,
            ideal_inverter=self.ideal_inverter,
            sensors=self.sensors,
            mode=self.mode,
        )


def closed_loop(drive_file: str, carrier_half: int, scenario: str, periods: int | None = None) -> ClosedLoop:
    """A scenario of cosim/scenarios.py, or its first ``periods``, on a drive of this file."""
    drive = drives.with_carrier(drives.load(Path(drive_file)), carrier_half)
    return ClosedLoop(drive, registers(drive), SCENARIOS[scenario](drive).first(periods))


class Named(NamedTuple):
    """A run by the function that makes it: "package.module:function" and its arguments, which JSON can hold."""

    function: str
    arguments: tuple = ()

    def make(self) -> Run:
        module, _, function = self.function.partition(":")
        return getattr(importlib.import_module(module), function)(*self.arguments)


def generics(config: Config) -> dict[str, int]:
    """The top's generics by their names in the VHDL."""
    return {name.upper(): value for name, value in config._asdict().items()}


def progress_in(folder: Path) -> Progress:
    """Writes how far a run is into the folder, fifty times at most."""

    def progress(done: int, total: int) -> None:
        if done % max(1, total // 50) == 0 or done == total:
            temporary = folder / ".progress"
            temporary.write_text(f"{done} {total}")
            os.replace(temporary, folder / "progress")

    return progress


async def carry_out(run: Run, device: Device, folder: Path) -> Result:
    """The run on the device; its result goes into the folder."""
    began = time.monotonic()
    result = await run.on(device, progress_in(folder))
    arrays: dict[str, Any] = {f"observed_{name}": values for name, values in result.observed.items()}
    arrays |= {f"plant_{name}": values for name, values in result.plant.items()}
    temporary = folder / ".result.npz"
    arrays |= {"samples": result.samples, "gate_edges": result.gate_edges}
    np.savez(temporary, **arrays)
    os.replace(temporary, folder / "result.npz")
    names = ("periods_compared", "differences", "first_difference", "sample_to_duty_clocks")
    counts = {name: getattr(result, name) for name in names}
    counts |= {"gate_edges": len(result.gate_edges), "seconds": round(time.monotonic() - began, 2)}
    write_json(folder / "summary.json", counts)
    return result


class Job:
    """One run on one engine and what became of it; ``name`` must be its own, it also names the folder in build/runs."""

    starts = "building"  # what it does before its first period

    def __init__(self, name: str, named: Named):
        self.name, self.named, self.run = name, named, named.make()
        self.total = len(self.run)
        self.folder = BUILD / "runs" / re.sub(r"\W+", "_", name)
        self.begun = False
        self.problem: str | None = None
        for file in FILES:  # nothing old may pass for new
            (self.folder / file).unlink(missing_ok=True)

    def carry_out(self) -> None:
        """Build what is not built yet and run; afterwards ``problem`` says what failed, or None."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.begun = True
        failed = self.work()
        different = self.summary().get("first_difference")
        self.problem = failed or different or (None if self.summary() else "it left no result")

    def work(self) -> str | None:
        """Carry the run out in another process; says what failed, or None."""
        raise NotImplementedError

    def done(self) -> int:
        """Periods carried out so far."""
        try:
            return int((self.folder / "progress").read_text().split()[0])
        except (OSError, ValueError, IndexError):  # not there yet
            return 0

    def summary(self) -> dict:
        """What the run counted; empty where it came to no end."""
        path = self.folder / "summary.json"
        return json.loads(path.read_text()) if path.exists() else {}

    def arrays(self) -> dict[str, np.ndarray]:
        """The run's values: observed_NAME, plant_NAME, samples and gate_edges."""
        with np.load(self.folder / "result.npz") as stored:
            return dict(stored)

    def result(self) -> SimpleNamespace:
        """``observed`` and ``plant``, each a dictionary of arrays, as in cosim.Result."""
        arrays = self.arrays()

        def part(kind: str) -> dict[str, np.ndarray]:
            return {name[len(kind) :]: values for name, values in arrays.items() if name.startswith(kind)}

        return SimpleNamespace(observed=part("observed_"), plant=part("plant_"))


class InVerilator(Job):
    """The RTL converted to Verilog and compiled."""

    def build(self) -> None:
        """Convert and compile ahead of the run; what does not build is reported by the run."""
        self.start()

    def start(self, *arguments: str) -> subprocess.CompletedProcess:
        """This module in another process, on the same run."""
        command = [sys.executable, "-m", __spec__.name, self.named.function, json.dumps(self.named.arguments)]
        return subprocess.run([*command, *arguments], cwd=ROOT, capture_output=True, text=True)

    def work(self) -> str | None:
        done = self.start(str(self.folder))
        (self.folder / "run.log").write_text(done.stdout + done.stderr)
        if done.returncode == 0:
            return None
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        return f"{lines[-1] if lines else 'it failed'}; see {os.path.relpath(self.folder, ROOT)}/run.log"


class InGhdl(Job):
    """The VHDL itself; all runs share one build."""

    @staticmethod
    def analyse() -> None:
        """Build the VHDL ahead of the first run; what does not build is reported by the run."""
        with contextlib.suppress(SystemExit, ghdl.BuildError):
            ghdl.build("fluxproof")

    def work(self) -> str | None:
        task = {"function": self.named.function, "arguments": self.named.arguments, "folder": str(self.folder)}
        module, environment = "fluxproof.cosim.dut_run", {"FLUXPROOF_RUN": json.dumps(task)}
        try:
            folder = ghdl.run("fluxproof", module, generics(self.run.config), environment, key=self.name)
        except (SystemExit, ghdl.BuildError) as error:  # no GHDL, or VHDL that does not build
            return str(error)
        failed = ghdl.failure(folder)
        return failed and failed.partition("\n")[0]


def kernels(part: str) -> Callable[[], object]:
    """A call that compiles the kernels ``golden`` or ``plant`` in another process, where they are not on disk yet."""

    def compile_them() -> None:
        subprocess.run([sys.executable, "-m", __spec__.name, part], cwd=ROOT, capture_output=True)

    compile_them.__name__ = f"kernels of the {part}"
    return compile_them


def compile_kernels(part: str) -> None:
    """Compile the golden model or the plant for runs to come; numba keeps both on disk for every process."""
    drive = drives.load(ROOT / "docs" / "drives" / "paper001.toml")
    if part == "golden":
        golden = GoldenPeriods(registers(drives.with_carrier(drive, 100)))
        golden.run(None, 1)
        golden.run(dict.fromkeys(INPUT_PORTS, 0), 1)
    else:
        loop = PlantPeriods(drive, SCENARIOS["short"](drive))
        loop.inputs(0)
        loop.advance(0, np.zeros(1), np.zeros(1, np.int64))


def main() -> None:
    """Carry a named run out in Verilator, in this process, or compile the kernels that runs need."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("function", help="package.module:function that makes the run; or golden or plant")
    parser.add_argument("arguments", nargs="?", type=json.loads, help="its arguments, a JSON array")
    parser.add_argument("folder", nargs="?", type=Path, help="where the result goes; without: build only")
    options = parser.parse_args()
    if options.arguments is None:
        compile_kernels(options.function)
        return
    from fluxproof.cosim.verilated_device import VerilatedDevice

    run = Named(options.function, tuple(options.arguments)).make()
    device = VerilatedDevice(run.config)
    if options.folder:
        options.folder.mkdir(parents=True, exist_ok=True)
        run_now(carry_out(run, device, options.folder))


if __name__ == "__main__":
    main()
