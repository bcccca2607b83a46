# SPDX-License-Identifier: BSD-3-Clause
"""Rejects raw samples that come too early, and reports missing ones; runs at every clock.

* A strobe less than ``INTERVAL`` clocks after the last accepted one is rejected (``sample_busy``): the sample in flight
  is never disturbed.  It is reported (``sample_early``) and counted in ``early_samples``, which saturates.
* ``sample_late`` is 1 from ``watchdog`` clocks after the last sample, or after the reset, until the next one enters; a
  sample that comes earlier is in time.  ``watchdog`` = 0 is always late: the watchdog is switched off by fault_ignore
  (fault_latch), never by a number.

The age is counted up to ``watchdog`` only, so that it cannot wrap and a new value takes effect at once.
Formats: clocks; the age has AGE_W bits, which no age that stops at ``watchdog`` can exceed.  The reset clears the age.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

AGE_W = 20
AGE = Format(0, AGE_W, 0)
COUNT = Format(0, 8, 0)
MOST = COUNT.hi
AHEAD = 2  # registers from the age to sample_late


class State(NamedTuple):
    wait: int = 0  # clocks until the next sample may enter
    age: int = 0  # clocks since the last sample, watchdog at most
    early_samples: int = 0


@kernel
def step(state, sample_valid, clear_trip, watchdog, interval, age_w):
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
    interval, longest = config["INTERVAL"], (1 << config["AGE_W"]) - 1
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
    for writes in ({"watchdog": 0}, {"watchdog": longest}, {"watchdog": 1}, {"clear_trip": 1}):
        wait(1, sample_valid=1)
        wait(2 * interval)
        wait(interval, **writes)
    wait(300 + 2 * interval, sample_valid=1)
    wait(1, clear_trip=1, sample_valid=1)
    wait(interval)
    return rows


def patient_stimuli(_rng, config):
    """The longest times that a bit of the age makes, just missed and met, where a bench gets there."""
    rows = []
    for bit in range(3, config["AGE_W"] + 1 if config["AGE_W"] < 16 else 0):
        still = {"sample_valid": 0, "clear_trip": 0, "watchdog": (1 << bit) - 1}
        for wait in (still["watchdog"] - AHEAD, still["watchdog"] + 5):
            rows += [still | {"sample_valid": 1}] + [still] * max(wait, config["INTERVAL"])
    return rows


BLOCK = Block(
    name="sample_guard",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=(
        Port("sample_valid", BIT, doc="1: the raw sample is valid"),
        Port("clear_trip", BIT, doc="1: clear early_samples"),
    ),
    registers=(Port("watchdog", AGE, doc="longest time without a sample, clocks"),),
    outputs=(
        Port("sample_busy", BIT, doc="1: no sample may enter"),
        Port("sample_early", BIT, doc="1: a sample came too early and was rejected"),
        Port("sample_late", BIT, doc="1: the last sample is older than watchdog clocks"),
        Port("early_samples", COUNT, doc="samples rejected because they came too early"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"AHEAD": AHEAD, "AGE_W": AGE_W},
    configs=({"INTERVAL": 48, "AGE_W": AGE_W}, {"INTERVAL": 48, "AGE_W": 9}, {"INTERVAL": 5, "AGE_W": 6}),
    too_wide=(0,),
    width_from={"watchdog": lambda config: Format(0, config["AGE_W"], 0)},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
