"""Flip-flops moved into ECP5 multipliers: made-up netlists compute the same before and after, clock by clock."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from scripts.synth.multiplier_registers import absorb
from scripts.synth.netlist import BITS, merge_twins

CLOCK, ENABLE_1, ENABLE_2, RESET, FIRST = 2, 3, 4, 5, 10
CLOCKS = 60


def flip_flop(d: int, q: int, enable: int | None = None, **changes) -> dict:
    nets = {"CLK": [CLOCK], "DI": [d], "Q": [q], "LSR": ["0"]}
    if enable is not None:
        nets["CE"] = [enable]
    parameters = {"CLKMUX": "CLK", "REGSET": "RESET", "CEMUX": "1 " if enable is None else "CE"}
    nets |= {key: [value] for key, value in changes.items() if key in nets}
    parameters |= {key: value for key, value in changes.items() if key in parameters}
    directions = {port: "output" if port == "Q" else "input" for port in nets}
    return {
        "type": "TRELLIS_FF",
        "parameters": parameters,
        "connections": nets,
        "port_directions": directions,
    }


def design(enables=(None, None, None), odd: dict | None = None, watched=(), width=18) -> dict:
    """a, b -> flip-flops -> multiplier -> flip-flops -> y; ``odd`` changes one flip-flop: {name: changes}.

    Bits of A above ``width`` are 0; ``watched`` names flip-flops something else reads too.
    """
    bits = iter(range(FIRST, 10000))
    given = {s: [next(bits) for _ in range(BITS[s])] for s in "AB"}
    held = {s: [next(bits) for _ in range(BITS[s])] for s in "AB"}
    product, y = ([next(bits) for _ in range(BITS["P"])] for _ in range(2))
    cells, nets = {}, {}
    for side, enable in zip("AB", enables[:2], strict=True):
        for n in range(BITS[side]):
            if side == "A" and n >= width:
                nets[f"{side}{n}"] = ["0"]
                continue
            name = f"{side}{n}"
            cells[name] = flip_flop(given[side][n], held[side][n], enable, **(odd or {}).get(name, {}))
            nets[name] = [held[side][n]]
    for n in range(BITS["P"]):
        cells[f"P{n}"] = flip_flop(product[n], y[n], enables[2], **(odd or {}).get(f"P{n}", {}))
        nets[f"P{n}"] = [product[n]]
    directions = {port: "output" if port[0] == "P" else "input" for port in nets}
    cells["m"] = {"type": "MULT18X18D", "parameters": {}, "connections": nets, "port_directions": directions}
    outputs = y + [cells[name]["connections"][port][0] for name, port in watched]
    ports = {"y": {"direction": "output", "bits": outputs}}
    return {"modules": {"t": {"cells": cells, "ports": ports}}}


def add(nets: dict, value: dict) -> None:
    """Two bits of A + B + CIN."""
    total = value[nets["CIN"][0]]
    for n in (0, 1):
        total += value[nets[f"A{n}"][0]] + value[nets[f"B{n}"][0]]
        value[nets[f"S{n}"][0]] = total & 1
        total >>= 1
    value[nets["COUT"][0]] = total


def simulate(netlist: dict, seed: int) -> list[tuple]:
    """The outputs at every clock; the inputs are random, every register starts at 0."""
    module, rng = netlist["modules"]["t"], np.random.default_rng(seed)
    cells = module["cells"]
    made = {c["connections"]["Q"][0] for c in cells.values() if c["type"] == "TRELLIS_FF"}
    value = dict.fromkeys(made, 0) | {"0": 0, "1": 1}
    inside = {name: {"A": 0, "B": 0, "P": 0} for name, c in cells.items() if c["type"] == "MULT18X18D"}
    history = []
    for _ in range(CLOCKS):
        free = [*range(FIRST, FIRST + 36), ENABLE_1, ENABLE_2, RESET]
        value |= {bit: int(rng.integers(2)) for bit in free}

        def operand(cell, side):
            nets = cell["connections"]
            return sum(value[nets[f"{side}{n}"][0]] << n for n in range(BITS[side]))

        for name, state in inside.items():
            cell, on = cells[name], cells[name]["parameters"]
            a = state["A"] if "REG_INPUTA_CLK" in on else operand(cell, "A")
            b = state["B"] if "REG_INPUTB_CLK" in on else operand(cell, "B")
            state["made"] = a * b
            shown = state["P"] if "REG_OUTPUT_CLK" in on else a * b
            value |= {cell["connections"][f"P{n}"][0]: shown >> n & 1 for n in range(BITS["P"])}
        for cell in cells.values():  # a chain's cells stand in the order of their carries
            if cell["type"] == "CCU2C":
                add(cell["connections"], value)
        history.append(tuple(value[bit] for bit in module["ports"]["y"]["bits"]))
        after = {}
        for cell in cells.values():
            nets = cell["connections"]
            if cell["type"] == "TRELLIS_FF":
                held, enable = nets["Q"][0], nets.get("CE", ["1"])[0]
                after[held] = value[nets["DI"][0]] if value[enable] else value[held]
                if value[nets["LSR"][0]]:
                    after[held] = 0
        for name, state in inside.items():
            nets, on = cells[name]["connections"], cells[name]["parameters"]
            for side, place in (("A", "INPUTA"), ("B", "INPUTB"), ("P", "OUTPUT")):
                if f"REG_{place}_CLK" in on and value[nets[on[f"REG_{place}_CE"]][0]]:
                    state[side] = state["made"] if side == "P" else operand(cells[name], side)
        value |= after
    return history


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({}, {"A": 1, "B": 1, "P": 1, "removed": 72}),
        ({"enables": (ENABLE_1, ENABLE_2, None)}, {"A": 1, "B": 1, "P": 1, "removed": 72}),
        ({"enables": (None, ENABLE_1, ENABLE_2), "width": 12}, {"A": 1, "B": 1, "P": 1, "removed": 66}),
        # one bit with another enable, a reset, the other edge, the other start: its register stays outside,
        # and the other operand's with it, as nextpnr knows no multiplier with one of them
        ({"odd": {"A3": {"LSR": RESET}}}, {"A": 0, "B": 0, "P": 1, "removed": 36}),
        ({"odd": {"B0": {"CLKMUX": "INV"}}}, {"A": 0, "B": 0, "P": 1, "removed": 36}),
        ({"odd": {"P35": {"REGSET": "SET"}}}, {"A": 1, "B": 1, "P": 0, "removed": 36}),
        ({"odd": {"P35": {"LSR": RESET}}}, {"A": 1, "B": 1, "P": 0, "removed": 36}),
        (
            {"enables": (None, None, ENABLE_1), "odd": {"P1": {"CE": ENABLE_2}}},
            {"A": 1, "B": 1, "P": 0, "removed": 36},
        ),
        # something else reads an operand: its flip-flop stays; reads the product before its register: all stay
        ({"watched": [("A5", "Q")]}, {"A": 1, "B": 1, "P": 1, "removed": 71}),
        ({"watched": [("P5", "DI")]}, {"A": 1, "B": 1, "P": 0, "removed": 36}),
        ({"watched": [("P5", "Q")]}, {"A": 1, "B": 1, "P": 1, "removed": 72}),
    ],
)
def test_the_same_before_and_after(arguments, expected):
    before = design(**arguments)
    after = copy.deepcopy(before)
    assert absorb(after, "t") == expected
    if not any("INV" in odd.values() for odd in arguments.get("odd", {}).values()):  # one edge is simulated
        for seed in range(3):
            assert simulate(before, seed) == simulate(after, seed)


def test_the_simulation_sees_a_wrong_register():
    """Both of one netlist's operands delayed once more are another netlist."""
    before = design()
    after = copy.deepcopy(before)
    absorb(after, "t")
    del after["modules"]["t"]["cells"]["m"]["parameters"]["REG_INPUTA_CLK"]
    assert simulate(before, 0) != simulate(after, 0)


