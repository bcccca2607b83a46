# SPDX-License-Identifier: BSD-3-Clause
"""`make demo`: the RTL spins a motor, and says why another one differs from its drive file.

In Verilator the RTL, converted to Verilog, runs Fig. 9 of paper 001 at the drive's own clock, then a real recording;
beside it the VHDL itself runs the first periods of both in GHDL, at fewer clocks in a period.  Then the RTL drives the
motor of `fluxproof diagnose --example`, and its telemetry is diagnosed.  The golden model goes along with each run.
Writes build/demo/summary.json, the figures, report.html and diagnosis/.  Exit status: 0 equal in every bit and every
hidden difference named, 1 where anything differs or fails.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from types import SimpleNamespace

from fluxproof.checkout import BUILD, DRIVES, ROOT
from fluxproof.cosim import recording as recordings
from fluxproof.cosim.runs import InGhdl, InVerilator, Named, kernels
from fluxproof.files import write_json
from golden_model import drive as drives
from studies.demo import concealed, plots, report
from studies.demo.example import Diagnosis, run_length
from studies.demo.lanes import Lane, Plan, watch

DEMO = BUILD / "demo"
PAPER, EMRAX = DRIVES / "paper001.toml", DRIVES / "emrax228.toml"
# Clocks in half a PWM period, for all but Fig. 9 in Verilator, which has the drive's own: 200 clocks in a period are as
# much idle as working time for the core.  GHDL takes a thousand times as long for a clock as Verilator, so the VHDL
# runs as much as takes it ten seconds each.
CARRIER = 100
GHDL_PERIODS, GHDL_ROWS = 150, 200
LEAST_PERIODS, LEAST_GHDL_PERIODS = 3000, 150


def both(name: str, function: str, verilator: tuple, ghdl: tuple) -> SimpleNamespace:
    """The same run in both engines, each with the arguments of its own."""
    return SimpleNamespace(
        verilator=InVerilator(f"{name} in Verilator", Named(function, verilator)),
        ghdl=InGhdl(f"{name} in GHDL", Named(function, ghdl)),
    )


def diagnosed() -> tuple[InVerilator, Diagnosis]:
    """The RTL on the motor of the example, and the diagnosis of its telemetry."""
    driven = InVerilator("example in Verilator", Named("studies.demo.example:in_the_loop", (CARRIER,)))
    return driven, Diagnosis(driven, DEMO / "diagnosis")


def prepare(carrier_half: int, ghdl_periods: int):
    """(closed loop, replay, recording, why it is skipped); the last three may be None."""
    function, paper = "fluxproof.cosim.runs:closed_loop", str(PAPER)
    in_ghdl = (paper, CARRIER, "fig9", ghdl_periods)
    loop = both("Fig. 9", function, (paper, carrier_half, "fig9"), in_ghdl)
    path, skipped = recordings.recording_path()
    if skipped:
        return loop, None, None, skipped
    function, log = "fluxproof.cosim.recording:replay", (str(path), str(EMRAX), CARRIER)
    replay = both("recording", function, log, (*log, GHDL_ROWS))
    return loop, replay, recordings.load_recording(path), None


def plan_of(loop: SimpleNamespace, replay: SimpleNamespace | None, driven: InVerilator, diagnosis: Diagnosis) -> Plan:
    """What is compiled for all runs, then the runs, the longest first; the diagnosis needs the example's telemetry."""
    golden, plant, analyse = kernels("golden"), kernels("plant"), InGhdl.analyse
    compiled = (golden, plant)
    runs = [r for r in (loop, replay) if r]
    steps = [(golden, ()), (loop.verilator.build, ()), (plant, ())]
    steps += [(loop.verilator.carry_out, (*compiled, loop.verilator.build)), (driven.carry_out, compiled)]
    steps += [(diagnosis.carry_out, (driven.carry_out,)), (analyse, ())]
    steps += [(r.verilator.carry_out, compiled) for r in runs[1:]]
    return Plan(steps + [(r.ghdl.carry_out, (*compiled, analyse)) for r in runs])


def counted(runs: SimpleNamespace) -> dict:
    """What both engines counted: Verilator's, with the differences of both and GHDL's periods and seconds."""
    compiled, simulated = runs.verilator.summary(), runs.ghdl.summary()
    return {
        **compiled,
        "differences": compiled["differences"] + simulated["differences"],
        "first_difference": compiled["first_difference"] or simulated["first_difference"],
        "seconds": compiled["seconds"],
        "ghdl_periods": simulated["periods_compared"],
        "ghdl_seconds": simulated["seconds"],
        "ghdl_carrier_half_clocks": runs.ghdl.run.config.carrier_half,
    }


