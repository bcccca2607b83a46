# SPDX-License-Identifier: BSD-3-Clause
"""Up-down carrier, six gate signals with dead time, enable and latched trip; one step is one clock.

The carrier counts 0 .. CARRIER_HALF-1 and back, each value once per direction: 2*CARRIER_HALF clocks.
A leg is commanded high while carrier >= CARRIER_HALF - compare, for 2*compare clocks around the peak.
Compare values are updated at the valley, when the carrier is 0 again, and with ``double_update`` at the peak too;
dead time and minimum pulse at the valley only.  A half period then has its own compare value and one edge per leg.

* Dead time: when the command of a leg changes, both gates go off, the other one on ``dead_time`` clocks later; a new
  setting also applies to a dead time that has begun.
* ``dead_time`` = 0 or >= ``min_pulse``, or ``min_pulse`` above half a period, contradict each other: the
  setting is refused (``setting_refused``) and the last valid one is kept; before the first valid one the
  gates stay off.
* ``enable`` switches on at the valley, off at once.  ``trip`` switches off at once and is latched
  until ``clear_trip`` comes while ``trip`` is 0; then ``enable`` is still needed.
* ``sample`` marks the middle of the zero vector at the gates, one register after the carrier: wherever compare values
  are updated.
* ``double_update`` is taken while the gates are off (``double_used``): the gains of the regulators and the minimum
  pulse of the compare values belong to it, so a change in between would mix two settings.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel
from golden_model.modulation.pwm_compare import CLOCKS, COUNT

LEGS = Format(0, 3, 0)


class State(NamedTuple):
    carrier: int = 0
    down: int = 0
    compare_a: int = 0
    compare_b: int = 0
    compare_c: int = 0
    dead_time: int = 0
    min_pulse: int = 0
    double_update: int = 0
    configured: int = 0
    running: int = 0
    tripped: int = 0
    level_a: int = 0
    level_b: int = 0
    level_c: int = 0
    elapsed_a: int = 0
    elapsed_b: int = 0
    elapsed_c: int = 0


SETTLED = CLOCKS.hi  # elapsed of a gate that is on: a longer dead time must not turn it off again


@kernel
def leg(wanted, level, elapsed, dead_time, on):
    """One leg: (level, clocks that both gates have been off, high gate, low gate) of the next clock."""
    if not on:
        return 0, 0, 0, 0
    if wanted != level:
        return wanted, 1, 0, 0
    if elapsed < dead_time:
        return level, elapsed + 1, 0, 0
    return level, SETTLED, level, 1 - level


@kernel
def step(
    state, compare_a, compare_b, compare_c, enable, trip, clear_trip, dead_time, min_pulse, double_update,
    carrier_half,
):  # fmt: skip
    s = state
    valley = s.carrier == 0 and s.down == 1
    peak = s.carrier == carrier_half - 1 and s.down == 0
    update = valley or (peak and s.double_update == 1)
    if s.down == 0:
        carrier, down = (s.carrier, 1) if peak else (s.carrier + 1, 0)
    else:
        carrier, down = (0, 0) if valley else (s.carrier - 1, 1)

    good = 0 < dead_time < min_pulse <= carrier_half
    tripped = 1 if trip or (s.tripped and not clear_trip) else 0
    on = 1 if s.running and enable and not trip else 0

    wanted_a = 1 if s.carrier >= carrier_half - s.compare_a else 0
    wanted_b = 1 if s.carrier >= carrier_half - s.compare_b else 0
    wanted_c = 1 if s.carrier >= carrier_half - s.compare_c else 0
    level_a, elapsed_a, high_a, low_a = leg(wanted_a, s.level_a, s.elapsed_a, s.dead_time, on)
    level_b, elapsed_b, high_b, low_b = leg(wanted_b, s.level_b, s.elapsed_b, s.dead_time, on)
    level_c, elapsed_c, high_c, low_c = leg(wanted_c, s.level_c, s.elapsed_c, s.dead_time, on)

    running, configured = on, s.configured
    if valley:
        if good:
            configured = 1
        running = 1 if enable and configured and not tripped else 0
    sample = 1 if s.carrier == 0 and s.down == 0 else 0
    if s.carrier == carrier_half - 1 and s.down == 1:
        sample = s.double_update
    following = State(
        carrier,
        down,
        compare_a if update else s.compare_a,
        compare_b if update else s.compare_b,
        compare_c if update else s.compare_c,
        dead_time if valley and good else s.dead_time,
        min_pulse if valley and good else s.min_pulse,
        s.double_update if s.running else double_update,
        configured,
        running,
        tripped,
        level_a,
        level_b,
        level_c,
        elapsed_a,
        elapsed_b,
        elapsed_c,
    )
    gate_high = high_a + 2 * high_b + 4 * high_c
    gate_low = low_a + 2 * low_b + 4 * low_c
    outputs = (
        gate_high,
        gate_low,
        sample,
        running,
        tripped,
        0 if good else 1,
        following.min_pulse,
        following.double_update,
        carrier,
    )
    return following, outputs


def stimuli(rng, config):
    """Every duty from 0 to 100 %, valid and contradicting dead times and pulses, trips at every phase."""
    half = config["CARRIER_HALF"]
    rows = []
    good = {"dead_time": 3, "min_pulse": 8}
    for period in range(36):
        settings = {18: {"dead_time": 8, "min_pulse": 8}, 20: {"dead_time": 5, "min_pulse": 7}}.get(period, good)
        settings = {24: {"dead_time": 3, "min_pulse": half + 1}, 26: {"dead_time": 0, "min_pulse": 4}}.get(
            period, settings
        )
        compare = [int(rng.integers(0, half + 1)) for _ in range(3)]
        # The low gates have been on for less than the dead time that comes at the valley
        settings = {29: {"dead_time": 30, "min_pulse": 31}}.get(period, settings)
        compare = {
            2: [0, half, half // 2], 3: [half, 0, half], 4: [1, half - 1, 0], 28: [half - 8, half - 9, half - 12],
        }.get(period, compare)  # fmt: skip
        for clock in range(2 * half):
            row = {**dict(zip(("compare_a", "compare_b", "compare_c"), compare, strict=True)), **(settings or good)}
            row |= {"enable": int(period != 12 or clock < half // 3), "trip": 0, "clear_trip": 0}
            row["double_update"] = int(period == 15)  # while the gates are on: not taken
            if period in (6, 9):
                row["trip"] = int(half // 2 + period <= clock < half // 2 + period + 1)
            if period in (8, 9, 11):
                row["clear_trip"] = int(clock == half // 2 + period)
            rows.append(row)
    return rows + _halves(rng, half)


def _halves(rng, half):
    """Update at both extremes: new compare values in every half, legs that change at an extreme, 0 %, 100 %."""
    rows = []
    corners = {6: [0, half, 0], 7: [half, 0, half], 8: [0, half, 8], 9: [half, 0, half - 8], 10: [0, half, 0]}
    for part in range(28):
        compare = corners.get(part, [int(rng.integers(0, half + 1)) for _ in range(3)])
        for clock in range(half):
            row = dict(zip(("compare_a", "compare_b", "compare_c"), compare, strict=True))
            row |= {"dead_time": 3, "min_pulse": 8, "double_update": int(part not in (14, 22)), "trip": 0}
            # Off while double_update is taken and given back, in the middle of a half
            off = part in (0, 20, 21, 22) or (part == 19 and clock > half // 2)
            rows.append(row | {"enable": int(not off), "clear_trip": 0})
    return rows


def patient_stimuli(rng, config):
    """A leg at rest for a power of two of clocks and a part of the dead time: each bit of its time has counted.

    Then dead times of all sizes that the carrier allows; at the end any duty, dead time and pulse, also ones that the
    range allows and no carrier reaches.
    """
    half, rows = config["CARRIER_HALF"], []
    good = {"dead_time": 12, "min_pulse": 20, "enable": 1, "trip": 0, "clear_trip": 0, "double_update": 0}

    def period(compare, **more):
        legs = dict.fromkeys(("compare_a", "compare_b", "compare_c"), compare)
        rows.extend([good | legs | more] * (2 * half))

    for bit in range(4, 15):
        for past in (2, 8):
            periods, missing = divmod(-(1 << bit) - past, 2 * half)
            period(half)
            period(half)
            for compare in (missing // 2, *[0] * (-periods - 1), missing - missing // 2, half):
                period(min(compare, half))
    for bit in range(half.bit_length()):
        least, past = 1 << bit, min(2 << bit, half)
        for dead_time in sorted({least, least + 1, (least + past) // 2, past - 1}):
            for _ in range(2 if dead_time < half else 0):
                period(half // 2, dead_time=dead_time, min_pulse=int(rng.integers(dead_time + 1, half + 1)))
    for bit in range(COUNT.width):
        period(1 << bit | int(rng.integers(half // 4)))
    for _ in range(60):
        dead_time, min_pulse, compare = (
            int(rng.integers(1 << int(rng.integers(1, fmt.width + 1)))) for fmt in (CLOCKS, CLOCKS, COUNT)
        )
        period(compare, dead_time=dead_time, min_pulse=min_pulse)
    return rows


BLOCK = Block(
    name="gate_generation",
    folder="modulation",
    paper="001, section 5.2, IGBT pulse generation",
    step=step,
    inputs=tuple(Port(f"compare_{k}", COUNT, doc=f"compare value, leg {k}") for k in "abc")
    + (
        Port("enable", BIT, doc="1: gates may switch"),
        Port("trip", BIT, doc="1: gates off, latched"),
        Port("clear_trip", BIT, doc="1: clear the latched trip"),
    ),
    registers=(
        Port("dead_time", CLOCKS, doc="both gates of a leg off, clocks"),
        Port("min_pulse", CLOCKS, doc="shortest pulse of a leg, clocks"),
        Port("double_update", BIT, doc="1: sample and update at the peak too; taken while the gates are off"),
    ),
    outputs=(
        Port("gate_high", LEGS, doc="upper gates, bit 0 is leg a"),
        Port("gate_low", LEGS, doc="lower gates, bit 0 is leg a"),
        Port("sample", BIT, doc="middle of the zero vector: take a sample"),
        Port("running", BIT, doc="gates are switching"),
        Port("tripped", BIT, doc="1: a trip is latched"),
        Port("setting_refused", BIT, doc="1: dead_time and min_pulse contradict each other, refused"),
        Port("min_pulse_used", CLOCKS, doc="minimum pulse in force"),
        Port("double_used", BIT, doc="double_update in force"),
        Port("carrier", COUNT, doc="carrier, for observation"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"CARRIER_HALF": 40}, {"CARRIER_HALF": 100}),
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
