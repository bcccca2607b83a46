"""Three summands in one carry chain: made-up netlists add the same before and after, whatever they are given."""

from __future__ import annotations

import copy
from itertools import count

import numpy as np
import pytest

from scripts.synth.carry_save import PLAIN, save_carries

CASES = 400
SIZES = {"a": 5, "b": 7, "c": 12}  # bits of the given numbers


def cell(kind: str, parameters: dict, nets: dict, outputs: tuple[str, ...]) -> dict:
    directions = {port: "output" if port in outputs else "input" for port in nets}
    connections = {port: [bit] for port, bit in nets.items()}
    return {"type": kind, "parameters": parameters, "connections": connections, "port_directions": directions}


class Netlist:
    """Chains of adders over the given bits; ``y`` = what is looked at."""

    def __init__(self):
        self.bits = count(2)
        self.given = {name: [next(self.bits) for _ in range(n)] for name, n in SIZES.items()}
        self.cells: dict[str, dict] = {}
        self.y: list = []

    def multiplier(self, name: str, a: list, b: list) -> list:
        """Its product's 36 bits; ``a``, ``b`` are extended by their last bits."""
        made = [next(self.bits) for _ in range(36)]
        nets = {f"A{n}": a[min(n, len(a) - 1)] for n in range(18)} | {f"B{n}": b[min(n, len(b) - 1)] for n in range(18)}
        nets |= {"SIGNEDA": "1", "SIGNEDB": "1"} | {f"P{n}": bit for n, bit in enumerate(made)}
        self.cells[name] = cell("MULT18X18D", {}, nets, tuple(f"P{n}" for n in range(36)))
        return made

    def chain(self, name: str, a: list, b: list, minus: str = "0", carry="0", **changes) -> list:
        """The bits of a + b, of a - b - 1 with ``minus`` "1"; ``changes`` to the parameters of its cells."""
        total = []
        for n in range(0, len(a), 2):
            nets = {"CIN": carry, "COUT": next(self.bits)}
            for k in (0, 1):
                inside = n + k < len(a)
                nets |= {f"A{k}": a[n + k] if inside else "0", f"B{k}": b[n + k] if inside else "0"}
                nets |= {f"C{k}": minus if inside else "0", f"D{k}": "1", f"S{k}": next(self.bits)}
                total.append(nets[f"S{k}"])
            self.cells[f"{name}.{n}"] = cell("CCU2C", PLAIN | changes, nets, ("COUT", "S0", "S1"))
            carry = nets["COUT"]
        return total[: len(a)]

    def made(self) -> dict:
        ports = {"y": {"direction": "output", "bits": self.y}}
        return {"modules": {"t": {"cells": self.cells, "ports": ports}}}


def evaluate(netlist: dict, given: dict[int, int]) -> list[int]:
    """The bits of y, cell by cell as the data sheet says what they do."""
    module = netlist["modules"]["t"]
    value = {"0": 0, "1": 1, **given}
    waiting = list(module["cells"].values())

    def signed(nets: dict, side: str) -> int:
        number = sum(value[nets[f"{side}{n}"][0]] << n for n in range(18))
        return number - (number >> 17 << 18) * value[nets[f"SIGNED{side}"][0]]

    while waiting:
        left = []
        for one in waiting:
            nets = one["connections"]
            if any(nets[p][0] not in value for p, d in one["port_directions"].items() if d == "input"):
                left.append(one)
            elif one["type"] == "MULT18X18D":
                product = signed(nets, "A") * signed(nets, "B")
                value |= {nets[f"P{n}"][0]: product >> n & 1 for n in range(36)}
            elif one["type"] == "LUT4":
                index = sum(value[nets[pin][0]] << n for n, pin in enumerate("ABCD"))
                value[nets["Z"][0]] = int(one["parameters"]["INIT"][15 - index])
            else:
                carry = value[nets["CIN"][0]]
                for k in (0, 1):
                    table = one["parameters"][f"INIT{k}"]
                    index = sum(value[nets[f"{pin}{k}"][0]] << n for n, pin in enumerate("ABCD"))
                    passes, makes = int(table[15 - index]), int(table[15 - index % 4])
                    value[nets[f"S{k}"][0]] = passes ^ carry
                    carry = carry if passes else makes
                value[nets["COUT"][0]] = carry
        assert len(left) < len(waiting), "a loop"
        waiting = left
    return [value[bit] for bit in module["ports"]["y"]["bits"]]


