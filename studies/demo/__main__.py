"""`make demo`: Fig. 9 of paper 001 with the VHDL in the loop, and a real recording through the same core.

Two simulations run side by side in GHDL, the golden model beside each.  Writes build/demo/summary.json,
the figures and report.html.  Exit status: 0 equal in every bit, 1 where anything differs or fails.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time
from pathlib import Path

import numpy as np

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim import dut_replay, ghdl
from fluxproof.cosim.scenarios import fig9
from fluxproof.files import write_json
from fluxproof.golden_model import drive as drives
from fluxproof.golden_model.registers import registers
from studies.demo import plots, report

DEMO, DRIVES = BUILD / "demo", ROOT / "docs" / "drives"
LOOP_CARRIER, REPLAY_CARRIER = 1000, 100  # clocks in half a PWM period: GHDL pays by the clock
LEAST_PERIODS = 2000


class Simulation(threading.Thread):
    """One run of the core in GHDL: ``total`` periods of a drive under a cocotb module."""

    def __init__(self, name, drive_file: str, carrier_half: int, module: str, total: int, **environment: str):
        super().__init__(name=name, daemon=True)
        self.drive_file, self.module, self.total = drive_file, f"cocotb_tests.{module}", total
        self.drive = drives.with_carrier(drives.load(DRIVES / drive_file), carrier_half)
        self.registers = registers(self.drive)
        self.generics = {key.upper(): value for key, value in self.registers.config._asdict().items()}
        self.environment = environment | {"FLUXPROOF_DRIVE": str(DRIVES / drive_file)}
        self.environment["FLUXPROOF_CARRIER_HALF"] = str(carrier_half)
        self.folder = ghdl.run_folder("fluxproof", self.generics, key="demo")
        self.problem: str | None = None

    def run(self) -> None:
        for name in ("progress", "result.npz", "summary.json"):  # nothing old may pass for new
            (self.folder / name).unlink(missing_ok=True)
        try:
            ghdl.run("fluxproof", self.module, self.generics, self.environment, key="demo")
            problem = ghdl.failure(self.folder) or ("" if self.summary() else "no result")
            self.problem = problem.partition("\n")[0] or None
        except (SystemExit, ghdl.BuildError) as error:  # no GHDL, or VHDL that does not build
            self.problem = f"{error}; see {self.folder.relative_to(ROOT)}/build.log"

    def done(self) -> int:
        """Periods simulated so far, as the simulation tells in its file."""
        try:
            return int((self.folder / "progress").read_text().split()[0])
        except (OSError, ValueError, IndexError):  # not there yet, or just being written
            return 0

    def summary(self) -> dict:
        """What the simulation counted; empty where it came to no end."""
        path = self.folder / "summary.json"
        counted = json.loads(path.read_text()) if path.exists() else {}
        return {"ghdl_seconds" if k == "seconds" else k: value for k, value in counted.items()}


class Progress:
    """How far the simulations are: a live line on a terminal, else a line from each at every 10 %."""

    def __init__(self, simulations: list[Simulation], out):
        self.simulations, self.out = simulations, out
        self.began: dict[Simulation, tuple[float, int]] = {}
        self.told = dict.fromkeys(simulations, 0)

    def show(self, done: dict[Simulation, int], now: float) -> None:
        for s in self.simulations:
            if done[s]:
                self.began.setdefault(s, (now, done[s]))
        if self.out.isatty():
            columns = os.get_terminal_size(self.out.fileno()).columns
            print(f"\r{self.line(done, now, columns - 1)}\x1b[K", end="", file=self.out, flush=True)
            return
        for s in self.simulations:
            tenth = 10 * done[s] // s.total
            if tenth > self.told[s]:
                self.told[s] = tenth
                rate, left = self.speed(s, done[s], now)
                state = f"{s.name}: {10 * tenth} %, {done[s]} of {s.total} periods"
                print(f"{state}, {rate:.0f}/s, {left:.0f} s left", file=self.out, flush=True)

    def speed(self, s: Simulation, done: int, now: float) -> tuple[float, float]:
        """(periods per second, seconds left) since the first sign of life."""
        since, first = self.began.get(s, (now, done))
        rate = (done - first) / (now - since) if now > since else 0.0
        return rate, (s.total - done) / rate if rate else 0.0

    def line(self, done: dict[Simulation, int], now: float, columns: int) -> str:
        """All simulations in one line of at most ``columns`` characters."""
        parts, width = [], min(20, max(4, (columns - 67) // 2))
        for s in self.simulations:
            bar = "#" * (width * done[s] // s.total)
            text = f"[{bar:.<{width}}] {done[s]}/{s.total} {self.speed(s, done[s], now)[0]:.0f}/s"
            parts.append(f"{s.name} {text if done[s] else 'building'}")
        left = max(self.speed(s, done[s], now)[1] for s in self.simulations)
        return "  ".join([*parts, f"{left:.0f} s left" if left else ""])[:columns]


def watch(simulations: list[Simulation], out=sys.stdout, pause: float = 0.5) -> None:
    """Run all at once and show how far they are."""
    progress = Progress(simulations, out)
    for s in simulations:
        s.start()
    while any([s.is_alive() for s in simulations]):
        time.sleep(pause)
        progress.show({s: s.done() for s in simulations}, time.monotonic())
    if out.isatty():
        print(file=out)


def prepare(carrier_half: int):
    """(closed loop, replay, recording, why it is skipped); the last three may be None."""
    total = len(fig9(drives.load(DRIVES / "paper001.toml")))
    what = {"FLUXPROOF_SCENARIO": "fig9"}
    loop = Simulation("Fig. 9", "paper001.toml", carrier_half, "dut_loop", total, **what)
    path, skipped = dut_replay.recording_path()
    if skipped:
        return loop, None, None, skipped
    recording, what = dut_replay.load_recording(path), {"FLUXPROOF_RECORDING": str(path)}
    total = len(recording.t)
    replay = Simulation("recording", "emrax228.toml", REPLAY_CARRIER, "dut_replay", total, **what)
    return loop, replay, recording, None


def collect(loop: Simulation, replay: Simulation | None, recording, skipped: str | None):
    """(summary, figures by name, view of the recording or None) from what the simulations left behind."""
    scenario = fig9(loop.drive)
    run = report.run_view(np.load(loop.folder / "result.npz"), loop.drive, scenario, loop.registers)
    summary = {**loop.summary(), **report.metrics(run)}
    gates = report.gate_view(run, len(scenario) - 50)
    if replay is None:
        return {**summary, "recording": {"skipped": skipped}}, plots.draw(run, gates), None
    bound = dut_replay.current_bound(recording, replay.drive)
    view = report.recording_view(recording, bound, np.load(replay.folder / "result.npz"), replay.drive)
    found = {"rows": replay.total, **report.recording_metrics(view, replay.summary())}
    return {**summary, "recording": found}, plots.draw(run, gates, view), view


def passed(summary: dict, problems: list[str]) -> bool:
    """Equal in every bit, and enough of it compared."""
    differences = summary["differences"] + summary["recording"].get("differences", 0)
    return not problems and differences == 0 and summary["periods_compared"] >= LEAST_PERIODS


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make demo", description=__doc__.splitlines()[0])
    parser.add_argument("--carrier-half", type=int, default=LOOP_CARRIER, help="clocks in half a PWM period")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="write the README's picture here")
    options, began = parser.parse_args(argv), time.monotonic()

    for old in DEMO.glob("*.*"):  # a run that fails leaves nothing that looks like a result
        old.unlink()
    loop, replay, recording, skipped = prepare(options.carrier_half)
    simulations = [s for s in (loop, replay) if s]
    print("VHDL in GHDL, golden model beside it, compared in every bit of every control period")
    print(f"recording skipped: {skipped}" if skipped else f"recording: {replay.total} rows", flush=True)
    watch(simulations)
    problems = [f"{s.name}: {s.problem}" for s in simulations if s.problem]
    sys.stderr.writelines(f"{problem}\n" for problem in problems)
    if not all(s.summary() for s in simulations):
        return 1

    summary, figures, view = collect(loop, replay, recording, skipped)
    for name, figure in figures.items():
        plots.write_png(figure, DEMO / f"{name}.png")
    if options.picture:
        plots.write_png(figures["overview"], options.picture)
    summary["wall_time_s"] = round(time.monotonic() - began, 1)
    good, real = passed(summary, problems), drives.load(DRIVES / loop.drive_file)
    context = dict(good=good, problems=problems, loop=loop, replay=replay, view=view, real=real)
    page = report.write(DEMO / "report.html", figures, summary, **context)
    write_json(DEMO / "summary.json", summary)
    print(f"\n{report.text(summary, real)}\n  report            {page.relative_to(ROOT)}")
    return 0 if good else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)  # as the shell has it