def with_twin(block: str = "", **changes) -> dict:
    """A product whose top bit two flip-flops hold, as they do where a product is wider than it needs to be."""
    netlist = design()
    module = netlist["modules"]["t"]
    top, twin = module["cells"]["P35"]["connections"]["DI"][0], 9999
    module["cells"][f"{block}twin"] = flip_flop(top, twin, **changes)
    module["ports"]["y"]["bits"].append(twin)
    return netlist


@pytest.mark.parametrize(
    ("changes", "gone"), [({}, 1), ({"enable": ENABLE_1}, 0), ({"LSR": RESET}, 0), ({"block": "other."}, 0)]
)
def test_twins_become_one(changes, gone):
    before = with_twin(**changes)
    after = copy.deepcopy(before)
    assert absorb(copy.deepcopy(before), "t")["P"] == 0
    assert merge_twins(after["modules"]["t"]) == gone
    assert absorb(after, "t")["P"] == gone
    assert simulate(after, 3) == simulate(before, 3)


@pytest.mark.parametrize(
    ("cells", "moved"),
    [
        (["LUT4"], 1),
        (["LUT4", "PFUMX"], 1),
        (["CCU2C"], 1),
        (["LUT4", "LUT4", "LUT4"], 0),
        (["LUT4", "CCU2C"], 0),
    ],
)
@pytest.mark.parametrize("logic_behind", [False, True])
def test_operands_behind_logic_stay_out(cells, moved, logic_behind):
    """An operand's register moves into the multiplier where the way to it is shorter than the one through it from
    outside: from behind little, and from behind anything where the product has no register and logic follows."""
    netlist = design()
    module = netlist["modules"]["t"]
    if logic_behind:
        product = module["cells"]["m"]["connections"]["P0"][0]
        nets = {"A": [product], "Z": [8999]}
        module["cells"]["behind"] = {
            "type": "LUT4",
            "parameters": {},
            "connections": nets,
            "port_directions": {"A": "input", "Z": "output"},
        }
        module["cells"]["P0"]["connections"]["DI"] = [8999]
    bit = module["cells"]["A0"]["connections"]["DI"][0]
    for n, kind in enumerate(cells):
        directions = {"A": "input", "Z": "output"}
        nets = {"A": [bit], "Z": [9000 + n]}
        module["cells"][f"logic_{n}"] = {
            "type": kind,
            "parameters": {},
            "connections": nets,
            "port_directions": directions,
        }
        bit = 9000 + n
    module["cells"]["A0"]["connections"]["DI"] = [bit]
    assert absorb(netlist, "t")["A"] == (moved or logic_behind)
