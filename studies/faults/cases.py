# SPDX-License-Identifier: BSD-3-Clause
"""The fault cases at 732 rpm under load: failing sensors, bus, strobes and pins, and the expected response."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fluxproof.cosim.closed_loop import SAMPLE_DELAY, gate_words
from golden_model.fluxproof import REGISTERS
from studies.faults.bench import Case, Outcome, Plan

START, STOP = Case.start, Case.stop
NOISE = {"adc_a": 0, "adc_b": 65535, "adc_c": 12345, "adc_u_dc": 0, "position_code": 54321}
JUMP_CODES = 65536 // 12  # 30 degrees of the shaft


def during(disturb: Callable[[Plan], None], start: int = START, stop: int = STOP) -> Callable[[Plan], None]:
    """Apply ``disturb`` in the periods from ``start`` to ``stop`` only."""

    def only(plan: Plan) -> None:
        if start <= plan.k < stop:
            disturb(plan)

    return only


def code(name: str, value: int) -> Callable[[Plan], None]:
    """A converter with a constant code."""
    return lambda plan: plan.codes.update({name: value})


def holding(name: str, start: int = START, stop: int = STOP) -> Callable[[Plan], None]:
    """A code that is frozen at its value of period ``start``."""
    last: dict[str, int] = {}

    def disturb(plan: Plan) -> None:
        if plan.k == start:
            last[name] = plan.codes[name]
        if start <= plan.k < stop:
            plan.codes[name] = last[name]

    return disturb


def jump(plan: Plan) -> None:
    plan.codes["position_code"] = (plan.codes["position_code"] + JUMP_CODES) % 65536


def strobes(*clocks: int, codes: dict[str, int] | None = None) -> Callable[[Plan], None]:
    """The strobes of a period, the first with the true codes and the others with ``codes``."""
    return lambda plan: setattr(plan, "strobes", {at: (codes or {}) if n else {} for n, at in enumerate(clocks)})


def registers(**values: int) -> Callable[[Plan], None]:
    """Registers that get these values from a period on."""
    return lambda plan: plan.registers.update(values)


def sag(volts: float, nominal: float = 563.0) -> Callable[[int], float]:
    """The bus at ``volts`` from START to STOP."""
    return lambda k: volts if START <= k < STOP else nominal


def cases(period: int) -> list[Case]:
    """All cases; ``period`` in clocks."""
    late = SAMPLE_DELAY + int(0.3 * period)
    too_late = SAMPLE_DELAY + int(0.6 * period)
    once = START + 1
    return [
        Case("current sensor stuck", "code of phase a frozen", holding("adc_a"), trips="current_sum"),
        Case("current sensor lost", "phase b reads zero", during(code("adc_b", 32768)), trips="current_sum"),
        Case("current sensor saturated", "phase c at its upper rail", during(code("adc_c", 65535)),
             trips="overcurrent", flags=("overcurrent", "current_sum", "at_rail")),
        Case("converter at its lower rail", "phase a reads code 0", during(code("adc_a", 0)),
             trips="overcurrent", flags=("overcurrent", "current_sum", "at_rail")),
        Case("resolver frozen", "position code constant", holding("position_code"), trips="position"),
        Case("resolver frozen, slow", "the same at 200 rpm: the EMF contradicts it",
             holding("position_code"), trips="encoder_lost", rpm=200.0),
        Case("resolver jumps", "one code 30 degrees off", during(jump, START, once), trips="position"),
        Case("bus collapses", "563 V to 30 V and back", bus=sag(30.0), trips="u_dc_low"),
        Case("bus sags", "563 V to 100 V and back", bus=sag(100.0), trips=None),
        Case("bus rises", "563 V to 760 V and back", bus=sag(760.0), trips="u_dc_high"),
        Case("strobe too early", "a second one 10 clocks later, with noise as codes",
             during(strobes(SAMPLE_DELAY, SAMPLE_DELAY + 10, codes=NOISE)), trips=None, flags=("early",)),
        Case("strobe stuck", "sample_valid in every clock for 40 clocks", during(
             strobes(*range(SAMPLE_DELAY, SAMPLE_DELAY + 40), codes=NOISE)), trips=None, flags=("early",)),
        Case("strobe late", "once by 0.3 periods", during(strobes(late), START, once), trips=None),
        Case("strobe too late", "once by 0.6 periods", during(strobes(too_late), START, once), trips="watchdog"),
        Case("strobe missing once", "one sample missing", during(strobes(), START, once), trips="watchdog"),
        Case("strobe missing", "no samples for 20 ms", during(strobes()), trips="watchdog"),
        Case("strobe doubled", "the same sample again in mid-period",
             during(strobes(SAMPLE_DELAY, SAMPLE_DELAY + period // 2), START, once), trips="position"),
        Case("trip and restart at speed", "pin trip for one clock in mid-period",
             during(lambda plan: plan.pulse("trip", period // 2 + 13), START, once), trips="trip"),
    ]  # fmt: skip


def tour() -> Case:
    """A sequence of faults in 100 periods, each cleared: short enough for GHDL."""
    hurts = [
        during(code("adc_b", 60000), 10, 12),
        during(jump, 22, 23),
        during(strobes(), 34, 36),
        during(strobes(SAMPLE_DELAY, SAMPLE_DELAY + 7, codes=NOISE), 46, 48),
        during(lambda plan: plan.pulse("trip", 33), 54, 55),
        during(code("adc_u_dc", 0), 66, 70),
        during(registers(omega_trip=10), 80, 81),
        during(registers(omega_trip=REGISTERS["omega_trip"].high), 82, 83),
        during(registers(heartbeat=2), 88, 89),
        during(registers(heartbeat=0), 92, 93),
        during(registers(brake_on=200, brake_off=190), 95, 96),
    ]

    def disturb(plan: Plan) -> None:
        for each in hurts:
            each(plan)

    clears = (18, 28, 42, 50, 60, 68, 76, 84, 94)  # at 68 the bus fault is still present
    text = "a sequence of faults"
    return Case("tour", text, disturb, trips="current_sum", start=10, stop=92, clears=clears, periods=100)


# Register writes: each register at both ends of its range, in blocks of periods after a start without faults.
QUIET, BLOCK, WRITE, STOPPED, RESTORED, CLEARED, JUDGED = 100, 24, 0, 4, 6, 8, 23
STOP_AT = 100  # clock of period STOPPED with a pulse on the pin trip
ENDS = [(name, value) for name, port in REGISTERS.items() for value in (port.low, port.high)]


def extremes(register_set) -> Case:
    """Every register at both ends while the drive runs: four periods, then trip, the old value, clear."""
    usual = register_set.values._asdict()

    def disturb(plan: Plan) -> None:
        number, phase = divmod(plan.k - QUIET, BLOCK)
        if not 0 <= number < len(ENDS):
            return
        name, value = ENDS[number]
        if phase == WRITE:
            plan.registers = {name: value}
        elif phase == STOPPED:
            plan.pulse("trip", STOP_AT)
        elif phase == RESTORED:
            plan.registers = {name: usual[name]}
        elif phase == CLEARED:
            plan.pulse("clear_trip", STOP_AT)

    text = "each register at both ends of its range"
    return Case("register writes", text, disturb, clears=(), start=QUIET, periods=QUIET + BLOCK * len(ENDS) + 200)


def extremes_verdict(outcome: Outcome, register_set) -> dict:
    """Check that after every write the trip works and the drive runs again."""
    o, words, found, tripped_alone = outcome, gate_words(outcome.seen), [], []
    if o.differences:
        found.append(f"RTL and golden core differ: {o.first_difference}")
    if np.any(words & words >> 3 & 7):
        found.append("both gates of a leg were on")
    for number, (name, value) in enumerate(ENDS):
        first = QUIET + number * BLOCK
        stop, clear = (o.begin(first + phase) + STOP_AT for phase in (STOPPED, CLEARED))
        if words[stop : clear + 1].any():
            found.append(f"{name} = {value}: a gate was on after trip")
        if not o.column("running")[o.begin(first + JUDGED)]:
            found.append(f"{name} = {value}: the drive does not run again")
        if o.column("tripped")[stop - 1]:
            tripped_alone.append(f"{name}={value}")
    current = float(np.abs(o.i_abc).max())
    return {
        "name": "register writes",
        "writes": len(ENDS),
        "registers": len(REGISTERS),
        "tripped_by_themselves": tripped_alone,
        "peak_current_a": round(current, 2),
        "clocks_compared": len(o.seen),
        "samples_compared": o.samples,
        "differences": o.differences,
        "text": f"Register writes: each of {len(REGISTERS)} registers at both ends of its range for four periods at "
        f"speed, {len(ENDS)} writes. The pin `trip` turned the gates off in one clock in all of them, the drive ran "
        f"again after the old value and `clear_trip` in all of them; {len(tripped_alone)} writes caused "
        f"a trip; largest current {current:.1f} A.",
        "problems": found,
    }
