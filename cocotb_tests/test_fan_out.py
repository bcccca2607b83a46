"""Cells copied for many readers: made-up netlists compute the same, and nothing has more readers than is allowed."""

from __future__ import annotations

import copy

import pytest

from cocotb_tests.test_multiplier_registers import ENABLE_1, FIRST, RESET, flip_flop, simulate
from scripts.synth.fan_out import COPY, MOST_LATE, share_out, shares
from scripts.synth.netlist import Nets

READERS, MOST = 100, 8


def design(resets: bool = False) -> dict:
    """A bit through two registers that enables and is read by ``READERS`` registers in turn; or resets some as well."""
    cells = {"early": flip_flop(FIRST, 100), "late": flip_flop(100, 101, ENABLE_1, LSR=RESET)}
    for n in range(READERS):
        given, q = FIRST + 1 + n % 30, 200 + n
        cells[f"r{n:02d}"] = (
            flip_flop(given, q, 101) if n % 3 == 0
            else flip_flop(given, q, LSR=101) if n % 3 == 1 and resets
            else flip_flop(101, q)
        )  # fmt: skip
    ports = {"y": {"direction": "output", "bits": [200 + n for n in range(READERS)]}}
    return {"modules": {"t": {"cells": cells, "ports": ports}}}


def fan_outs(netlist: dict) -> list[int]:
    nets = Nets(netlist["modules"]["t"])
    return [len(nets.readers[bit]) for bit in nets.driver]


def test_copies_do_what_the_register_did():
    before = design()
    after = copy.deepcopy(before)
    assert max(fan_outs(before)) == READERS
    added = share_out(after, "t", MOST)
    assert max(fan_outs(after)) <= MOST
    # 100 readers are 13 copies' work, and 13 copies two registers' in front of them.
    assert added == 12 + 1
    assert simulate(after, 1) == simulate(before, 1)


def test_what_is_reset_shares_a_reset():
    """Those of a tile must have one reset: they all keep theirs, apart from what else reads the bit."""
    before = design(resets=True)
    after = copy.deepcopy(before)
    share_out(after, "t", MOST)
    cells = after["modules"]["t"]["cells"].values()
    resets = {tuple(cell["connections"]["LSR"]) for cell in cells if cell["connections"].get("LSR", ["0"]) != ["0"]}
    assert len(resets - {(RESET,)}) == 1
    rest = [cell["connections"][port][0] for cell in cells for port in ("CE", "DI") if port in cell["connections"]]
    assert not {bit for (bit,) in resets} & set(rest)
    assert simulate(after, 1) == simulate(before, 1)


@pytest.mark.parametrize("break_it", ["DI", "CE"])
def test_a_copy_with_another_input_is_noticed(break_it):
    before = design()
    after = copy.deepcopy(before)
    share_out(after, "t", MOST)
    name = next(name for name in after["modules"]["t"]["cells"] if COPY in name and name.startswith("late"))
    after["modules"]["t"]["cells"][name]["connections"][break_it] = [FIRST + 35]
    assert simulate(before, 1) != simulate(after, 1)


def gate(kind: str, ports: dict) -> dict:
    """A cell whose output is Z."""
    directions = {port: "output" if port == "Z" else "input" for port in ports}
    connections = {port: [bit] for port, bit in ports.items()}
    return {"type": kind, "parameters": {}, "connections": connections, "port_directions": directions}


