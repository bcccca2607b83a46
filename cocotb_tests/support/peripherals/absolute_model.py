# SPDX-License-Identifier: BSD-3-Clause
"""Absolute encoders as their protocols describe them, one clock at a time, on the far end of a cable.

Nothing here is taken from the RTL or its golden model.  Each model is a function f(memory, clock_line) -> data line;
``memory`` is an int64 array that ``reset`` fills.  CRCs are computed by long division of the whole message.
"""

from __future__ import annotations

import numba
import numpy as np

# memory: [level of the clock line before, edges of the kind counted, clocks since any edge, answering, ...]
LEVEL, EDGES, QUIET, ANSWERING, COMMAND = range(5)
MEMORY = 8


def remainder(bits: list[int], polynomial: int, first: int = 0) -> list[int]:
    """The CRC of a message by long division: the polynomial's degree in bits, highest first; ``first`` starts it."""
    degree = polynomial.bit_length() - 1
    message = [*bits, *[0] * degree]
    for k in range(degree):
        message[k] ^= first >> (degree - 1 - k) & 1
    for k in range(len(bits)):
        if message[k]:
            for j in range(degree + 1):
                message[k + j] ^= polynomial >> (degree - j) & 1
    return message[-degree:]


def biss_frame(word: list[int], error: int = 1, warning: int = 1) -> list[int]:
    """Start bit to CRC; error and warning are 0 when active."""
    data = [*word, error, warning]
    return [1, 0, *data, *(1 - b for b in remainder(data, 0b1000011))]


def endat_frame(word: list[int], errors: list[int]) -> list[int]:
    """Start bit to CRC; ``word`` with its highest bit first, as it is counted, not as it is sent."""
    data = [*errors, *reversed(word)]
    return [1, *data, *(1 - b for b in remainder(data, 0b101011, 0b11111))]


def ssi_word(word: list[int], gray: bool, parity: bool) -> list[int]:
    """The bits an SSI encoder sends."""
    sent = [b ^ a for a, b in zip([0, *word], word, strict=False)] if gray else list(word)
    return [*sent, sum(sent) % 2] if parity else sent


@numba.njit(cache=True)
def reset(memory):
    memory[:] = 0
    memory[LEVEL] = 1
    memory[QUIET] = 1 << 30


@numba.njit(cache=True)
def watch(memory, clock_line, timeout):
    """(rises, falls) of the clock line; forgets the frame after ``timeout`` clocks without an edge."""
    rises = clock_line == 1 and memory[LEVEL] == 0
    falls = clock_line == 0 and memory[LEVEL] == 1
    memory[QUIET] = 0 if rises or falls else memory[QUIET] + 1
    memory[LEVEL] = clock_line
    if memory[QUIET] > timeout:
        memory[EDGES] = 0
        memory[ANSWERING] = 0
    return rises, falls


@numba.njit(cache=True)
def biss(memory, clock_line, frame, length, acknowledge, timeout):
    """SLO: low from the second rising edge of MA, for ``acknowledge`` periods, then a bit at each rising edge."""
    rises, _ = watch(memory, clock_line, timeout)
    memory[EDGES] += rises
    place = memory[EDGES] - 2 - acknowledge
    if memory[EDGES] < 2:
        return 1
    return frame[place] if 0 <= place < length else 0


@numba.njit(cache=True)
def ssi(memory, clock_line, frame, length, _unused, timeout):
    """A bit at each rising edge; low after the last until the monoflop of ``timeout`` clocks lets go."""
    rises, _ = watch(memory, clock_line, timeout)
    memory[EDGES] += rises
    place = memory[EDGES] - 1
    if memory[EDGES] == 0:
        return 1
    return frame[place] if place < length else 0


@numba.njit(cache=True)
def endat(memory, clock_line, received, frame, length, calculation, timeout, mode):
    """(level, drives): bits at the falling edges, the command taken at the rising ones; silent for another command."""
    rises, falls = watch(memory, clock_line, timeout)
    memory[EDGES] += falls
    period = memory[EDGES] - 1
    if memory[EDGES] == 0:
        memory[COMMAND] = 0
        return 0, 0
    if rises and 2 <= period < 8:
        memory[COMMAND] = 2 * memory[COMMAND] + received
    if period < 9 or memory[COMMAND] != mode:
        return 0, 0
    place = period - 10 - calculation
    if place < 0:
        return 0, 1
    return (frame[place], 1) if place < length else (1, 1)


def bits_of(value: int, width: int) -> list[int]:
    """Highest bit first."""
    return [value >> k & 1 for k in reversed(range(width))]


def frames_with_errors(rng: np.random.Generator, frames: list[list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """(bits, wrong): the frames as an array, all but one in eight with one wrong bit at place ``wrong``, else -1."""
    bits = np.array(frames, np.int64)
    wrong = np.where(rng.integers(8, size=len(bits)) == 0, -1, rng.integers(bits.shape[1], size=len(bits)))
    rows = np.flatnonzero(wrong >= 0)
    bits[rows, wrong[rows]] ^= 1
    return bits, wrong
