# SPDX-License-Identifier: BSD-3-Clause
"""Longest paths and DSP registers of `make synth`, on small netlists whose answer is counted by hand."""

from __future__ import annotations

import json

import pytest

from scripts.synth import levels, multipliers
from scripts.synth.netlist import BLOCK, Cell, Netlist, block_of, marks, read, vhdl_line


def flip_flop(name: str, d: int | str, q: int, block: str = "b") -> Cell:
    return Cell(name, "FDRE", {}, {"C": [1], "CE": ["1"], "D": [d], "R": ["0"]}, {"Q": [q]}, block)


def lut(name: str, inputs: list[int], out: int) -> Cell:
    return Cell(name, f"LUT{len(inputs)}", {}, {f"I{n}": [bit] for n, bit in enumerate(inputs)}, {"O": [out]})


def carry(name: str, carry_in: int | str, s: list, di: list, o: list, co: list) -> Cell:
    return Cell(name, "CARRY4", {}, {"CI": [carry_in], "CYINIT": ["0"], "S": s, "DI": di}, {"O": o, "CO": co})


def only_path(cells: list[Cell], names: dict | None = None) -> levels.Path:
    (path,) = levels.longest(Netlist(cells, names or {})).values()
    return path


def dsp(a: list, b: list, p: list, c: list = (), pcin: list = (), block: str = "b", **parameters) -> Cell:
    inputs = {"A": a, "B": b, "C": c, "PCIN": pcin, "CLK": [1]}
    return Cell("m", "DSP48E1", {"USE_DPORT": "FALSE", **parameters}, inputs, {"P": p}, block)


# Paths


def test_longest_path_is_selected():
    """10 -> LUT -> LUT -> 21 and 11 -> LUT -> 21."""
    cells = [flip_flop("a", "0", 10), flip_flop("b", "0", 11), flip_flop("c", 21, 12)]
    cells += [lut("x", [10], 20), lut("y", [20, 11], 21)]
    path = only_path(cells, {10: ["b.first"], 12: ["b.last"]})
    assert (path.start, path.end) == ("b.first", "b.last")
    assert {k: n for k, n in path.cells.items() if n} == {"lut": 2}


def test_a_carry_chain_counts_its_cells():
    """LUT into the lowest bit of three CARRY4 in a row, the sum's highest bit into the register."""
    chain = []
    for k in range(3):
        carry_in, lowest = ("0", 20) if k == 0 else (100 + 10 * k - 7, "0")  # the carry out of the cell before
        sums, carries = ([base + 10 * k + n for n in range(4)] for base in (200, 100))
        chain.append(carry(f"c{k}", carry_in, [lowest, "0", "0", "0"], ["0"] * 4, sums, carries))
    path = only_path([flip_flop("a", "0", 10), lut("x", [10], 20), *chain, flip_flop("z", 223, 11)])
    assert (path.cells["lut"], path.cells["carry4"]) == (1, 3)


def test_a_carry_never_runs_down():
    """The highest bit of S does not reach the lowest sum: the path is the one through bit 0."""
    cell = carry("c", "0", [10, "0", "0", 20], ["0"] * 4, [30, 31, 32, 33], [40, 41, 42, 43])
    cells = [flip_flop("a", "0", 10), flip_flop("b", "0", 11), lut("x", [11], 20), cell]
    assert only_path([*cells, flip_flop("z", 30, 12)]).cells["lut"] == 0
    assert only_path([*cells, flip_flop("z", 33, 12)]).cells["lut"] == 1


def test_each_block_has_its_own_path_and_ports_begin_none():
    cells = [flip_flop("a", "0", 10, "one"), lut("x", [10], 20), flip_flop("b", 20, 11, "two")]
    cells += [lut("y", [99], 21), lut("z", [21], 22), flip_flop("c", 22, 12, "three")]  # 99 is an input
    found = levels.longest(Netlist(cells, {}))
    assert list(found) == ["two"] and (found["two"].start, found["two"].cells["lut"]) == ("a", 1)


@pytest.mark.parametrize(
    ("registers", "into", "out_of"),
    [
        ({"AREG": 1, "BREG": 1, "MREG": 1, "PREG": 1}, {}, {}),
        ({"AREG": 1, "BREG": 1, "MREG": 1}, {}, {"add": 1}),
        ({"AREG": 1, "BREG": 1}, {}, {"multiply": 1}),
        ({"MREG": 1, "PREG": 1}, {"multiply": 1}, {}),
        ({"MREG": 1}, {"multiply": 1}, {"add": 1}),
        ({"PREG": 1}, {"multiply": 1}, {}),
        ({}, None, {"multiply": 1}),  # all the way from the flip-flop in front to the one behind
    ],
)
def test_registers_of_a_dsp_cut_paths(registers, into, out_of):
    cells = [flip_flop("f", "0", 10, "front"), dsp([10], ["1"], [20], **registers), flip_flop("g", 20, 11, "behind")]
    found = levels.longest(Netlist(cells, {}))
    used = {block: {k: n for k, n in path.cells.items() if n} for block, path in found.items()}
    assert used["behind"] == out_of
    assert found["behind"].start == ("f" if into is None else "DSP48E1 of b")
    assert used.get("b") == into


