"""Refining a placement: delays read, paths reckoned, cells moved so that every slice, tile and block stays legal."""

from __future__ import annotations

import json
from collections import defaultdict

import numpy as np
import pytest

from scripts.synth import anneal, chip, sdf
from scripts.synth.floorplan import SITES, bel
from scripts.synth.paths import Paths
from scripts.synth.refine import EACH_READER, FROM_MULTIPLIER, INTO_CARRY, INTO_MULTIPLIER, beyond, refine

CLOCK, SLICES = 1, "ABCD"
DELAYS = """(DELAYFILE
  (CELL
    (CELLTYPE "TRELLIS_COMB")
    (INSTANCE a\\$1)
    (DELAY (ABSOLUTE
        (IOPATH A F (200:218:236) (200:218:236))
        (IOPATH (posedge CLK) Q (1:2:525) (1:2:525))
        (SETUPHOLD (posedge M) (posedge CLK) (10:20:30) (233:268:303))
"""


def test_delays_of_a_cell(tmp_path):
    (tmp_path / "delays.sdf").write_text(DELAYS)
    found = sdf.read(tmp_path / "delays.sdf")
    assert found.through == {("a$1", "A"): [("F", 236)]}
    assert found.clocked == {("a$1", "Q"): 525} and found.before == {("a$1", "M"): 30}


def test_a_delay_of_no_cell(tmp_path):
    (tmp_path / "delays.sdf").write_text("(DELAYFILE\n (IOPATH A F (1:2:3) (1:2:3))\n")
    with pytest.raises(ValueError, match=r"delays\.sdf:2: .*INSTANCE"):
        sdf.read(tmp_path / "delays.sdf")


class Made:
    """A netlist and its placement, cell by cell, and the SDF that goes with it."""

    def __init__(self):
        self.cells, self.delays, self.bits = {}, [], 100

    def add(self, kind: str, where: str, inputs: dict, output: str, parameters: dict | None = None) -> int:
        name, made = f"c{len(self.cells)}", self.bits
        self.bits += 1
        inputs = {**inputs, "CLK": CLOCK} if kind == "TRELLIS_FF" else inputs
        self.cells[name] = {
            "type": kind, "parameters": parameters or {}, "attributes": {chip.BEL: where},
            "connections": {output: [made], **{port: [bit] for port, bit in inputs.items()}},
            "port_directions": {output: "output", **dict.fromkeys(inputs, "input")},
        }  # fmt: skip
        self.delays.append(f"    (INSTANCE {name})")
        if kind == "TRELLIS_FF":
            self.delays.append("(IOPATH CLK Q (0:0:525) (0:0:525))")
            data = [port for port in inputs if port in ("DI", "M", "CE", "LSR")]
            self.delays += [f"(SETUPHOLD (posedge {port}) (posedge CLK) (0:0:0) (0:0:0))" for port in data]
        else:
            self.delays += [f"(IOPATH {port} {output} (0:0:236) (0:0:236))" for port in inputs]
        return made

    def write(self, folder):
        module = {"cells": self.cells, "settings": {}}
        (folder / "placed.json").write_text(json.dumps({"modules": {"top": module}}))
        (folder / "delays.sdf").write_text("\n".join(self.delays))
        return folder


def bel_of(x: int, y: int, lane: int, part: str) -> str:
    return f"X{x}/Y{y}/SLICE{SLICES[lane // 2]}.{part}{lane % 2}"


