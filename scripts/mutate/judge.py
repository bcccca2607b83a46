# SPDX-License-Identifier: BSD-3-Clause
"""One subject from the VHDL to the verdicts: converted, mutated, run, and what nobody noticed proved or reported."""

from __future__ import annotations

import json
import resource
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from fluxproof.files import write_text
from scripts.mutate import draw, equivalent, harness
from scripts.mutate.contract import miter
from scripts.mutate.subject import Board, Core, Subject

PROOF_S = 2  # of processor time for one step of the proof of one mutant
KILLED = "killed"


class WrongHarness(RuntimeError):
    """The netlist without a mutation differs from the model: the fault is not in a mutant."""


@dataclass
class Verdicts:
    """What became of each mutant of a subject, and the processor seconds of each step."""

    name: str
    cells: int = 0
    outcomes: list[tuple[str, str]] = field(default_factory=list)  # mutation, outcome
    seconds: dict[str, float] = field(default_factory=dict)

    def count(self, outcome: str) -> int:
        return sum(found == outcome for _, found in self.outcomes)


def processor_s() -> float:
    """Processor time of this process and of the tools that it has run, in seconds."""
    spent = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in spent)


class Watch:
    """Processor seconds since the last call, by name."""

    def __init__(self):
        self.seconds, self.last = {}, processor_s()

    def __call__(self, name: str) -> None:
        now = processor_s()
        self.seconds[name], self.last = round(now - self.last, 2), now


def judge(subject: Subject | Core | Board, seed: int, trials: Sequence[harness.Trial] = ()) -> Verdicts:
    """Draws the subject's mutants with ``seed`` and judges them.

    trials: what drives and compares, by default those of the subject's bench.  Raises WrongHarness where the netlist
    without a mutation does not pass.
    """
    watch, folder = Watch(), subject.folder
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    cells = draw.prepare(folder, subject.verilog(), subject.top, subject.flat)
    drawn = draw.draw(folder, subject.top, cells, subject.count(cells), seed, subject.no_change)
    watch("draw")
    trials = trials or subject.trials()
    watch("schedule")
    library = harness.build(drawn, trials[0].ports)
    benches = [harness.Bench(library, trial, seed) for trial in trials]
    watch("build")
    for bench in benches:
        if (clock := bench.first_difference(0)) is not None:
            raise WrongHarness(f"{subject.name}: the netlist without a mutation differs at clock {clock}")
    mutants = range(1, len(drawn.mutations) + 1)
    outcome = dict.fromkeys(mutants, KILLED)
    alive = [m for m in mutants if all(bench.first_difference(m) is None for bench in benches)]
    outcome |= dict.fromkeys(alive, equivalent.UNKNOWN)
    watch("run")
    if PROOF_S and alive and isinstance(subject, Subject):  # the whole core is too large for a proof
        circuit = partial(miter, subject.block, subject.config, "")
        outcome |= equivalent.prove(drawn, alive, circuit, PROOF_S)
    watch("prove")
    outcomes = [(drawn.mutations[mutant - 1], outcome[mutant]) for mutant in mutants]
    write_text(folder / "outcomes.json", json.dumps({"outcomes": outcomes, "seconds": watch.seconds}, indent=1))
    return Verdicts(subject.name, cells, outcomes, watch.seconds)
