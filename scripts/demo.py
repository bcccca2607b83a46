"""`make demo`: Fig. 9 of paper 001 with the VHDL in the loop, and a real recording through the same core.

Two simulations run side by side in GHDL, the golden model beside each.  Writes build/demo/summary.json, the figures
and report.html.  Exit status: 0 equal in every bit, 1 where anything differs or a simulation fails.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from cocotb_tests import dut_replay, simulate
from golden_model import drive as drives
from golden_model.registers import registers
from scripts import plots, report
from scripts.files import BUILD, ROOT, write_json
from scripts.scenarios import fig9

DEMO = BUILD / "demo"
DRIVES = ROOT / "docs" / "drives"
RECORDING = "emrax228/coastdown_run.csv"
LOOP_CARRIER, REPLAY_CARRIER = 1000, 100  # clocks in half a PWM period: GHDL pays by the clock
LEAST_PERIODS = 2000


class Simulation(threading.Thread):
    """One run of the core in GHDL: ``total`` periods of ``drive_file`` under a cocotb module."""

    def __init__(self, name: str, drive_file: str, carrier_half: int, module: str, total: int, **environment: str):
        super().__init__(name=name, daemon=True)
        self.drive_file, self.module, self.total = drive_file, module, total
        self.drive = drives.with_carrier(drives.load(DRIVES / drive_file), carrier_half)
        self.registers = registers(self.drive)
        self.generics = {key.upper(): value for key, value in self.registers.config._asdict().items()}
        self.environment = {
            "FLUXPROOF_DRIVE": str(DRIVES / drive_file),
            "FLUXPROOF_CARRIER_HALF": str(carrier_half),
            **environment,
        }
        self.folder = run_folder(self.generics)
        self.problem: str | None = None

    def run(self) -> None:
        for name in ("progress", "result.npz", "summary.json"):  # nothing old may pass for new
            (self.folder / name).unlink(missing_ok=True)
        try:
            simulate.run("fluxproof", f"cocotb_tests.{self.module}", self.generics, self.environment, key="demo")
            self.problem = simulate.failure(self.folder)
        except (SystemExit, subprocess.CalledProcessError) as error:  # no GHDL, or VHDL that does not build
            self.problem = f"{error}; see {self.folder.relative_to(ROOT)}/build.log"

    def done(self) -> int:
        """Periods simulated so far, as the simulation tells in its file."""
        try:
            return int((self.folder / "progress").read_text().split()[0])
        except (OSError, ValueError, IndexError):  # not there yet, or just being written
            return 0

    def summary(self) -> dict | None:
        path = self.folder / "summary.json"
        return json.loads(path.read_text()) if path.exists() else None


def run_folder(generics: dict) -> Path:
    """The folder that simulate.run will use (a test holds the two together); needed to watch it from outside."""
    tag = hashlib.sha256(repr((str(simulate.RTL), sorted(generics.items()), "demo")).encode()).hexdigest()[:8]
    return BUILD / "sim" / f"fluxproof-{tag}"


def watch(simulations: list[Simulation], out=sys.stdout, pause: float = 0.5) -> None:
    """Start all and show how far they are: a live line on a terminal, else a line every 10 %."""
    began, told = {}, dict.fromkeys(simulations, 0)
    for simulation in simulations:
        simulation.start()
    while any(s.is_alive() for s in simulations):
        time.sleep(pause)
        for s in simulations:
            if s.done():
                began.setdefault(s, (time.monotonic(), s.done()))
        if out.isatty():
            line = "   ".join(_state(s, began.get(s)) for s in simulations)
            print(f"\r{line[: os.get_terminal_size().columns - 1]}\x1b[K", end="", file=out, flush=True)
            continue
        for s in simulations:
            tenth = 10 * s.done() // s.total
            if tenth > told[s]:
                told[s] = tenth
                print(_state(s, began.get(s)), file=out, flush=True)
    if out.isatty():
        print(file=out)


def _state(simulation: Simulation, began: tuple[float, int] | None) -> str:
    """Name, bar, periods done, speed, time left."""
    done, total = simulation.done(), simulation.total
    if began is None:
        return f"{simulation.name}: analysing the VHDL, compiling the golden model ..."
    bar = "#" * (12 * done // total)
    text = f"{simulation.name} [{bar:.<12}] {done}/{total} periods"
    seconds, since = time.monotonic() - began[0], done - began[1]
    if done == total or not since:
        return text
    return f"{text}, {since / seconds:.0f}/s, {(total - done) * seconds / since:.0f} s left"


def recording_path() -> tuple[Path, str | None]:
    """Where the recording should be, and why it is skipped, if it is."""
    folder = Path(os.environ.get("FLUXPROOF_RECORDINGS", "../shared/recordings"))
    path = ROOT / folder / RECORDING
    return path, None if path.exists() else f"no {folder / RECORDING} (FLUXPROOF_RECORDINGS names the folder)"


def collect(loop: Simulation, replay: Simulation | None, recording, skipped: str | None):
    """(summary, figures, view of the recording or None) from what the finished simulations left behind."""
    scenario = fig9(loop.drive)
    run = report.run_view(np.load(loop.folder / "result.npz"), loop.drive, scenario, loop.registers)
    result = loop.summary()
    seconds = result.pop("seconds")
    summary = {**result, **report.metrics(run), "carrier_half_clocks": run.carrier_half, "ghdl_seconds": seconds}
    figures = [draw(run) for draw in plots.OF_A_RUN]
    figures.append(plots.gate_signals(report.gate_view(run, len(scenario) - 50)))
    if replay is None:
        return {**summary, "recording": {"skipped": skipped}}, figures, None
    bound = dut_replay.current_bound(recording, replay.drive)
    view = report.recording_view(recording, bound, np.load(replay.folder / "result.npz"), replay.drive)
    found = {"rows": replay.total, **report.replay_figures(replay.summary(), view), "carrier_half_clocks": REPLAY_CARRIER}
    return {**summary, "recording": found}, [*figures, plots.recording(view)], view


def passed(summary: dict, simulations: list[Simulation]) -> bool:
    """Equal in every bit, and enough of it compared."""
    differences = summary["differences"] + summary["recording"].get("differences", 0)
    enough = summary["periods_compared"] >= LEAST_PERIODS
    return enough and differences == 0 and all(s.problem is None for s in simulations)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make demo", description=__doc__.splitlines()[0])
    parser.add_argument("--carrier-half", type=int, default=LOOP_CARRIER, help="clocks in half a PWM period")
    parser.add_argument("--redraw", action="store_true", help="report from the last run, without simulating")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="write the README's picture too")
    options = parser.parse_args(argv)
    began = time.monotonic()

    real = drives.load(DRIVES / "paper001.toml")
    total = len(fig9(real))
    loop = Simulation("Fig. 9", "paper001.toml", options.carrier_half, "dut_loop", total, FLUXPROOF_SCENARIO="fig9")
    simulations, replay, recording = [loop], None, None
    path, skipped = recording_path()
    if skipped:
        print(f"recording skipped: {skipped}")
    else:
        recording = dut_replay.load_recording(path)
        where = {"FLUXPROOF_RECORDING": str(path.resolve())}
        replay = Simulation("recording", "emrax228.toml", REPLAY_CARRIER, "dut_replay", len(recording.t), **where)
        simulations.append(replay)
    if not options.redraw:
        print(f"VHDL in GHDL, golden model beside it: {total} periods of Fig. 9 in closed loop", flush=True)
        watch(simulations)
    broken = [s for s in simulations if s.summary() is None]
    for s in broken:
        print(f"{s.name}: no result: {s.problem or 'run it first'}", file=sys.stderr)
    if broken:
        return 1

    summary, figures, view = collect(loop, replay, recording, skipped)
    for figure in figures:
        plots.write_png(figure, DEMO / f"{figure.fluxproof_name}.png")
        if options.picture and figure.fluxproof_name == "overview":
            plots.write_png(figure, options.picture)
    summary["wall_time_s"] = round(time.monotonic() - began, 1)
    good = passed(summary, simulations)
    page = report.write(
        DEMO / "report.html",
        figures,
        good=good,
        verdict=report.verdict(summary),
        problems=[f"{s.name}: {s.problem}" for s in simulations if s.problem],
        summary=summary,
        loop=loop,
        replay=replay,
        view=view,
        sections=report.described(loop.drive),
        real=real,
    )
    write_json(DEMO / "summary.json", summary)
    print(f"\n{report.text(summary, real)}\n  report            {page.relative_to(ROOT)}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
