# SPDX-License-Identifier: BSD-3-Clause
"""The cause of a difference between replay and recording: a search over single wrong bits or register digits.

The recorded values show where the difference appears; its origin may be hidden, because the core does not output every
signal.  A hypothesis confirms it: with this bit of this register (raw sample, start state) inverted, the golden model
reproduces the recording bit for bit, beyond the first difference.  Both runs can then be traced through every hidden
signal, and the block where they first differ is known.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from fluxproof.diagnosis.replay.chain import Run
from fluxproof.diagnosis.replay.flow import (
    ORDER,
    OWNER,
    first_in_flow,
    hidden_before,
    outputs_of,
    parted,
    trace,
)
from golden_model import fluxproof
from golden_model.fluxproof import REGISTERS
from golden_model.io import sample_latch

SHOWN_LATER = ("i_d_ref",)  # values of a sample that act on the next one, see control/current_limit
REACH = 4000  # rows before the difference from which a hypothesis is replayed: hidden states may differ earlier
BEYOND = 300  # rows after it that a hypothesis must explain to be examined further
STATE_BITS = 40  # widest state: V_STATE


@dataclass(frozen=True)
class Cause:
    """A hypothesis that reproduces the recording.

    kind: "register", "sample" (one raw value), "start_state", "record" (one recorded output).  name, bit: location of
    the error; found: recorded value; acted: value with which the core behaved.  run, state: for the replay with it.
    rows: end (exclusive) of the rows that it explains.
    """

    kind: str
    name: str
    bit: int
    found: int
    acted: int
    run: Run
    state: fluxproof.State
    rows: int = 0
    bits: tuple = ()  # all bits that each explain equally many rows


def find_cause(run: Run, state, start: int, stop: int, row: int, names: list[str], whole_state: bool):
    """(the Cause of a first difference in ``row`` or None, row from which the two runs are to be compared).

    state: before ``start``, of a stretch start..stop-1 without gap.  names: signals that differ in ``row``.
    whole_state: ``state`` was read from the recording, so that it may be what is wrong.
    """
    count, last = run.differences(state, start, stop)
    if count == 1 and last == row:
        signal = names[0]
        found = int(run.recorded[row, run.names.index(signal)])
        acted = golden_value(run, run.state_at(state, start, row), row, signal)
        return Cause("record", signal, lowest_bit(found, acted), found, acted, run, state, stop), row
    begin = max(start, row - REACH)
    base = run.state_at(state, start, begin)
    goal = min(stop, row + 1 + BEYOND)
    best, first = None, row
    for cause in _hypotheses(run, base, begin, row, names, whole_state and begin == start):
        patch = cause.run.patch
        at = patch[0] if cause.kind == "sample" and patch is not None else begin
        reached, _, _ = cause.run.until_different(cause.state, at, goal)
        if reached == goal < stop:
            reached, _, _ = cause.run.until_different(cause.state, at, stop)
        if reached > row and (best is None or reached > best.rows):
            best, first = dataclasses.replace(cause, rows=reached), at
            if reached == stop:
                break
    if best is not None and best.kind == "register":
        best = dataclasses.replace(best, bits=_as_good(run, best, base, begin))
    # A bit that explains only the row of the difference may do so by chance.
    return (None, row) if best is not None and best.rows == row + 1 < stop else (best, first)


def _as_good(run: Run, cause: Cause, base, begin) -> tuple:
    """Bits of the cause's register that explain equally many rows: the recording cannot separate them."""
    bits, fmt = [], REGISTERS[cause.name].fmt
    for bit in range(fmt.width):
        changed = {cause.name: flipped(cause.found, bit, fmt)}
        other = run._replace(registers=run.registers._replace(**changed))
        if other.until_different(base, begin, cause.rows)[0] == cause.rows:
            bits.append(bit)
    return tuple(bits)


