"""Makes a placement's slowest paths shorter: nextpnr's own refinement shortens wires, whatever path they are on.

After nextpnr has placed, cells move one at a time (see `anneal`) until the paths, reckoned with the delays of nextpnr's
SDF and a wire's by its length, are as even as they get.  The same placement and seed give the same result.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from scripts.files import write_text
from scripts.synth import sdf
from scripts.synth.anneal import MULTIPLIER, Chip, Wish, anneal
from scripts.synth.chip import load, movable, save
from scripts.synth.netlist import placed_module
from scripts.synth.paths import NEVER, Paths

ROUNDS, MOVES = 1000, 60_000  # paths are looked at again after so many moves
TAU, SOFTER = 200.0, 300.0  # ps: a path so much below the slowest counts a third of it; so much more at the start
BEYOND = 4.0  # tau by which paths may get slower than the slowest at the start
HOT, WIDE = 60.0, 60  # heat, and reach in tiles, at the start
GOAL = 6000.0  # ps: nothing is gained by a path shorter than this
# ps that a routed wire takes beyond its length: a net with many readers branches, many wires leave or enter a
# multiplier, and a step of a carry chain takes each bit at one pin where a LUT takes it at any of four
EACH_READER, MOST_READERS, FROM_MULTIPLIER, INTO_MULTIPLIER, INTO_CARRY = 18.0, 60, 300.0, 150.0, 250.0
CARRIES = 0.5  # of what the router takes carry chains for beyond what they take: it must get there as well
ALL_ALIKE = 0.6  # of the average chance to move: what a cell has that no slow path goes through


def refine(folder: Path, seed: int, multipliers: bool = False, rounds: int = ROUNDS, heat: float = HOT) -> float:
    """Moves the cells in ``folder``/placed.json, whose cells' delays stand in delays.sdf; returns the slowest path, ns.

    ``multipliers``: those move too.  nextpnr has chosen their clock enables' pins for the sites they had: such
    a placement tells where they should be, and cannot be routed.
    """
    design = json.loads((folder / "placed.json").read_text())
    cells = placed_module(design)["cells"]
    number = {name: n for n, name in enumerate(cells)}
    paths = Paths(cells, number, sdf.read_again(sdf.read(folder / "delays.sdf"), CARRIES))
    chip = load(cells, number, paths)
    best, kept = settle(chip, paths, movable(chip, multipliers), seed, rounds, heat)
    save(kept, cells, number)
    write_text(folder / "placed.json", json.dumps(design))
    return best / 1000


def beyond(chip: Chip, paths: Paths) -> np.ndarray:
    """What each wire takes beyond its length, ps."""
    more = EACH_READER * (np.minimum(paths.readers, MOST_READERS) - 1)
    more += FROM_MULTIPLIER * (chip.kind[paths.source] == MULTIPLIER)
    more += INTO_MULTIPLIER * (chip.kind[paths.sink] == MULTIPLIER)
    return more + INTO_CARRY * chip.carry[paths.sink]


def settle(chip: Chip, paths: Paths, units: np.ndarray, seed: int, rounds: int, heat: float) -> tuple[float, Chip]:
    """Anneals ``chip``; (the slowest path of the best placement seen, ps; that placement)."""
    best, kept, more = np.inf, chip, beyond(chip, paths)
    for n in range(rounds + 1):
        wire_ps = chip.ps[abs(chip.x[chip.source] - chip.x[chip.sink]), abs(chip.y[chip.source] - chip.y[chip.sink])]
        slowest, over = paths.slowest(wire_ps + more)
        if slowest <= best:  # the later has the shorter wires
            best, kept = slowest, chip._replace(place=chip.place.copy(), site=chip.site.copy())
        left = 1 - n / rounds
        if not left:
            break
        tau, goal = TAU + SOFTER * left, max(slowest, GOAL)
        urgent = np.exp((over - goal) / tau)
        rest = np.where(over > 0, over - wire_ps, NEVER)
        wish = Wish(rest, chip.weight + urgent, goal + BEYOND * tau * left, tau)
        reach = max(2, int(WIDE * left**1.5))
        anneal(chip, wish, units, _chances(chip, units, urgent), heat * left**2, reach, MOVES, seed * 100_000 + n)
    return best, kept


def _chances(chip: Chip, units: np.ndarray, urgent: np.ndarray) -> np.ndarray:
    """Running sum of how often each unit, cells before groups, is to be chosen: the more urgent its wires, the more."""
    of_cell = np.bincount(chip.source, urgent, len(chip.kind)) + np.bincount(chip.sink, urgent, len(chip.kind))
    of_group = np.add.reduceat(of_cell[chip.member], chip.first[:-1]) if len(chip.member) else np.zeros(0)
    chance = np.concatenate([of_cell[units[units >= 0]], of_group[-1 - units[units < 0]]])
    return np.cumsum(chance + ALL_ALIKE * chance.mean() + 1e-9)
