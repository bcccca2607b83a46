"""Lets raw samples in no closer than the core can work on them, and tells when they stay away; every clock.

* A strobe closer than ``INTERVAL`` clocks to the last one that entered is not let in (``sample_busy``): the sample in
  flight is never disturbed.  It is told (``sample_early``) and counted in ``early_samples``, which stays at its end.
* ``sample_late`` is up ``watchdog`` clocks after the last sample, or after the reset, until the next one enters; a
  sample that comes fewer clocks after the last is in time.  ``watchdog`` = 0 is always late: the watchdog is switched
  off where faults are ignored (fault_latch), never by a number.

No wrap: the age is counted up to ``watchdog`` and no further, so that any new value of it acts at once.
Formats: clocks.  The age starts anew with the reset.
"""

from typing import NamedTuple

from fluxproof.golden_model.block import Block, Port
from fluxproof.golden_model.fixed import Format
from fluxproof.golden_model.formats import BIT
from fluxproof.golden_model.kernel import kernel

AGE = Format(0, 20, 0)
COUNT = Format(0, 8, 0)
MOST = COUNT.hi
AHEAD = 2  # the age enters one register and is judged into another


class State(NamedTuple):
    wait: int = 0  # clocks until the next sample may enter
    age: int = 0  # clocks since the last sample, watchdog at most
    early_samples: int = 0


@kernel
def step(state, sample_valid, clear_trip, watchdog, interval):
    s = state
    entered = 1 if sample_valid and s.wait == 0 else 0
    early = 1 if sample_valid and s.wait != 0 else 0
    expired = s.age >= watchdog

    wait = interval - 1 if entered else max(s.wait - 1, 0)
    age = AHEAD if entered else (s.age if expired else s.age + 1)
    counted = 0 if clear_trip else s.early_samples
    counted = min(counted + early, MOST)
    late = 1 if expired and not entered else 0
    return State(wait, age, counted), (1 if wait != 0 else 0, early, late, counted)


def stimuli(rng, config):
    """Strobes as close as allowed, one clock closer, held high, missing; the watchdog rewritten while it counts."""
    interval = config["INTERVAL"]
    rows = []

    def wait(clocks, **writes):
        for _ in range(clocks):
            rows.append({"sample_valid": 0, "clear_trip": 0, "watchdog": 3 * interval} | writes)

    for distance in (interval, interval - 1, interval + 1, 1, 2, 2 * interval):
        for _ in range(3):
            wait(1, sample_valid=1)
            wait(distance - 1)
    wait(3 * interval, sample_valid=1)
    for distance in (3 * interval - 1, 3 * interval, 3 * interval + 1, 5 * interval):
        wait(1, sample_valid=1)
        wait(distance)
    for writes in ({"watchdog": 0}, {"watchdog": AGE.hi}, {"watchdog": 1}, {"clear_trip": 1}):
        wait(1, sample_valid=1)
        wait(2 * interval)
        wait(interval, **writes)
    wait(300 + 2 * interval, sample_valid=1)
    wait(1, clear_trip=1, sample_valid=1)
    wait(interval)
    return rows


BLOCK = Block(
    name="sample_guard",
    folder="io",
    paper="none: what a drive needs besides",
    step=step,
    inputs=(
        Port("sample_valid", BIT, doc="the raw sample is there"),
        Port("clear_trip", BIT, doc="1: forget the early samples"),
    ),
    registers=(Port("watchdog", AGE, doc="longest time without a sample, clocks"),),
    outputs=(
        Port("sample_busy", BIT, doc="1: no sample may enter"),
        Port("sample_early", BIT, doc="a sample was not let in"),
        Port("sample_late", BIT, doc="the last sample is older than the watchdog allows"),
        Port("early_samples", COUNT, doc="samples that were not let in"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"AHEAD": AHEAD},
    configs=({"INTERVAL": 48}, {"INTERVAL": 5}),
    reference=None,
    bound=None,
    stimuli=stimuli,
)