def alike(before: dict, after: dict, given: list[int]) -> bool:
    rng = np.random.default_rng(1)
    signs = {bits[-1] for bits in Netlist().given.values()}
    extremes = [dict.fromkeys(given, 0), dict.fromkeys(given, 1), {bit: int(bit in signs) for bit in given}]
    cases = extremes + [dict(zip(given, rng.integers(0, 2, len(given)).tolist(), strict=True)) for _ in range(CASES)]
    return all(evaluate(before, case) == evaluate(after, case) for case in cases)


def added(longer=0, side="A", minus="0", shift=2, carry="0", wide=12, **changes) -> tuple[dict, list[int]]:
    """a*b of two multipliers with a in two parts, put together by one chain, c added by another, ``longer`` bits longer
    at the top and ``shift`` at the bottom; the netlist and the given bits."""
    n = Netlist()
    a, b, c = (n.given[name] for name in "abc")
    low = n.multiplier("low", [*a[:3], "0"], b)
    high = n.multiplier("high", a[3:], b)
    top = low[9:10] * 20  # 3 + 1 and 7 bits: 10 of the product are its value
    pair = [*low[3:9], *top], [*high[:8], *[high[8]] * 20]
    parts = n.chain("parts", *(bits[: wide - 3] for bits in pair), carry=carry, **changes)
    one = [*low[3 - shift : 3], *parts] + parts[-1:] * longer
    other = [c[min(k, 11)] for k in range(len(one))]
    pair = (one, other) if side == "A" else (other, one)
    n.y = n.chain("sum", *pair, minus=minus)
    return n.made(), [*a, *b, *c]


@pytest.mark.parametrize("longer", [0, 1, 4])
@pytest.mark.parametrize(("side", "minus"), [("A", "0"), ("A", "1"), ("B", "0")])
@pytest.mark.parametrize("shift", [0, 1, 3])
def test_the_same_sum_with_one_chain_less(longer, side, minus, shift):
    before, given = added(longer, side, minus, shift)
    after = copy.deepcopy(before)
    done = save_carries(after, "t")
    assert done["chains"] == 1 and 0 < done["luts"] <= 2 * (9 + longer)
    assert not any(name.startswith("parts") for name in after["modules"]["t"]["cells"])
    assert alike(before, after, given)


@pytest.mark.parametrize(
    "arguments",
    [
        {"side": "B", "minus": "1"},  # the sum is taken away
        {"carry": "1"},
        {"INJECT1_0": "YES"},
        {"longer": 1, "wide": 9},  # a + b may not fit the first chain: its top bit is no sign that both have
        {"longer": 1, "wide": 11},  # only -2**4 * -2**6 does not
    ],
)
def test_left_as_it_is(arguments):
    before, _ = added(**arguments)
    after = copy.deepcopy(before)
    assert save_carries(after, "t") == {"chains": 0, "luts": 0}
    assert after == before


def test_one_that_does_not_fit_is_merged_where_nothing_repeats_its_sign():
    before, given = added(0, wide=9)
    after = copy.deepcopy(before)
    assert save_carries(after, "t")["chains"] == 1
    assert alike(before, after, given)


@pytest.mark.parametrize(("cell", "port"), [("parts.2", "S0"), ("parts.2", "COUT"), ("sum.4", "COUT")])
def test_where_something_else_reads_a_sum_or_a_carry_nothing_changes(cell, port):
    before, _ = added()
    module = before["modules"]["t"]
    module["ports"]["y"]["bits"] += module["cells"][cell]["connections"][port]
    after = copy.deepcopy(before)
    assert save_carries(after, "t")["chains"] == 0
    assert after == before


def test_the_evaluation_sees_a_wrong_table():
    before, given = added(1)
    after = copy.deepcopy(before)
    save_carries(after, "t")
    lut = next(one for one in after["modules"]["t"]["cells"].values() if one["type"] == "LUT4")
    lut["parameters"]["INIT"] = lut["parameters"]["INIT"].translate(str.maketrans("01", "10"))
    assert not alike(before, after, given)
