"""The register behind a split product moved to before its adder: made-up netlists compute the same, clock by clock."""

from __future__ import annotations

import copy

import pytest

from cocotb_tests.test_multiplier_registers import ENABLE_1, ENABLE_2, FIRST, RESET, flip_flop, simulate
from scripts.synth.delays import NET
from scripts.synth.multiplier_registers import absorb
from scripts.synth.split_products import retime

GIVEN = 36  # bits from FIRST on that the simulation makes random: 18 of b, 18 of a, which is cut in two
LOW, ADDED = 10, 24  # bits of the first part; bits of the adder


def cell(kind: str, nets: dict, outputs: str) -> dict:
    directions = {port: "output" if port[0] in outputs else "input" for port in nets}
    directions |= {"COUT": "output"} if "COUT" in nets else {}
    directions |= {"CIN": "input"} if "CIN" in nets else {}
    connections = {port: [bit] for port, bit in nets.items()}
    return {"type": kind, "parameters": {}, "connections": connections, "port_directions": directions}


def design(enable=None, third=False, levels=0, odd: dict | None = None, watched=()) -> dict:
    """a*b of two multipliers, a = low + 2**LOW*high, their parts added, then registers, then ``levels`` LUTs.

    ``third``: the adder's last bits come from flip-flops elsewhere; ``odd``: one register's changes, by its bit.
    """
    b, low, high = (
        list(range(FIRST + n, FIRST + m)) for n, m in ((0, 18), (18, 18 + LOW), (18 + LOW, GIVEN))
    )
    bits = iter(range(FIRST + GIVEN, 10000))
    cells, parts = {}, []
    for name, side in (("m_low", low), ("m_high", high)):
        part = [next(bits) for _ in range(36)]
        parts.append(part)
        operands = {f"A{n}": side[n] if n < len(side) else "0" for n in range(18)}
        cells[name] = cell(
            "MULT18X18D", operands | dict(zip([f"B{n}" for n in range(18)], b, strict=True)), "P"
        )
        cells[name]["connections"] |= {f"P{n}": [bit] for n, bit in enumerate(part)}
        cells[name]["port_directions"] |= dict.fromkeys([f"P{n}" for n in range(36)], "output")
    first, second = parts
    carry, total = "0", []
    for n in range(0, ADDED, 2):
        nets = {"CIN": carry, "COUT": next(bits)}
        for k in (0, 1):
            elsewhere = next(bits)
            if third:
                cells[f"c{n + k}"] = flip_flop(low[(n + k) % LOW], elsewhere)
            a = first[LOW + n + k] if LOW + n + k < 28 else elsewhere if third else "0"
            nets |= {f"A{k}": a, f"B{k}": second[n + k], f"S{k}": next(bits)}
            total.append(nets[f"S{k}"])
        cells[f"sum{n}"] = cell("CCU2C", nets, "S")
        carry = nets["COUT"]
    product = first[:LOW] + total
    made = [next(bits) for _ in product]
    for n, (d, q) in enumerate(zip(product, made, strict=True)):
        cells[f"p{n}"] = flip_flop(d, q, enable, **(odd or {}).get(n, {}))
    y = list(made)
    for level in range(levels):  # a slow follower: only its depth counts
        y.append(next(bits))
        cells[f"l{level}"] = cell("LUT4", {"A": y[-2], "Z": y[-1]}, "Z")
    if levels:
        cells["last"] = flip_flop(y[-1], next(bits))
    outputs = made + [cells[name]["connections"][port][0] for name, port in watched]
    return {"modules": {"t": {"cells": cells, "ports": {"y": {"direction": "output", "bits": outputs}}}}}


@pytest.mark.parametrize("enable", [None, ENABLE_1])
@pytest.mark.parametrize("third", [False, True])
def test_the_same_before_and_after(enable, third):
    before = design(enable=enable, third=third)
    after = copy.deepcopy(before)
    added = ADDED - (28 - LOW) if third else 0
    assert retime(after, "t") == {"multipliers": 2, "removed": LOW + ADDED, "added": added}
    absorbed = absorb(after, "t")
    assert absorbed["P"] == 2
    for seed in range(3):
        assert simulate(before, seed) == simulate(after, seed)


@pytest.mark.parametrize(
    "arguments",
    [
        {"odd": {3: {"CE": ENABLE_2}}, "enable": ENABLE_1},
        {"odd": {30: {"LSR": RESET}}},
        {"odd": {0: {"REGSET": "SET"}}},
        {"watched": [("sum4", "S0")]},  # something else reads the sum before its register
        {"levels": 12},  # the adder would meet a long path behind the register
    ],
)
def test_left_as_it_is(arguments):
    before = design(**arguments)
    after = copy.deepcopy(before)
    assert retime(after, "t") == {"multipliers": 0, "removed": 0, "added": 0}
    assert after == before


def twice_registered(enable=None, third=False, watched=False, second: dict | None = None) -> dict:
    """``design``, but for two flip-flops in front of each bit of the operands; ``watched``: something else reads one of
    the first; ``second``: changes to one of the second."""
    netlist = design(third=third)
    module = netlist["modules"]["t"]
    cells, bit, behind = module["cells"], 20000, {}
    for n in range(FIRST, FIRST + GIVEN):
        cells[f"first{n}"] = flip_flop(n, bit, enable)
        cells[f"second{n}"] = flip_flop(bit, bit + 1, enable, **((second or {}) if n == FIRST + 5 else {}))
        behind[n], bit = bit + 1, bit + 2
    for multiplier in ("m_low", "m_high"):
        connections = cells[multiplier]["connections"]
        connections.update({pin: [behind.get(bits[0], bits[0])] for pin, bits in connections.items()})
    module["ports"]["y"]["bits"] += [20000] if watched else []
    return netlist


@pytest.mark.parametrize("enable", [None, ENABLE_1])
def test_operands_second_registers_go_behind_the_multipliers(enable):
    before = twice_registered(enable)
    after = copy.deepcopy(before)
    assert retime(after, "t") == {"multipliers": 2, "removed": GIVEN, "added": 0}
    assert absorb(after, "t") == {"A": 2, "B": 2, "P": 2, "removed": GIVEN}
    kept = [name for name in after["modules"]["t"]["cells"] if name.startswith("p")]
    assert len(kept) == LOW + ADDED  # the register behind the adder
    for seed in range(3):
        assert simulate(before, seed) == simulate(after, seed)


@pytest.mark.parametrize("arguments", [{"watched": True}, {"third": True}, {"second": {"CE": ENABLE_2}}])
def test_or_the_product_register_goes_before_the_adder(arguments):
    before = twice_registered(ENABLE_1, **arguments)
    after = copy.deepcopy(before)
    assert retime(after, "t")["removed"] == LOW + ADDED
    for seed in range(3):
        assert simulate(before, seed) == simulate(after, seed)


def test_a_short_path_behind_is_no_reason_against():
    levels = 2
    assert levels * NET < 3.9
    assert retime(design(levels=levels), "t")["multipliers"] == 2


def test_the_simulation_sees_a_register_too_few():
    before = design(third=True)
    after = copy.deepcopy(before)
    retime(after, "t")
    cells = after["modules"]["t"]["cells"]
    dropped = next(name for name in cells if "_before_" in name)
    bit = cells[dropped]["connections"]["Q"]
    source = cells[dropped]["connections"]["DI"]
    del cells[dropped]
    for one in cells.values():
        one["connections"] = {
            port: source if bits == bit else bits for port, bits in one["connections"].items()
        }
    assert simulate(before, 0) != simulate(after, 0)
