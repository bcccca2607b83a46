# SPDX-License-Identifier: BSD-3-Clause
"""Inside the simulator: pulses of every length on the trip pin at any time, also while the clock is stopped."""

from __future__ import annotations

import json
import os
import random

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge, Timer

from fluxproof.cosim.block_bench import read

PERIOD_NS = 10


GATE, TRIP, BRAKE = json.loads(os.environ.get("ACTIVE_LEVELS", "[1, 1, 1]"))
FILTER = int(os.environ.get("TRIP_FILTER", "0"))


def gates(dut) -> int:
    """All six switches as one word, 1: on."""
    return (read(dut.gate_high, False) | read(dut.gate_low, False) << 3) ^ (0 if GATE else 0b111111)


def trip_pin(dut, on: int) -> None:
    """The power stage asks for a trip, or not."""
    dut.trip_pin.value = on if TRIP else 1 - on


async def started(dut):
    """Reset is over, the pin is low, the core wants gates on; returns the clock."""
    trip_pin(dut, 0)
    dut.trigger_next.value = dut.brake_next.value = 0
    dut.gate_high_next.value, dut.gate_low_next.value = 0b101, 0b010
    dut.rst.value = 1
    clock = Clock(dut.clk, PERIOD_NS, unit="ns")
    clock.start()
    for _ in range(4):
        await FallingEdge(dut.clk)
    dut.rst.value = 0
    for _ in range(FILTER + 6):  # until the filter knows the pin's first level
        await FallingEdge(dut.clk)
    assert gates(dut) == 0b010101 and read(dut.trip, False) == 0
    return clock


@cocotb.test()
async def registers_everything_once(dut):
    await started(dut)
    rng = random.Random(1)
    for _ in range(200):
        now = (rng.randrange(8), rng.randrange(8), rng.randrange(2))
        dut.gate_high_next.value, dut.gate_low_next.value, dut.trigger_next.value = now
        await FallingEdge(dut.clk)
        assert (gates(dut) & 7, gates(dut) >> 3, read(dut.sample_trigger, False)) == now
        assert read(dut.trip, False) == 0


@cocotb.test(skip=FILTER > 0)
async def no_pulse_is_lost(dut):
    """Gates off without a clock; trip two edges later; gates stay off until the core has seen it and the pin is low."""
    await started(dut)
    rng = random.Random(2)
    for _ in range(400):
        # The core's side: it wants gates on all the time, so whatever keeps them off is here.
        await RisingEdge(dut.clk)
        await Timer(rng.randrange(1, PERIOD_NS), "ns")
        width = rng.choice((1, 2, rng.randrange(1, 12), rng.randrange(1, 200)))
        trip_pin(dut, 1)
        await Timer(100, "ps")
        await ReadOnly()
        assert gates(dut) == 0, "the gates waited for a clock"
        cocotb.start_soon(release(dut, width * 1000 - 100))
        for edge in range(1, 60):
            await RisingEdge(dut.clk)
            await Timer(10, "ps")
            trip = read(dut.trip, False)
            assert trip == (edge >= 2) or edge > 2, f"trip after {edge} edges"
            if gates(dut):
                # Told after edge 2, the core acts at edge 3, and edge 4 takes what it says then.
                assert edge >= 4, "gates on before the core has registered the trip"
                assert read(dut.trip_pin, False) != TRIP
            if edge > 2 and not trip:
                break
        else:
            raise AssertionError("trip never fell")
        assert gates(dut) == 0b010101
        await FallingEdge(dut.clk)


async def release(dut, picoseconds: int) -> None:
    """The pin falls after this time."""
    await Timer(picoseconds, "ps")
    trip_pin(dut, 0)


@cocotb.test(skip=FILTER == 0)
async def only_longer_pulses_trip(dut):
    """A pulse seen by FILTER edges or fewer has no effect; a longer one turns the gates off at edge FILTER + 3."""
    await started(dut)
    rng = random.Random(3)
    for _ in range(200):
        await RisingEdge(dut.clk)
        await Timer(rng.randrange(1, PERIOD_NS), "ns")
        trip_pin(dut, 1)
        seen = rng.choice((1, FILTER - 1, FILTER, FILTER + 1, FILTER + 2, 3 * FILTER))
        for edge in range(1, 4 * FILTER + 12):
            await RisingEdge(dut.clk)
            await Timer(1, "ns")
            if edge == seen:
                trip_pin(dut, 0)
            off_from, told_from = FILTER + 3, FILTER + 5
            if seen <= FILTER or edge < off_from:
                assert gates(dut) == 0b010101 and read(dut.trip, False) == 0, f"{seen} edges tripped"
            elif edge < told_from + 2:  # the core acts on trip at the next edge
                assert gates(dut) == 0, f"gates on {edge} edges after the pin rose"
                assert read(dut.trip, False) == (edge >= told_from)
        assert gates(dut) == 0b010101 and read(dut.trip, False) == 0


@cocotb.test(skip=FILTER > 0)
async def works_without_a_clock(dut):
    clock = await started(dut)
    clock.stop()
    await Timer(7, "ns")
    trip_pin(dut, 1)
    await Timer(1, "ns")
    assert gates(dut) == 0
    trip_pin(dut, 0)
    await Timer(1000, "ns")
    assert gates(dut) == 0, "gates on again without clear_trip"


@cocotb.test()
async def brake_follows_at_its_level(dut):
    """Without a register: on and off, also in a trip, of which it is no part."""
    await started(dut)
    for on in (1, 0, 1, 0):
        dut.brake_next.value = on
        trip_pin(dut, on)
        await Timer(1, "ns")
        assert read(dut.brake, False) == (on if BRAKE else 1 - on)


@cocotb.test()
async def a_reset_leaves_the_levels_of_off(dut):
    await started(dut)
    dut.gate_high_next.value = dut.gate_low_next.value = 0
    for _ in range(2):
        await FallingEdge(dut.clk)
    off = 0 if GATE else 0b111
    assert read(dut.gate_high, False) == read(dut.gate_low, False) == off