def scattered(seed: int = 1, count: int = 150) -> Made:
    """Chains of a flip-flop, two LUTs (now and then a wide multiplexer or eight carries) and the flip-flop beside
    the last, each cell anywhere; three clock enables, six resets."""
    made, generator = Made(), np.random.default_rng(seed)
    tiles = [(x, y) for x in range(3, 40) for y in range(11, 21)]
    free = [tiles[n] for n in generator.permutation(len(tiles))]
    enables = [made.add("TRELLIS_FF", bel_of(*free.pop(), 0, "FF"), {}, "Q") for _ in range(3)]
    resets = [made.add("TRELLIS_FF", bel_of(*free.pop(), 0, "FF"), {}, "Q") for _ in range(6)]
    for n in range(count):
        control = {"CE": enables[n % 3], **({"LSR": resets[n % 7]} if n % 7 < 6 else {})}
        tile = free[2 * n % len(free)]
        other = free[(2 * n + 1) % len(free)]
        lap = 2 * n // len(free)
        begin = made.add("TRELLIS_FF", bel_of(*tile, 2 * lap, "FF"), control, "Q")
        if n % 10 == 0:
            high = made.add("TRELLIS_COMB", bel_of(*other, 2 * lap + 1, "K"), {"A": begin}, "F")
            last = made.add("TRELLIS_COMB", bel_of(*other, 2 * lap, "K"), {"A": begin, "M": begin, "F1": high}, "OFX")
            made.add("TRELLIS_FF", bel_of(*other, 2 * lap + 1, "FF"), {"DI": high, **control}, "Q")
            made.add("TRELLIS_FF", bel_of(*tile, 2 * lap + 1, "FF"), {"M": last, **control}, "Q")
            continue
        if n % 10 == 1 and lap == 0:
            carry = made.add("TRELLIS_COMB", bel_of(*other, 0, "K"), {"A": begin}, "FCO", {"MODE": "CCU2"})
            for lane in range(1, 8):
                inputs = {"FCI": carry, "A": begin}
                carry = made.add("TRELLIS_COMB", bel_of(*other, lane, "K"), inputs, "FCO", {"MODE": "CCU2"})
            continue
        middle = made.add("TRELLIS_COMB", bel_of(*tile, 2 * lap + 1, "K"), {"A": begin}, "F")
        last = made.add("TRELLIS_COMB", bel_of(*other, 2 * lap, "K"), {"A": middle}, "F")
        made.add("TRELLIS_FF", bel_of(*other, 2 * lap, "FF"), {"DI": last, **control}, "Q")
    return made


def placed(folder) -> dict:
    return json.loads((folder / "placed.json").read_text())["modules"]["top"]["cells"]


def where(cell: dict) -> tuple[int, int, int]:
    x, y, slice_, _, half = chip._BEL.match(cell["attributes"][chip.BEL]).groups()
    return int(x), int(y), 2 * SLICES.index(slice_) + int(half)


