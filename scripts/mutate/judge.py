"""One subject from the VHDL to the verdicts: converted, mutated, run, and what nobody noticed proved or reported."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, field
from functools import partial

from scripts.mutate import draw, equivalent, harness
from scripts.mutate.contract import miter
from scripts.mutate.subject import Subject

PROOF_S = 10  # for one mutant
KILLED = "killed"


class WrongHarness(RuntimeError):
    """The netlist without a mutation differs from the model: the fault is not in a mutant."""


@dataclass
class Verdicts:
    """What became of each mutant of a subject, and the seconds of each step."""

    name: str
    cells: int = 0
    outcomes: list[tuple[str, str]] = field(default_factory=list)  # mutation, outcome
    seconds: dict[str, float] = field(default_factory=dict)

    def count(self, outcome: str) -> int:
        return sum(found == outcome for _, found in self.outcomes)


class Watch:
    """Seconds since the last call, by name."""

    def __init__(self):
        self.seconds, self.last = {}, time.monotonic()

    def __call__(self, name: str) -> None:
        now = time.monotonic()
        self.seconds[name], self.last = round(now - self.last, 2), now


def judge(subject: Subject, seed: int, proving: bool = True, trial: harness.Trial | None = None) -> Verdicts:
    """Draws the subject's mutants with ``seed`` and judges them.

    trial: what drives and compares, by default the schedule of the block's bench.  Raises WrongHarness where the
    netlist without a mutation does not pass.
    """
    watch, folder = Watch(), subject.folder
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    cells = draw.prepare(folder, subject.verilog(), subject.top, subject.flat)
    drawn = draw.draw(folder, subject.top, cells, subject.count(cells), seed)
    watch("draw")
    trial = trial or harness.block_trial(subject.block, subject.config, harness.BENCH_SEED)
    watch("schedule")
    bench = harness.Bench(harness.build(drawn, trial.ports), trial, seed)
    watch("build")
    clock = bench.first_difference(0)
    if clock is not None:
        raise WrongHarness(f"{subject.name}: the netlist without a mutation differs at clock {clock}")
    mutants = range(1, len(drawn.mutations) + 1)
    outcome = dict.fromkeys(mutants, KILLED)
    alive = [mutant for mutant in mutants if bench.first_difference(mutant) is None]
    outcome |= dict.fromkeys(alive, equivalent.UNKNOWN)
    watch("run")
    if alive and proving:
        steps = subject.block.latency + 3
        circuit = partial(miter, subject.block, subject.config, "")
        outcome |= equivalent.prove(drawn, alive, circuit, steps, PROOF_S)
    watch("prove")
    outcomes = [(drawn.mutations[mutant - 1], outcome[mutant]) for mutant in mutants]
    return Verdicts(subject.name, cells, outcomes, watch.seconds)