def test_a_late_register_has_fewer_copies():
    """Three LUTs in front of the register that a hundred read."""
    netlist = design()
    cells = netlist["modules"]["t"]["cells"]
    for n in range(3):
        cells[f"l{n}"] = gate("LUT4", {"A": 100 if n == 0 else 599 + n, "Z": 600 + n})
    cells["late"]["connections"]["DI"] = [602]
    assert share_out(netlist, "t", MOST) == -(-READERS // MOST_LATE) - 1
    assert max(fan_outs(netlist)) <= MOST_LATE
    copies = [cell for name, cell in cells.items() if name.startswith("late")]
    assert {cell["connections"]["DI"][0] for cell in copies} == {602}


def test_a_late_lut_stands_beside_each_of_its_flip_flops():
    """LUTs in a row and a multiplexer of the slice at their end: both flip-flops behind it get all of the slice."""
    netlist = design()
    cells = netlist["modules"]["t"]["cells"]

    for n in range(3):
        cells[f"l{n}"] = gate("LUT4", {"A": 100 if n == 0 else 599 + n, "Z": 600 + n})
    for n in (0, 1):
        cells[f"half{n}"] = gate("LUT4", {"A": 602, "Z": 610 + n})
        cells[f"taker{n}"] = flip_flop(620, 630 + n)
    cells["mux"] = gate("PFUMX", {"ALUT": 610, "BLUT": 611, "C0": FIRST, "Z": 620})
    assert share_out(netlist, "t", READERS) == 3
    first, second = (cells[f"taker{n}"]["connections"]["DI"][0] for n in (0, 1))
    nets = Nets(netlist["modules"]["t"])
    muxes = [cells[nets.driver[bit]]["connections"] for bit in (first, second)]
    assert len({first, second}) == 2
    assert len({mux[port][0] for mux in muxes for port in ("ALUT", "BLUT")}) == 4
    assert {mux["C0"][0] for mux in muxes} == {FIRST}


def test_other_bits_of_a_port_stay():
    netlist = design()
    cells = netlist["modules"]["t"]["cells"]
    for n in range(READERS):
        port = {"DI": [300 + n, 101, "0", 400 + n]}
        cells[f"m{n:02d}"] = {
            "type": "TRELLIS_DPR16X4", "parameters": {}, "connections": port, "port_directions": {"DI": "input"}
        }  # fmt: skip
    share_out(netlist, "t", MOST)
    ports = [cells[f"m{n:02d}"]["connections"]["DI"] for n in range(READERS)]
    assert [(a, c, d) for a, _, c, d in ports] == [(300 + n, "0", 400 + n) for n in range(READERS)]
    assert len({b for _, b, _, _ in ports}) > 1


def test_readers_of_one_register_stay_together():
    netlist = design()
    share_out(netlist, "t", MOST)
    cells = netlist["modules"]["t"]["cells"]
    reads = [max(bits[0] for port, bits in cells[f"r{n:02d}"]["connections"].items() if port in ("CE", "LSR", "DI")
                 and bits[0] not in ("0", *range(FIRST, 99))) for n in range(READERS)]  # fmt: skip
    assert sum(a != b for a, b in zip(reads, reads[1:], strict=False)) == 12


def test_kept_cells_are_not_copied():
    netlist = design()
    netlist["modules"]["t"]["cells"]["late"]["attributes"] = {"keep": 1}
    assert share_out(netlist, "t", MOST) == 0


def test_luts_are_shared_out_by_what_they_serve():
    """Two blocks of LUTs whose own names alternate: each copy serves one block."""
    cells = {"source": flip_flop(FIRST, 100)}
    for n in range(16):
        ports = {"A": [100], "Z": [200 + n]}
        directions = {"A": "input", "Z": "output"}
        cells[f"l{n:02d}"] = {"type": "LUT4", "parameters": {}, "connections": ports, "port_directions": directions}
        cells[f"{'ab'[n % 2]}.r{n:02d}"] = flip_flop(200 + n, 300 + n)
    netlist = {"modules": {"t": {"cells": cells, "ports": {}}}}
    assert share_out(netlist, "t", 8) == 1
    read = [{cells[f"l{n:02d}"]["connections"]["A"][0] for n in range(block, 16, 2)} for block in (0, 1)]
    assert len(read[0]) == len(read[1]) == 1 and read[0] != read[1]


def test_multipliers_of_a_block_share_their_enable():
    """Four share a site, which has few enables: by their names alone, each would read another copy."""
    cells = {"source": flip_flop(FIRST, 100)}
    for n in range(24):
        cells[f"b.r{n:02d}"] = flip_flop(FIRST + 1, 200 + n, 100)
    for n in range(4):
        cells[f"b.r{6 * n:02d}_product"] = {
            "type": "MULT18X18D", "parameters": {}, "connections": {"CE0": [100], "P0": [300 + n]},
            "port_directions": {"CE0": "input", "P0": "output"},
        }  # fmt: skip
    netlist = {"modules": {"t": {"cells": cells, "ports": {}}}}
    assert share_out(netlist, "t", 8) > 1
    assert len({cells[f"b.r{6 * n:02d}_product"]["connections"]["CE0"][0] for n in range(4)}) == 1


@pytest.mark.parametrize(
    ("blocks", "apart", "parts"),
    [
        ("aaabbbccc", False, ["aaabbb", "ccc"]),  # as many blocks as go together, none cut
        ("aaabbbccc", True, ["aaa", "bbb", "ccc"]),
        ("aabbbbbbb", False, ["aa", "bbbbbbb"]),
        ("a" * 9 + "bb", False, ["a" * 5, "aaaabb"]),  # a large one in equal parts
    ],
)
def test_blocks_are_cut_only_where_they_are_large(blocks, apart, parts):
    readers = [(block, n) for n, block in enumerate(blocks)]
    found = shares(readers, 8, apart)
    assert ["".join(block for block, _ in part) for part in found] == parts
    assert [reader for part in found for reader in part] == readers


@pytest.mark.parametrize(
    ("parameters", "before", "copied"),
    [({}, "flip-flop", 1), ({"REG_INPUTA_CLK": "CLK0"}, "flip-flop", 0), ({}, "LUT", 0)],
)
def test_a_multiplier_has_its_operand_for_itself(parameters, before, copied):
    """A register that a multiplier of one block and a register of another read: two, where a net more before it costs
    nothing and the multiplier has no register itself."""
    ports = {"A0": [101], "B0": [FIRST], "P0": [200]}
    cells = {
        "c.first": flip_flop(FIRST + 1, 100),
        "c.setting": flip_flop(100, 101, ENABLE_1, LSR=RESET),
        "a.product": {
            "type": "MULT18X18D", "parameters": parameters, "connections": ports,
            "port_directions": {port: "output" if port == "P0" else "input" for port in ports},
        },
        "a.taken": flip_flop(200, 201),
        "b.other": flip_flop(101, 202),
    }  # fmt: skip
    if before == "LUT":
        cells["c.first"] = {
            "type": "LUT4", "parameters": {}, "connections": {"A": [FIRST + 1], "Z": [100]},
            "port_directions": {"A": "input", "Z": "output"},
        }  # fmt: skip
        cells["c.source"] = flip_flop(FIRST + 2, FIRST + 1)
    outputs = {"y": {"direction": "output", "bits": [201, 202]}}
    netlist = {"modules": {"t": {"cells": cells, "ports": outputs}}}
    assert share_out(netlist, "t", READERS) == copied
    assert (cells["a.product"]["connections"]["A0"] != cells["b.other"]["connections"]["DI"]) == bool(copied)