def test_a_cascade_adds_without_a_register():
    """PCIN -> P of a DSP48E1 whose product is registered, whose sum is not."""
    first = dsp([10], ["1"], [20], AREG=1, BREG=1, MREG=1, PREG=1)
    second = dsp(["0"], ["1"], [30], pcin=[20], AREG=1, BREG=1, MREG=1)
    found = levels.longest(Netlist([first, second, flip_flop("g", 30, 11, "behind")], {}))
    assert found["behind"].cells["add"] == 1 and found["behind"].cells["multiply"] == 0


def test_memory_is_read_like_a_lut_and_written_at_the_clock():
    inputs = {"ADDRA": [10], "ADDRD": [11], "DIA": [12], "WE": [13], "WCLK": [1]}
    cells = [flip_flop(f"f{n}", "0", n) for n in (10, 11, 12)] + [lut("x", [11], 13)]
    cells += [Cell("r", "RAM64M", {}, inputs, {"DOA": [20]}, "ram"), flip_flop("g", 20, 30, "behind")]
    found = levels.longest(Netlist(cells, {}))
    assert found["behind"].cells["memory"] == 1 and found["behind"].start == "f10"
    assert found["ram"].cells == {**dict.fromkeys(levels.WEIGHT, 0), "lut": 1}


def test_what_cannot_be_timed_is_an_error():
    with pytest.raises(ValueError, match="no cell URAM288"):
        levels.longest(Netlist([Cell("u", "URAM288")], {}))
    with pytest.raises(ValueError, match="loop without a register"):
        levels.longest(Netlist([lut("x", [21], 20), lut("y", [20], 21)], {}))


# Multipliers


def test_operands_are_named_by_where_they_come_from():
    cells = [flip_flop("f", "0", 10), lut("x", [10], 20), flip_flop("h", "0", 12)]
    cells += [dsp([10, 10], [20, 12], [30], block="logic", MREG=1)]
    cells += [dsp([10, 12], ["1", "0"], [31], [20], block="outside", AREG=0, PREG=1)]
    cells += [dsp([20], [12], [32], [10], block="inside", AREG=1, BREG=2, MREG=1, CREG=1)]
    cells += [dsp([30], [99], [33], block="bare", AREG=0)]
    found = {m.block: m for m in multipliers.multipliers(Netlist(cells, {}))}
    assert found["logic"].operands == {"A": "flip-flops", "B": "logic"} and found["logic"].addend == ""
    assert found["outside"].operands == {"A": "flip-flops", "B": "constant"} and found["outside"].addend == "logic"
    assert found["inside"].missing == [] and found["inside"].addend == "register"
    assert found["bare"].missing == ["A from DSP48E1", "B from input", "product and sum"]
    counts = multipliers.summary(list(found.values()))
    assert (counts["number"], counts["product_or_sum_registered"], counts["operands_registered"]) == (4, 3, 1)
    assert [one["block"] for one in counts["without"]] == ["bare", "logic", "outside"]
    lines = multipliers.table(list(found.values())).splitlines()
    assert len(lines) == 4 and not any("inside" in line for line in lines[1:])


# What yosys writes


def test_a_netlist_is_read(tmp_path):
    """Blocks from the attribute, else from the names; parameters as numbers; VHDL lines from GHDL's comments."""
    verilog = ["module m", "  /* io/x.vhd:12:3  */", "  assign n6_o = a * b;", "module n", "  assign y = z;"]
    directions = {"C": "input", "D": "input", "Q": "output", "P": "output"}

    def cell(kind, attributes=None, **connections):
        ports = {port: directions[port] for port in connections}
        return {"type": kind, "attributes": attributes or {}, "connections": connections, "port_directions": ports,
                "parameters": {"AREG": "0" * 31 + "1", "USE_DPORT": "FALSE"}}  # fmt: skip

    cells = {
        "$auto$ff.cc:1": cell("FDRE", {BLOCK: "core.one", "src": "design.v:3.3-4.4|/share/ff_map.v:6"}, D=[3], Q=[4]),
        "$auto$ff.cc:2": cell("FDRE", {"src": "design.v:5.1"}, D=[3], Q=[5]),
        "$flatten\\core.\\one.$mul$7": cell("DSP48E1", P=[6]),
        "core": cell("$scopeinfo"),
    }
    nets = {"core.two.n12_q": {"bits": [5]}, "core.two.held": {"bits": [5, "0"]}, "$x": {"bits": [4]}}
    path = tmp_path / "netlist.json"
    path.write_text(json.dumps({"modules": {"top": {"cells": cells, "netnames": nets}}}))
    netlist = read(path, "top", ["core.one", "core.two"], verilog)
    assert [c.block for c in netlist.cells] == ["core.one", "core.two", "core.one"]
    assert [c.source for c in netlist.cells] == ["io/x.vhd:12", "", ""]
    assert netlist.cells[2].number("AREG") == 1 and netlist.cells[2].number("BREG") == 0
    assert netlist.names == {5: ["core.two.held", "core.two.n12_q"]}


def test_a_block_begins_with_its_whole_name():
    assert block_of("$flatten\\core.\\speed.$mul", ["core.speed", "core.speed_pi"]) == "core.speed"
    assert block_of("core.speed_pi.x", ["core.speed", "core.speed_pi"]) == "core.speed_pi"
    assert block_of("core.speedy.x", ["core.speed"]) == ""
    assert marks(["core.one"]) == ['setattr -set block "core.one" c:$flatten?core.?one.*']


def test_a_vhdl_line_is_not_that_of_the_module_before():
    assert vhdl_line(["/* a.vhd:1:1 */", "module m", "  assign x = y;"], "design.v:3.1") == ""
