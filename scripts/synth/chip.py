"""A placed ECP5 design as `anneal` moves it: what nextpnr wrote, in numbers, and back."""

from __future__ import annotations

import re
from collections import defaultdict

import numpy as np

from scripts.synth.anneal import FLIP_FLOP, LANES, LUT, MULTIPLIER, NONE, Chip
from scripts.synth.floorplan import KIND, SITES, bel
from scripts.synth.paths import Paths

BEL = "NEXTPNR_BEL"
KINDS = {"TRELLIS_COMB": LUT, "TRELLIS_FF": FLIP_FLOP, KIND: MULTIPLIER}
MEMORY = ("DPRAM", "RAMW_BLOCK")  # distributed memory takes its whole tile and stays
TOGETHER = ("FCI", "F1", "FXA", "FXB")  # inputs over wires of slices: cells joined by them keep their shape
SLICES = "ABCD"
_BEL = re.compile(r"X(\d+)/Y(\d+)/(?:SLICE([A-D])\.([A-Z]+)([01])|\w+)")
PER_PS = 0.02  # cost of a wire to one reader, by what it takes
SIZE = 140  # columns and rows of the largest device, and some


def picoseconds(columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """About what half of the wires over so many tiles take when this core is routed: nextpnr's own estimate is too
    little for the near ones, which go through the same switches, and too much for the far."""
    tiles = columns + rows
    return np.where(tiles == 0, 480.0, 640.0 + 85.0 * np.minimum(tiles, 6) + 70.0 * np.maximum(tiles - 6, 0))


def _mark(table: dict, key: tuple) -> int:
    return table.setdefault(key, len(table))


class Groups:
    """Cells that keep their shape: a carry chain, a multiplexer of more than a LUT."""

    def __init__(self, count: int):
        self._leader = list(range(count))

    def leader(self, cell: int) -> int:
        while self._leader[cell] != cell:
            self._leader[cell] = self._leader[self._leader[cell]]
            cell = self._leader[cell]
        return cell

    def join(self, one: int, other: int) -> None:
        self._leader[self.leader(one)] = self.leader(other)


def load(cells: dict, number: dict[str, int], paths: Paths) -> Chip:
    """``cells`` of a module as nextpnr wrote it after a placement, in the order of ``number``.

    Logic may go where rows and columns cross in which the placement has some: rows of memories and multipliers have
    none.  ValueError where a LUT and the flip-flop that takes its output inside the slice stand apart.
    """
    count = len(cells)
    ints = {name: np.full(count, NONE) for name in ("x", "y", "place", "site", "group", "control", "reset")}
    flags = {name: np.zeros(count, bool) for name in ("carry", "chooses", "beside")}
    kind, nets = np.zeros(count, int), {pin: np.full((count, 4), NONE) for pin in ("CE", "RST")}
    lanes, closed, marks = {}, set(), {}
    site_of = {bel(n): n for n in range(len(SITES))}
    for name, cell in cells.items():
        n, wired, parameters = number[name], cell["connections"], cell["parameters"]
        x, y, slice_, _, half = _BEL.match(cell["attributes"][BEL]).groups()
        ints["x"][n], ints["y"][n] = int(x), int(y)
        kind[n] = KINDS.get(cell["type"], 0)
        if kind[n] in (LUT, FLIP_FLOP):
            lanes[n] = (int(x), int(y), 2 * SLICES.index(slice_) + int(half))
        if cell["type"] == "TRELLIS_RAMW" or parameters.get("MODE") in MEMORY:
            closed.add((int(x), int(y)))
        if kind[n] == LUT:
            flags["carry"][n], flags["chooses"][n] = parameters.get("MODE") == "CCU2", bool(wired.get("M"))
        elif kind[n] == FLIP_FLOP:
            enable, reset = tuple(wired.get("CE") or ()), tuple(wired.get("LSR") or ())
            modes = tuple(parameters.get(mode) for mode in ("CEMUX", "LSRMUX", "CLKMUX", "GSR", "SRMODE"))
            ints["control"][n] = _mark(marks, ("control", enable, reset, modes))
            ints["reset"][n] = _mark(marks, ("reset", reset, modes[1], modes[4] == "ASYNC"))
        elif kind[n] == MULTIPLIER:
            ints["site"][n] = site_of[cell["attributes"][BEL]]
            for pin, table in nets.items():
                used = sorted({wired[f"{pin}{k}"][0] for k in range(4) if wired.get(f"{pin}{k}")}, key=str)
                table[n, : len(used)] = [_mark(marks, (pin, net)) for net in used]
    tiles = [(x, y) for x in sorted({x for x, *_ in lanes.values()}) for y in sorted({y for _, y, _ in lanes.values()})]
    tile_at = np.full((SIZE, SIZE), NONE)
    for tile, (x, y) in enumerate(tiles):
        tile_at[x, y] = tile
    at = {kind_: np.full(len(tiles) * LANES, NONE) for kind_ in (LUT, FLIP_FLOP)}
    for n, (x, y, lane) in lanes.items():
        ints["place"][n] = tile_at[x, y] * LANES + lane
        at[kind[n]][ints["place"][n]] = n
    for x, y in closed:
        tile_at[x, y] = NONE
    first, member, stride = _groups(cells, number, ints, flags, kind, at[LUT])
    multiplier_at = np.full(len(SITES), NONE)
    for n in np.flatnonzero(kind == MULTIPLIER):
        multiplier_at[ints["site"][n]] = n
    touched = defaultdict(list)
    for wire, ends in enumerate(zip(paths.source.tolist(), paths.sink.tolist(), strict=True)):
        for cell_number in set(ends):
            touched[cell_number].append(wire)
    columns, rows = np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij")
    site_x, site_y, _ = np.array(SITES).T
    tile_x, tile_y = np.array(tiles).T
    return Chip(
        kind=kind, x=ints["x"], y=ints["y"], place=ints["place"], site=ints["site"], group=ints["group"], **flags,
        control=ints["control"], reset=ints["reset"], enables=nets["CE"], resets=nets["RST"], lut_at=at[LUT],
        flip_flop_at=at[FLIP_FLOP], tile_x=tile_x, tile_y=tile_y, tile_at=tile_at, multiplier_at=multiplier_at,
        site_x=site_x, site_y=site_y, first=first, member=member, stride=stride,
        source=paths.source, sink=paths.sink, weight=PER_PS / np.sqrt(paths.readers),
        begin=np.cumsum([0] + [len(touched[n]) for n in range(count)]),
        wire=np.array([wire for n in range(count) for wire in touched[n]]), ps=picoseconds(columns, rows),
    )  # fmt: skip


def _groups(cells: dict, number: dict[str, int], ints: dict, flags: dict, kind: np.ndarray, lut_at: np.ndarray):
    """(first, member, stride) of `Chip`; sets ``group`` of the members, and ``beside``."""
    groups, place = Groups(len(cells)), ints["place"]
    driver = {}
    for name, cell in cells.items():
        for port, bits in cell["connections"].items():
            if bits and cell["port_directions"][port] == "output":
                driver[bits[0]] = number[name]
    for name, cell in cells.items():
        n, wired = number[name], cell["connections"]
        for port in TOGETHER:
            if wired.get(port):
                groups.join(n, driver[wired[port][0]])
        if kind[n] == FLIP_FLOP and wired.get("DI"):
            lut = driver[wired["DI"][0]]
            if place[lut] != place[n]:
                raise ValueError(f"{name} takes DI from a LUT that is not beside it")
            flags["beside"][[n, lut]] = True
        if flags["carry"][n] and lut_at[place[n] ^ 1] >= 0:
            groups.join(n, lut_at[place[n] ^ 1])
    members = defaultdict(list)
    for n in np.flatnonzero(kind == LUT):
        members[groups.leader(n)].append(n)
    shapes = [sorted(shape, key=lambda n: place[n]) for shape in members.values() if len(shape) > 1]
    strides = []
    for g, shape in enumerate(shapes):
        ints["group"][shape] = g
        one_tile = len(set(place[shape] // LANES)) == 1 and not flags["carry"][shape].any()
        strides.append(next(s for s in (2, 4, LANES) if len(shape) <= s) if one_tile else LANES)
    first = np.cumsum([0] + [len(shape) for shape in shapes])
    return first, np.array([n for shape in shapes for n in shape], int), np.array(strides, int)


def movable(chip: Chip, multipliers: bool) -> np.ndarray:
    """What `anneal` may choose: cells by number, groups as -1 - group."""
    open_ = np.zeros(len(chip.kind), bool)
    logic = chip.place >= 0
    tiles = chip.place[logic] // LANES
    open_[logic] = chip.tile_at[chip.tile_x[tiles], chip.tile_y[tiles]] >= 0
    alone = open_ & (((chip.kind == LUT) & (chip.group < 0)) | ((chip.kind == FLIP_FLOP) & ~chip.beside))
    groups = [g for g, cell in enumerate(chip.member[chip.first[:-1]]) if open_[cell]]
    if multipliers:
        alone |= chip.kind == MULTIPLIER
    return np.concatenate([np.flatnonzero(alone), -1 - np.array(groups, int)])


def save(chip: Chip, cells: dict, number: dict[str, int]) -> None:
    """Writes into ``cells`` where each stands now."""
    for name, cell in cells.items():
        n = number[name]
        if chip.kind[n] == MULTIPLIER:
            cell["attributes"][BEL] = bel(chip.site[n])
        elif chip.kind[n]:
            tile, lane = divmod(chip.place[n], LANES)
            part = _BEL.match(cell["attributes"][BEL]).group(4)
            cell["attributes"][BEL] = (
                f"X{chip.tile_x[tile]}/Y{chip.tile_y[tile]}/SLICE{SLICES[lane // 2]}.{part}{lane % 2}"
            )