def legal(cells: dict) -> None:
    """What nextpnr asks of slices and tiles, said again and not by the code under test."""
    at = [cell["attributes"][chip.BEL] for cell in cells.values()]
    assert len(set(at)) == len(at)
    driver = {bits[0]: name for name, c in cells.items() for port, bits in c["connections"].items()
              if c["port_directions"][port] == "output"}  # fmt: skip
    slices, tiles, luts = defaultdict(set), defaultdict(set), defaultdict(dict)
    for cell in cells.values():
        x, y, lane = where(cell)
        wired = cell["connections"]
        if cell["type"] == "TRELLIS_FF":
            slices[x, y, lane // 2].add((str(wired.get("CE")), str(wired.get("LSR"))))
            tiles[x, y].add(str(wired.get("LSR")))
            if "DI" in wired:
                assert where(cells[driver[wired["DI"][0]]]) == (x, y, lane)
            else:
                luts[x, y, lane]["M taken"] = True
        else:
            luts[x, y, lane]["chooses"] = "M" in wired
            slices[x, y, lane // 2, "carry"].add(cell["parameters"].get("MODE") == "CCU2")
            if "F1" in wired:
                assert where(cells[driver[wired["F1"][0]]]) == (x, y, lane + 1) and lane % 2 == 0
            if "FCI" in wired:
                assert where(cells[driver[wired["FCI"][0]]]) == (x, y, lane - 1)
    assert all(len(kinds) == 1 for kinds in slices.values())
    assert all(len(resets) == 1 for resets in tiles.values())
    assert not any(lane.get("chooses") and lane.get("M taken") for lane in luts.values())


def slowest(folder) -> float:
    cells = placed(folder)
    number = {name: n for n, name in enumerate(cells)}
    paths = Paths(cells, number, sdf.read(folder / "delays.sdf"))
    made = chip.load(cells, number, paths)
    wires = made.ps[abs(made.x[made.source] - made.x[made.sink]), abs(made.y[made.source] - made.y[made.sink])]
    return paths.slowest(wires + beyond(made, paths))[0] / 1000


def test_paths_get_shorter_and_everything_stays_legal(tmp_path):
    folder = scattered().write(tmp_path)
    legal(placed(folder))
    before = slowest(folder)
    after = refine(folder, 1, rounds=40)
    legal(placed(folder))
    assert after == slowest(folder) and after < 0.75 * before
    moved = {name: cell["attributes"][chip.BEL] for name, cell in placed(folder).items()}
    again = tmp_path / "again"
    again.mkdir()
    refine(scattered().write(again), 1, rounds=40)
    assert moved == {name: cell["attributes"][chip.BEL] for name, cell in placed(again).items()}


@pytest.mark.parametrize("rule", ["_slice_fits", "_tile_fits"])
def test_the_rules_are_needed(tmp_path, monkeypatch, rule):
    """Without either the same moves end in an illegal placement: the check above can fail."""
    monkeypatch.setattr(anneal, rule, anneal.njit(lambda *given: True))
    anneal.anneal.recompile()
    try:
        folder = scattered().write(tmp_path)
        refine(folder, 1, rounds=20, heat=20.0)
        with pytest.raises(AssertionError):
            legal(placed(folder))
    finally:
        monkeypatch.undo()
        anneal.anneal.recompile()


def test_a_path_by_hand(tmp_path):
    made = Made()
    begin = made.add("TRELLIS_FF", bel_of(3, 3, 0, "FF"), {}, "Q")
    last = made.add("TRELLIS_COMB", bel_of(5, 3, 0, "K"), {"A": begin}, "F")
    made.add("TRELLIS_FF", bel_of(5, 3, 0, "FF"), {"DI": last}, "Q")
    made.add("TRELLIS_FF", bel_of(5, 9, 0, "FF"), {"M": last}, "Q")
    folder = made.write(tmp_path)
    assert slowest(folder) == pytest.approx((525 + (640 + 2 * 85) + 236 + (640 + 6 * 85)) / 1000)


def test_what_takes_longer_than_its_way(tmp_path):
    """Many readers, a multiplier at either end, a carry chain at the end."""
    made = Made()
    begin = made.add("TRELLIS_FF", bel_of(3, 3, 0, "FF"), {}, "Q")
    product = made.add("MULT18X18D", bel(0), {"A0": begin}, "P0")
    for n in range(3):
        made.add("TRELLIS_FF", bel_of(5 + n, 3, 0, "FF"), {"M": begin if n else product}, "Q")
    made.add("TRELLIS_COMB", bel_of(9, 3, 0, "K"), {"A": product}, "FCO", {"MODE": "CCU2"})
    cells = placed(made.write(tmp_path))
    number = {name: n for n, name in enumerate(cells)}
    paths = Paths(cells, number, sdf.read(tmp_path / "delays.sdf"))
    more = beyond(chip.load(cells, number, paths), paths)
    behind = EACH_READER + FROM_MULTIPLIER  # two readers
    assert sorted(more) == [*[2 * EACH_READER] * 2, 2 * EACH_READER + INTO_MULTIPLIER, behind, behind + INTO_CARRY]


def test_a_loop_is_told(tmp_path):
    made = Made()
    made.add("TRELLIS_COMB", bel_of(3, 3, 0, "K"), {"A": 101}, "F")
    made.add("TRELLIS_COMB", bel_of(3, 3, 1, "K"), {"A": 100}, "F")
    with pytest.raises(ValueError, match="loop through 2 pins"):
        slowest(made.write(tmp_path))


def test_multipliers_move_where_asked(tmp_path):
    made = Made()
    for n in range(8):
        x, y = 5 + n, 12
        a = made.add("TRELLIS_FF", bel_of(x, y, 0, "FF"), {}, "Q")
        p = made.add("MULT18X18D", bel(len(SITES) - 1 - n), {"A0": a, "CE0": 5000 + n}, "P0")
        made.add("TRELLIS_FF", bel_of(x, y, 2, "FF"), {"M": p}, "Q")
    folder = made.write(tmp_path)
    start = {name: cell["attributes"][chip.BEL] for name, cell in placed(folder).items() if "MULT" in cell["type"]}
    refine(folder, 1, rounds=5)
    assert all(placed(folder)[name]["attributes"][chip.BEL] == was for name, was in start.items())
    before = slowest(folder)
    assert refine(folder, 1, multipliers=True, rounds=60) < 0.6 * before
    sites = [SITES.index((int(b[0][1:]), int(b[1][1:]), int(b[2][-1]))) for b in
             (placed(folder)[name]["attributes"][chip.BEL].split("/") for name in start)]  # fmt: skip
    assert len(set(sites)) == 8
