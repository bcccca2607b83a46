# SPDX-License-Identifier: BSD-3-Clause
"""Steps of the references in the stream, each beside the response that `simulate` predicts for this drive file.

A step counts where the loop was at rest before it and where all references stay until the loop has settled.  The
prediction is computed in a process of its own, below all others, so that neither the reader nor the page waits for it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from threading import Event
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.step_response import Curve, Loop, Situation, told
from fluxproof.simulate.response import length, loops_of, predicted
from fluxproof.watch.live import Live, Look
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.registers import RegisterSet
from golden_model.units import to_si

EVERY_S = 1.0
BEFORE = 20  # samples at rest before a step
SMALLEST, AT_REST = (
    0.02,
    0.1,
)  # a step, of the current limit or the rated speed; what is left of the last one, of a step
FIXED = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "run")
Predict = Callable[[Drive, RegisterSet, Situation], np.ndarray]
NEEDED = (*FIXED, "i_q", "theta_me", "omega_me", "u_dc", "v_comp")


class Response(NamedTuple):
    """A step of a reference [A or electrical rad/s], what followed on the drive, and what was predicted."""

    loop: Loop
    before: float
    after: float
    measured: Curve
    predicted: Curve
    counter: int | None = None  # number of the sample of the step

    def told(self) -> list[tuple[str, str, str]]:
        """(response, rise to 90 %, overshoot) of both."""
        curves = (("measured", self.measured), ("predicted", self.predicted))
        return [(name, *told(curve, self.before, self.after)) for name, curve in curves]


def smallest(drive: Drive, loop: Loop) -> float:
    """The smallest step that is looked at [A or electrical rad/s]."""
    rated = drive.machine.pole_pairs * drive.machine.rated_speed_rad_s
    return SMALLEST * (rated if loop.speed_mode else drive.current_limit_a)


def steps_in(look: Look, drive: Drive, loop: Loop) -> list[tuple[int, int]]:
    """(row of the step, row behind its response) of each usable step, in the order of the rows."""
    fields = look.fields
    reference = to_si(loop.reference, fields[loop.reference], drive)
    signal_si = to_si(loop.signal, fields[loop.signal], drive)
    moves = np.zeros(len(reference), bool)
    for name in FIXED:
        moves[1:] |= np.diff(fields[name]) != 0
    moves[look.cuts] = True
    at = np.flatnonzero(moves)
    ends = np.append(at[1:], len(reference))
    found = []
    for row, end, since in zip(at, ends, np.concatenate([[0], at[:-1]]) if len(at) else [], strict=True):
        change = reference[row] - reference[row - 1]
        acts = fields["run"][row] and fields["speed_mode"][row] == loop.speed_mode
        if abs(change) < smallest(drive, loop) or not acts:
            continue
        behind = row + length(drive, loop, change)
        rest = np.abs(signal_si[row - BEFORE : row] - reference[row - 1]) if row - since >= BEFORE else [np.inf]
        if behind <= end and np.mean(rest) <= AT_REST * abs(change):
            found.append((int(row), int(behind)))
    return found


def situation(look: Look, drive: Drive, loop: Loop, row: int, behind: int) -> Situation:
    """What the step at ``row`` was made at."""
    names = ("i_q", "i_d_ref", "omega_me", "theta_me", "u_dc", loop.reference)
    si = {name: to_si(name, look.fields[name], drive) for name in names}
    before = slice(row - BEFORE, row)
    return Situation(
        loop=loop,
        before=float(si[loop.reference][row - 1]),
        after=float(si[loop.reference][row]),
        omega=si["omega_me"][row:behind],
        i_d=float(si["i_d_ref"][row]),
        i_q=float(si["i_q"][before].mean()),
        u_dc=float(si["u_dc"][before].mean()),
        theta=float(si["theta_me"][row]),
        v_comp=int(look.fields["v_comp"][row - 1]),
    )


class Responses:
    """The last step of each loop; ``latest`` by the loop's name."""

    def __init__(self, live: Live, drive: Drive, register_set: RegisterSet) -> None:
        self.live, self.drive, self.register_set = live, drive, register_set
        self.latest: dict[str, Response] = {}
        self.problem = ""
        self.known: dict[str, int] = {}  # number of the last step that was looked at, by loop
        self.seen = 0  # rows
        rated = drive.machine.pole_pairs * drive.machine.rated_speed_rad_s
        self.loops = loops_of(drive)
        self.span = BEFORE + max(length(drive, loop, 2.0 * rated) for loop in self.loops)

    def run(self, ending: Event) -> None:
        """Until ``ending``, or until the process of the prediction fails, which ``problem`` then says."""
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), below_all_others) as pool:
            while not ending.wait(EVERY_S):
                try:
                    self.renew(lambda *given: pool.submit(predicted, *given).result())
                except (BrokenProcessPool, DriveError, OSError) as error:  # the reader goes on
                    self.problem = f"no step response is predicted: {error}"
                    return

    def renew(self, predict: Predict = predicted) -> None:
        """The newest step of each loop, if it is not the one that is known."""
        total = self.live.total
        look = self.live.look(total - self.seen + self.span, NEEDED)
        self.seen = total
        for loop in self.loops:
            found = steps_in(look, self.drive, loop) if len(look.counter) > 1 else []
            if found and self.known.get(loop.name) != int(look.counter[found[-1][0]]):
                self.known[loop.name] = int(look.counter[found[-1][0]])
                self.latest[loop.name] = self._response(look, loop, *found[-1], predict)

    def _response(self, look: Look, loop: Loop, row: int, behind: int, predict: Predict) -> Response:
        at, period_s = situation(look, self.drive, loop, row, behind), self.drive.sample_time_s
        seen = to_si(loop.signal, look.fields[loop.signal][row - BEFORE : behind], self.drive)
        expected = predict(self.drive, self.register_set, at)
        return Response(
            loop,
            at.before,
            at.after,
            Curve((np.arange(len(seen)) - BEFORE) * period_s, seen),
            Curve(np.arange(len(expected)) * period_s, expected),
            int(look.counter[row]),
        )


def below_all_others() -> None:
    """For a process of its own: it yields the processor, and Ctrl-C is for its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.name == "posix":
        os.nice(10)
