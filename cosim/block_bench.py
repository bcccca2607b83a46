"""The one bench, the part that runs inside the simulator: drives a schedule and compares with ``==``."""

from __future__ import annotations

import os

import cocotb
from cocotb.clock import Clock as ClockDriver
from cocotb.triggers import FallingEdge

from fluxproof.cosim.stimulus import schedule
from fluxproof.golden_model.registry import BLOCKS


def read(handle, signed: bool) -> int | str:
    """The value as an integer, or as text where it holds anything but 0 and 1."""
    value = handle.value
    text = str(value)
    if set(text) - {"0", "1"}:
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


@cocotb.test()
async def equals_model(dut):
    block = BLOCKS[os.environ["FLUXPROOF_BLOCK"]]
    config = block.configs[int(os.environ["FLUXPROOF_CONFIG"])]
    seed = int(os.environ["FLUXPROOF_SEED"])
    clocks = schedule(block, config, seed)
    rows = {c.sample: c.writes for c in clocks if c.sample >= 0}
    inputs = {p.name: getattr(dut, p.name) for p in block.ports(config)}
    outputs = [(p.name, getattr(dut, p.name), bool(p.fmt.signed)) for p in block.out_ports(config)]

    for handle in inputs.values():
        handle.value = 0
    dut.rst.value = 1
    if not block.clocked:
        dut.in_valid.value = 0
    ClockDriver(dut.clk, 10, unit="ns").start()
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)

    compared, in_valid, rst, held = 0, 0, 1, None
    for number, clock in enumerate(clocks):
        if not block.clocked and number > 2:
            valid = read(dut.out_valid, False)
            if valid != clock.out_valid:
                wrong = [("out_valid", valid, clock.out_valid)]
                raise AssertionError(report(block, config, seed, number, clock.of_sample, rows, wrong))
            if block.soon:
                pairs = [("out_soon", read(dut.out_soon, False), int(bool(clock.soon)))]
                pairs += [(n, read(h, s), clock.soon[n]) for n, h, s in outputs if n in clock.soon]
                if wrong := [row for row in pairs if row[1] != row[2]]:
                    raise AssertionError(report(block, config, seed, number, clock.of_sample, rows, wrong))
        if block.atomic:
            seen = [read(handle, signed) for _, handle, signed in outputs]
            if held is not None and not clock.out_valid and seen != held:
                wrong = [("outputs without out_valid", seen, held)]
                raise AssertionError(report(block, config, seed, number, clock.of_sample, rows, wrong))
            held = None if clock.rst else seen
        if clock.expected:
            got = [(name, read(handle, signed)) for name, handle, signed in outputs]
            shown = {name for name in clock.expected if clock.expected.get(block.shown_with.get(name), 1)}
            wrong = [
                (name, value, clock.expected[name])
                for name, value in got
                if name in shown and value != clock.expected[name]
            ]
            if wrong:
                raise AssertionError(report(block, config, seed, number, clock.of_sample, rows, wrong))
            compared += 1
        for name, value in clock.writes.items():
            inputs[name].value = value
        if clock.rst != rst:
            rst = clock.rst
            dut.rst.value = rst
        if not block.clocked and clock.in_valid != in_valid:
            in_valid = clock.in_valid
            dut.in_valid.value = in_valid
        await FallingEdge(dut.clk)
    cocotb.log.info("%d samples compared in %d clocks", compared, len(clocks))
    assert compared > 100, "the schedule compared next to nothing"
