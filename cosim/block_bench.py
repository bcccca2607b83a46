"""The one bench, the part that runs inside the simulator: drives a schedule and compares with ``==``."""

from __future__ import annotations

import gc
import os

import cocotb
from cocotb.clock import Clock as ClockDriver
from cocotb.triggers import FallingEdge, Timer, ValueChange

from fluxproof.cosim.stimulus import due, schedule
from fluxproof.golden_model.registry import BLOCKS

CLOCK_NS = 10


def read(handle, signed: bool) -> int | str:
    """The value as an integer, or as text where it holds anything but 0 and 1."""
    value = handle.value
    text = str(value)
    if text.strip("01"):
        return text
    number = int(text, 2)
    return number - (1 << len(text)) if signed and text[0] == "1" and len(text) > 1 else number


def report(block, config, seed, clock, sample, rows, wrong) -> str:
    """Everything needed to understand a difference, and the line that brings it back."""
    inputs = ", ".join(f"{k}={v}" for k, v in rows.get(sample, {}).items())
    got = "; ".join(f"{name}: got {a}, wanted {b}" for name, a, b in wrong)
    index = block.configs.index(config)
    return (
        f"{block.name} {dict(config)} differs from its model at sample {sample}, clock {clock}, seed {seed}\n"
        f"  inputs: {inputs}\n  {got}\n"
        f"  rerun:  FLUXPROOF_SEED={seed} make test ARGS='-k \"test_rtl and {block.name}-{index}\"'"
    )


def eventful(block, clocks) -> list[int]:
    """The clocks at which something is driven or compared; between two of them no output is due.

    A block whose sample is the clock, or whose outputs must never move by themselves, is looked at in every clock.
    """
    if block.clocked or block.atomic:
        return list(range(len(clocks)))
    chosen = {0, 1, 2, 3, 4, len(clocks) - 1}
    for number, (before, clock) in enumerate(zip(clocks, clocks[1:]), 1):
        if clock.writes or clock.expected or (clock.rst, clock.in_valid) != (before.rst, before.in_valid):
            chosen.add(number)
        if clock.out_valid or clock.soon:
            # It rises and falls at these clocks and at no other.
            chosen |= {number - 1, number, min(number + 1, len(clocks) - 1)}
    return sorted(chosen)


class Silence:
    """Notices when an output that says that another one is due moves while nobody looks."""

    def __init__(self, handles):
        self.moved: list[str] = []
        for handle in handles:
            cocotb.start_soon(self._watch(handle))

    async def _watch(self, handle):
        while True:
            await ValueChange(handle)
            self.moved.append(handle._name)

    async def keep(self, clk, count: int) -> list[str]:
        """Wait for ``count`` falling edges; the names of what moved where there are clocks nobody looks at."""
        if count < 3:
            for _ in range(count):
                await FallingEdge(clk)
            return []
        self.moved.clear()
        await Timer(count * CLOCK_NS - CLOCK_NS // 2, "ns")  # the last rising edge before
        await FallingEdge(clk)
        return self.moved


@cocotb.test()
async def equals_model(dut):
    block = BLOCKS[os.environ["FLUXPROOF_BLOCK"]]
    config = block.configs[int(os.environ["FLUXPROOF_CONFIG"])]
    seed = int(os.environ["FLUXPROOF_SEED"])
    gc.disable()  # the schedule is large, lives as long as the run and would be searched again and again
    clocks = schedule(block, config, seed)
    rows = {c.sample: c.writes for c in clocks if c.sample >= 0}
    inputs = {p.name: getattr(dut, p.name) for p in block.ports(config)}
    outputs = [(p.name, getattr(dut, p.name), bool(p.fmt.signed)) for p in block.out_ports(config)]

    for handle in inputs.values():
        handle.value = 0
    if block.strobes:
        dut.rst.value = 1
    strobes = block.strobes and not block.clocked
    if strobes:
        dut.in_valid.value = 0
    ClockDriver(dut.clk, CLOCK_NS, unit="ns").start()
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)

    announced = ([dut.out_valid, dut.out_soon] if block.soon else [dut.out_valid]) if strobes else []
    silence, chosen = Silence(announced), eventful(block, clocks)
    rules = due(block, clocks)
    compared, in_valid, rst, held = 0, 0, 1, None
    for number, following in zip(chosen, [*chosen[1:], len(clocks)], strict=True):
        clock, rule = clocks[number], rules[number]
        wrong = [
            (name, value, wanted)
            for name, wanted in rule.strobes.items()
            if (value := read(getattr(dut, name), False)) != wanted
        ]
        if not wrong and (rule.outputs or block.atomic):
            seen = {name: read(handle, signed) for name, handle, signed in outputs}
            wrong = [(name, seen[name], wanted) for name, wanted in rule.outputs if seen[name] != wanted]
            if rule.still and seen != held:
                wrong += [("outputs without out_valid", seen, held)]
            held = seen
        if wrong:
            raise AssertionError(report(block, config, seed, number, rule.of_sample, rows, wrong))
        compared += bool(clock.expected)
        for name, value in clock.writes.items():
            inputs[name].value = value
        if clock.rst != rst and block.strobes:
            rst = clock.rst
            dut.rst.value = rst
        if strobes and clock.in_valid != in_valid:
            in_valid = clock.in_valid
            dut.in_valid.value = in_valid
        if moved := await silence.keep(dut.clk, following - number):
            wrong = [(name, "moved", f"still until clock {following}") for name in moved]
            raise AssertionError(report(block, config, seed, number, clock.sample, rows, wrong))
    cocotb.log.info("%d samples compared in %d clocks", compared, len(clocks))
    assert compared > 100, "the schedule compared next to nothing"