def collect(loop: SimpleNamespace, replay: SimpleNamespace | None, recording, skipped: str | None):
    """(summary, figures by name, view of the recording or None) from what the runs left behind."""
    made, numbers = loop.verilator.run, counted(loop)
    run = report.run_view(loop.verilator.arrays(), made.drive, made.scenario, made.registers)
    summary = {**numbers, "verilator_seconds": numbers["seconds"], **report.metrics(run)}
    gates = report.gate_view(run, len(made) - 50)
    if replay is None:
        return {**summary, "recording": {"skipped": skipped}}, plots.draw(run, gates), None
    drive, numbers = drives.load(EMRAX), counted(replay)
    bound = recordings.current_bound(recording, drive)
    view = report.recording_view(recording, bound, replay.verilator.arrays(), drive)
    found = {"rows": replay.verilator.total, **report.recording_metrics(view, numbers)}
    return {**summary, "recording": found}, plots.draw(run, gates, view), view


def found(driven: InVerilator, diagnosis: Diagnosis):
    """(the summary's part on the example, what its figure shows)."""
    view = concealed.view(*diagnosis.files, diagnosis.answer)
    counts = driven.summary()
    numbers = concealed.metrics(view, diagnosis.summary(), run_length())
    times = {"seconds": counts["seconds"], "diagnosis_seconds": round(diagnosis.seconds, 1)}
    names = ("periods_compared", "differences", "first_difference")
    return {**{name: counts[name] for name in names}, **numbers, **times}, view


def passed(summary: dict, problems: list[str]) -> bool:
    """Equal in every bit, enough of it compared, and the example's differences named."""
    differences = summary["differences"] + summary["recording"].get("differences", 0)
    differences += summary["example"]["differences"]
    enough = summary["periods_compared"] >= LEAST_PERIODS and summary["ghdl_periods"] >= LEAST_GHDL_PERIODS
    return not problems and differences == 0 and enough and concealed.good(summary["example"])


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make demo", description=__doc__.splitlines()[0])
    real = drives.load(PAPER)
    own = round(real.core.clock_hz / real.inverter.pwm_frequency_hz / 2)
    help = "clocks in half a PWM period of Fig. 9 in Verilator"
    parser.add_argument("--carrier-half", type=int, default=own, help=help)
    help = "periods of Fig. 9 in GHDL"
    parser.add_argument("--ghdl-periods", type=int, default=GHDL_PERIODS, help=help)
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="write the README's picture here")
    options, began = parser.parse_args(argv), time.monotonic()

    # A run that fails leaves nothing that looks like a result.
    for old in (*DEMO.glob("*.*"), *DEMO.glob("diagnosis/*.*")):
        old.unlink()
    print("RTL beside its golden model, compared in every value and gate edge of every control period", flush=True)
    loop, replay, recording, skipped = prepare(options.carrier_half, options.ghdl_periods)
    if skipped:
        print(f"recording skipped: {skipped}", flush=True)
    runs = [r for r in (loop, replay) if r]
    driven, diagnosis = diagnosed()
    jobs = [*(job for r in runs for job in (r.verilator, r.ghdl)), driven, diagnosis]
    plan = plan_of(loop, replay, driven, diagnosis)
    lanes = [Lane(plan), Lane(plan)]
    watch(lanes, jobs)
    problems = [f"{job.name}: {job.problem}" for job in jobs if job.problem]
    sys.stderr.writelines(f"{problem}\n" for problem in problems)
    if not all(job.summary() for job in jobs):
        return 1

    summary, figures, view = collect(loop, replay, recording, skipped)
    summary["example"], shown = found(driven, diagnosis)
    summary["example_carrier_half_clocks"] = CARRIER
    summary["lanes"] = [lane.seconds for lane in lanes]
    figures["concealed"] = plots.styled(concealed.figure, shown)
    for name, figure in figures.items():
        plots.write_png(figure, DEMO / f"{name}.png")
    if options.picture:
        plots.write_png(figures["overview"], options.picture)
    good = passed(summary, problems)
    summary["seconds"] = summary["wall_time_s"] = round(time.monotonic() - began, 1)
    context = dict(good=good, problems=problems, view=view, real=real, drive_file=PAPER.name)
    context |= dict(clock=loop.verilator.run.drive, registers=loop.verilator.run.registers)
    page = report.write(DEMO / "report.html", figures, summary, emrax=drives.load(EMRAX), **context)
    write_json(DEMO / "summary.json", summary)
    print(f"\n{report.text(summary, real)}\nreport: {page.relative_to(ROOT)} ({summary['seconds']:.0f} s)")
    return 0 if good else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)  # as the shell has it
