# SPDX-License-Identifier: BSD-3-Clause
"""Carries out the demonstration's steps in lanes, side by side, and shows how far they are."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable

from fluxproof.cosim.runs import Job

# What comes before the first period, by the names of the steps.
PREPARED = {
    "kernels of the golden": "compiling the golden model",
    "kernels of the plant": "compiling the plant",
    "Fig. 9 in Verilator, build": "converting the VHDL to Verilog and building it",
    "analyse": "building the VHDL in GHDL",
}

Step = Callable[[], object]


class Plan:
    """Steps in the order in which a free lane takes them; each begins when those it comes after have ended."""

    def __init__(self, steps: list[tuple[Step, tuple[Step, ...]]]):
        self.left = deque(steps)
        self.ended = {step: threading.Event() for step, _ in steps}

    def carry_out_next(self, begins: Callable[[Step], None]) -> bool:
        """False where no step is left."""
        try:
            step, after = self.left.popleft()
        except IndexError:
            return False
        for other in after:
            self.ended[other].wait()
        begins(step)
        try:
            step()
        finally:
            self.ended[step].set()
        return True


class Lane(threading.Thread):
    """Carries out one step of the plan after the other, beside the other lanes."""

    def __init__(self, plan: Plan):
        super().__init__(daemon=True)
        self.plan = plan
        self.seconds: list[tuple[str, float]] = []  # what each step took
        self.now = ""  # the step that runs

    def run(self) -> None:
        began = 0.0

        def begins(step: Step) -> None:
            nonlocal began
            began, self.now = time.monotonic(), step_name(step)

        while self.plan.carry_out_next(begins):
            self.seconds.append((self.now, round(time.monotonic() - began, 1)))


def step_name(step: Step) -> str:
    """What a step does, for summary.json."""
    job = getattr(step, "__self__", None)
    return f"{job.name}, {step.__name__}" if hasattr(job, "name") else step.__name__


class Progress:
    """How far the jobs are: a live line on a terminal, else a line from each at every 10 %."""

    def __init__(self, jobs: list[Job], out):
        self.jobs, self.out = jobs, out
        self.began: dict[Job, tuple[float, int]] = {}
        self.shown: dict[Job, int] = {}
        self.prepared: set[str] = set()

    def prepare(self, lanes: list[Lane]) -> None:
        """A line at the begin of each step that is no job, which may take minutes where nothing is compiled yet."""
        for name in (lane.now for lane in lanes):
            if name in PREPARED and name not in self.prepared:
                self.prepared.add(name)
                print(f"{PREPARED[name]}; up to some minutes the first time", file=self.out, flush=True)

    def show(self, done: dict[Job, int], now: float) -> None:
        for s in self.jobs:
            if done[s]:
                self.began.setdefault(s, (now, done[s]))
        if self.out.isatty():
            columns = os.get_terminal_size(self.out.fileno()).columns
            print(f"\r{self.line(done, now, columns - 1)}\x1b[K", end="", file=self.out, flush=True)
            return
        for s in self.jobs:
            tenth = 10 * done[s] // s.total
            if s not in self.shown and s.begun:
                self.shown[s] = 0
                print(f"{s.name}: {s.starts}", file=self.out, flush=True)
            if tenth > self.shown.get(s, 0):
                self.shown[s] = tenth
                if s.total == 1:  # done in one piece: no rate to show
                    print(f"{s.name}: done", file=self.out, flush=True)
                    continue
                rate, left = self.speed(s, done[s], now)
                state = f"{s.name}: {10 * tenth} %, {done[s]} of {s.total} periods"
                print(f"{state}, {rate:.0f}/s, {left:.0f} s left", file=self.out, flush=True)

    def speed(self, s: Job, done: int, now: float) -> tuple[float, float]:
        """(periods per second, seconds left) since the first sign of life."""
        since, first = self.began.get(s, (now, done))
        rate = (done - first) / (now - since) if now > since else 0.0
        return rate, (s.total - done) / rate if rate else 0.0

    def line(self, done: dict[Job, int], now: float, columns: int) -> str:
        """What runs now, in one line of at most ``columns`` characters."""
        parts, width = [], min(20, max(4, (columns - 97) // 2))
        running = [s for s in self.jobs if s.begun and done[s] < s.total]
        for s in running:
            bar = "#" * (width * done[s] // s.total)
            text = f"[{bar:.<{width}}] {done[s]}/{s.total} {self.speed(s, done[s], now)[0]:.0f}/s"
            parts.append(f"{s.name} {text if done[s] else s.starts}")
        left = max([self.speed(s, done[s], now)[1] for s in running], default=0)
        return "  ".join([*parts, f"{left:.0f} s left" if left else ""])[:columns]


def watch(lanes: list[Lane], jobs: list[Job], out=sys.stdout, pause: float = 0.5) -> None:
    """Run the lanes side by side and show how far their jobs are."""
    progress = Progress(jobs, out)
    for lane in lanes:
        lane.start()
    while any([lane.is_alive() for lane in lanes]):
        progress.prepare(lanes)
        progress.show({job: job.done() for job in jobs}, time.monotonic())
        time.sleep(pause)
    progress.show({job: job.done() for job in jobs}, time.monotonic())
    if out.isatty():
        print(file=out)