def _hypotheses(run: Run, base, begin, row, names, whole_state):
    """Hypotheses with a single inverted bit, likely ones first; base: start state of their runs, from ``begin`` on."""
    for at, fields in ((row, fluxproof.Sample._fields), (row - 1, SHOWN_LATER)):
        if at < begin:
            continue
        before = run.state_at(base, begin, at)
        for name in fields:
            k = fluxproof.Sample._fields.index(name)
            fmt, found = sample_latch.BLOCK.outputs[k].fmt, int(run.samples[at, k])
            for bit in range(fmt.width):
                acted = flipped(found, bit, fmt)
                yield Cause("sample", name, bit, found, acted, run._replace(patch=(at, k, acted)), before)
    for name in _registers_near(run, names):
        fmt, found = REGISTERS[name].fmt, getattr(run.registers, name)
        bits = [flipped(found, bit, fmt) for bit in range(fmt.width)]
        for acted in dict.fromkeys(bits + _slips(found, fmt)):
            changed = run._replace(registers=run.registers._replace(**{name: acted}))
            yield Cause("register", name, lowest_bit(found, acted), found, acted, changed, base)
    if whole_state:
        for name, bit, found, acted, state in _states(base):
            yield Cause("start_state", name, bit, found, acted, run, state)


def _slips(value, fmt) -> list[int]:
    """The values with one decimal digit changed: the header is text, so that a wrong bit or key changes a digit."""
    text = str(abs(value))
    digits = [text[:k] + d + text[k + 1 :] for k in range(len(text)) for d in "0123456789" if d != text[k]]
    numbers = [int(t) * (-1 if value < 0 else 1) for t in digits]
    return [n for n in numbers if fmt.lo <= n <= fmt.hi]


def _registers_near(run, names):
    """Registers by distance: of the block that differs, of hidden blocks upstream, then all."""
    near = [OWNER[first_in_flow(names)]]
    near += reversed(hidden_before(near[0], run.names, run.config))
    near += [name for name in ORDER if name not in near]
    return list(dict.fromkeys(p.name for name in near for p in fluxproof.WIRING[name][0].BLOCK.registers))


def _states(base):
    """Every inverted bit of the state: (name, bit, value, changed value, changed state)."""
    for name, part in base._asdict().items():
        for key, found in ({"": part} if isinstance(part, int) else part._asdict()).items():
            for bit in range(STATE_BITS):
                acted = found ^ (1 << bit)
                changed = acted if isinstance(part, int) else part._replace(**{key: acted})
                yield f"{name}.{key}".rstrip("."), bit, found, acted, base._replace(**{name: changed})


def where_they_part(run: Run, cause: Cause, state, first: int, row: int) -> tuple[int, str]:
    """(row, instance) of the first difference between the replay and the cause's run, including hidden signals.

    state: the replay's before row ``first``, from which both run; ``row``: the row of the visible difference.
    """
    low, high = first, row  # the first row after which the states differ, by bisection
    while low < high:
        middle = (low + high) // 2
        if run.state_at(state, first, middle + 1) != cause.run.state_at(cause.state, first, middle + 1):
            high = middle
        else:
            low = middle + 1
    ours, theirs = run.state_at(state, first, low), cause.run.state_at(cause.state, first, low)
    for k in range(low, row + 1):
        a = trace(ours, run.sample(k), run.registers_at(k), run.config, run.of_speed(k), run.table)
        other = cause.run
        b = trace(theirs, other.sample(k), other.registers_at(k), run.config, other.of_speed(k), run.table)
        apart = [name for name in parted(a, b) if name != "latch"]
        if apart:
            return k, apart[0]
        ours, theirs = run.state_at(ours, k, k + 1), cause.run.state_at(theirs, k, k + 1)
    return row, ""


def golden_value(run: Run, state, row, name) -> int:
    """The golden model's value of a signal in a row, zero of a block that the core has not.

    state: the one before the row.
    """
    said = trace(state, run.sample(row), run.registers_at(row), run.config, run.of_speed(row), run.table)[OWNER[name]]
    return said[outputs_of(OWNER[name]).index(name)] if said else 0


def flipped(value, bit, fmt) -> int:
    """The integer with one bit of its format inverted, in two's complement if the format is signed."""
    bits = (int(value) ^ (1 << bit)) & ((1 << fmt.width) - 1)
    return bits - (1 << fmt.width) if fmt.signed and bits >> (fmt.width - 1) else bits


def lowest_bit(a: int, b: int) -> int:
    """The lowest bit in which two integers differ."""
    return ((a ^ b) & -(a ^ b)).bit_length() - 1
