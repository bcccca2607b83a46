"""Chooses the site of each multiplier from where a placement put what it is wired to.

nextpnr places a multiplier as one cell among thousands: the rows of multipliers are far apart, and a block of four
takes no more than four clock enables in all, so that it ends wherever one is free, tens of tiles from its logic.  With
a placement known the choice is a small problem of its own, and the next placement gathers the logic around the
multipliers, which stay.

The cost of a site is the sum over the multiplier's nets of the delay of the longest path over it to the power of POWER:
the net as nextpnr estimates it between two places, the rest by `Delays`.  The power makes one long path dearer than
several that are not, and what is beside the net tells apart those that may be long: a multiplier without its operands'
registers leaves little to the net in front of it.  Multipliers change
sites one or two at a time, to worse ones too at first, and the best that was seen counts (simulated annealing); the
same placement gives the same sites.
"""

from __future__ import annotations

import math
import random
import re

import numpy as np

from scripts.synth.delays import MULTIPLIER, NET, Delays
from scripts.synth.netlist import Nets, placed_module

KIND = "MULT18X18D"
# LFE5U-85F: where a block begins, and which places from there on have a multiplier
ROWS, BLOCKS, PLACES = (10, 34, 58), (4, 13, 22, 31, 40, 49, 58, 69, 78, 87, 96, 105, 114), (0, 1, 4, 5)
SITES = [(x + z, y, z) for y in ROWS for x in BLOCKS for z in PLACES]
SHARED, MOST = ("CLK", "CE", "RST"), 4  # a block takes no more than MOST nets of each
POWER, STEPS = 8, 400_000
_DATA = re.compile(r"[ABP]\d+")


def bel(site: int) -> str:
    """nextpnr's name of a site."""
    x, y, z = SITES[site]
    return f"X{x}/Y{y}/MULT18_{z}"


def at(cell: dict) -> tuple[int, int]:
    """Column and row of a placed cell."""
    x, y, _ = cell["attributes"]["NEXTPNR_BEL"].split("/")
    return int(x[1:]), int(y[1:])


def net(dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
    """ns that nextpnr's placer expects of a net over so many tiles, speed grade 6."""
    near, far = (sum(f(d) for d in (dx, dy)) for f in (lambda d: np.minimum(d, 5), lambda d: np.maximum(d - 5, 0)))
    return 0.076 * (6 + 2 * near + far)


def beside(module: dict) -> dict[str, dict[str, float]]:
    """{multiplier: {data pin: ns of the longest path over the pin, but for the net at it}} of a mapped module."""
    cells, nets = module["cells"], Nets(module)
    delays = Delays(cells, nets)
    found = {}
    for name in (name for name, cell in cells.items() if cell["type"] == KIND):
        wired, parameters = cells[name]["connections"], cells[name]["parameters"]
        pins = {pin: bits[0] for pin, bits in wired.items() if _DATA.fullmatch(pin) and not isinstance(bits[0], str)}
        behind = {pin: delays.rest(bit) for pin, bit in pins.items() if pin[0] == "P"}
        through = 0.0
        if "REG_INPUTA_CLK" not in parameters:
            through = MULTIPLIER
            if "REG_OUTPUT_CLK" not in parameters:
                through += max(behind.values(), default=0.0)
        found[name] = {
            pin: delays.arrival(bit) + (behind[pin] - NET if pin in behind else through) for pin, bit in pins.items()
        }
    return found


def costs(placed: dict, others: dict[str, dict[str, float]]) -> dict[str, np.ndarray]:
    """{multiplier: cost of each of SITES} of a module as nextpnr wrote it after a placement; ``others`` = `beside`."""
    cells, nets = placed["cells"], Nets(placed)
    # A constant is made wherever it is needed.
    where = {name: at(cell) for name, cell in cells.items() if not name.startswith("$PACKER")}
    columns, rows, _ = np.array(SITES).T
    found = {}
    for name in (name for name, cell in cells.items() if cell["type"] == KIND):
        cost = found[name] = np.zeros(len(SITES))
        for pin, other in others[name].items():
            for bit in cells[name]["connections"][pin]:
                ends = {reader for reader, _ in nets.readers.get(bit, [])} if pin[0] == "P" else {nets.driver.get(bit)}
                for x, y in (where[end] for end in sorted(ends & where.keys())):
                    cost += (other + net(abs(columns - x), abs(rows - y))) ** POWER
    return found


def shared(cell: dict) -> list[set]:
    """The nets that the multipliers of a block share: clocks, enables, resets."""
    wired = cell["connections"].items()
    return [{bit for pin, (bit,) in wired if pin.startswith(kind) and pin[len(kind) :].isdigit()} for kind in SHARED]


class Plan:
    """Multipliers on sites, so that each block is legal."""

    def __init__(self, cells: dict, start: dict[str, int]):
        self.site, self.holder = dict(start), {site: name for name, site in start.items()}
        self._shared = {name: shared(cells[name]) for name in start}

    def legal(self, site: int) -> bool:
        """Whether the block of ``site`` has not too many nets of one kind."""
        first = site - site % len(PLACES)
        members = (self.holder.get(first + n) for n in range(len(PLACES)))
        kinds = zip(*(self._shared[name] for name in members if name), strict=True)
        return all(len(set().union(*nets)) <= MOST for nets in kinds)

    def swap(self, name: str, site: int) -> None:
        """Puts ``name`` on ``site``, and who was there on the site of ``name``."""
        old, other = self.site[name], self.holder.get(site)
        self.site[name], self.holder[site] = site, name
        if other is None:
            del self.holder[old]
        else:
            self.site[other], self.holder[old] = old, other


def assign(cells: dict, cost: dict[str, np.ndarray], start: dict[str, int], steps: int = STEPS) -> dict[str, int]:
    """{multiplier: index of its site}, legal and at most as dear as ``start``, which must be legal."""
    if not start:
        return {}
    plan, generator = Plan(cells, start), random.Random(1)
    names = sorted(start)
    now = least = 0.0
    best = dict(start)
    hot = float(np.mean([np.std(cost[name]) for name in names])) / 20
    for step in range(steps):
        name, site = generator.choice(names), generator.randrange(len(SITES))
        old = plan.site[name]
        other = plan.holder.get(site)
        if site == old:
            continue
        more = cost[name][site] - cost[name][old]
        if other is not None:
            more += cost[other][old] - cost[other][site]
        heat = hot * (1 - step / steps) ** 2
        if more > 0 and generator.random() >= math.exp(-more / heat):
            continue
        plan.swap(name, site)
        if not (plan.legal(site) and plan.legal(old)):
            plan.swap(name, old)
            continue
        now += more
        if now < least:
            least, best = now, dict(plan.site)
    return best


def fix(netlist: dict, top: str, placed: dict) -> None:
    """Gives each multiplier of ``netlist`` its site, as an attribute that nextpnr obeys.

    ``placed`` is what nextpnr wrote of the same netlist after a placement.
    """
    cells = netlist["modules"][top]["cells"]
    there = placed_module(placed)
    index = {bel(n): n for n in range(len(SITES))}
    cost = costs(there, beside(netlist["modules"][top]))
    start = {name: index[there["cells"][name]["attributes"]["NEXTPNR_BEL"]] for name in cost}
    for name, site in assign(cells, cost, start).items():
        cells[name]["attributes"] = {**cells[name].get("attributes", {}), "BEL": bel(site)}
