"""Sites of multipliers: every block legal, multipliers beside what they serve."""

from __future__ import annotations

import pytest

from scripts.synth import floorplan
from scripts.synth.delays import MULTIPLIER, NET, TO_Q
from scripts.synth.floorplan import BLOCKS, KIND, MOST, ROWS, SITES, Plan, assign, bel, beside, costs, fix, shared

CLOCK, HERD = 2, 30
FAR = [n for n, (x, *_) in enumerate(SITES) if x >= 96]


def flip_flop(given: int | str, made: int) -> dict:
    return {
        "type": "TRELLIS_FF", "parameters": {}, "attributes": {},
        "connections": {"DI": [given], "Q": [made]}, "port_directions": {"DI": "input", "Q": "output"},
    }  # fmt: skip


def multiplier(operands: list[int], products: list[int], enable: int) -> dict:
    pins = {f"A{n}": bit for n, bit in enumerate(operands)} | {f"P{n}": bit for n, bit in enumerate(products)}
    pins |= {"CLK0": CLOCK, "CE0": enable}
    return {
        "type": KIND, "parameters": {}, "attributes": {}, "connections": {pin: [bit] for pin, bit in pins.items()},
        "port_directions": {pin: "output" if pin[0] == "P" else "input" for pin in pins},
    }  # fmt: skip


def module(count: int = HERD) -> dict:
    """``count`` multipliers between a flip-flop in front and one behind, each with an enable of its own."""
    cells = {}
    for n in range(count):
        cells[f"in{n}"] = flip_flop("0", 1000 + n)
        cells[f"m{n}"] = multiplier([1000 + n], [2000 + n], 100 + n)
        cells[f"out{n}"] = flip_flop(2000 + n, 3000 + n)
    return {"cells": cells, "ports": {}}


def placed(start: list[int], tiles: list[tuple[int, int]]) -> dict:
    """The module after a placement: multiplier n on site start[n], its flip-flops in tiles[n]."""
    there = module(len(start))
    for n, (site, (x, y)) in enumerate(zip(start, tiles, strict=True)):
        there["cells"][f"m{n}"]["attributes"]["NEXTPNR_BEL"] = bel(site)
        for name in (f"in{n}", f"out{n}"):
            there["cells"][name]["attributes"]["NEXTPNR_BEL"] = f"X{x}/Y{y}/A.FF0"
    return there


def test_a_multiplier_goes_to_what_it_serves():
    tiles = [(BLOCKS[n // 3] + 2, ROWS[n % 3] + 1) for n in range(HERD)]
    start = dict(zip((f"m{n}" for n in range(HERD)), FAR[:HERD], strict=True))
    cost = costs(placed(list(start.values()), tiles), beside(module()))
    found = assign(module()["cells"], cost, start, 60_000)
    assert len(set(found.values())) == HERD
    for n, (x, y) in enumerate(tiles):
        column, row, _ = SITES[found[f"m{n}"]]
        assert row == y - 1 and abs(column - x) < 6


def test_blocks_stay_legal_where_all_want_the_same():
    """Each with three enables: two in a block would be six."""
    cells = module(13)["cells"]
    for n in range(13):
        cells[f"m{n}"]["connections"] |= {"CE1": [200 + n], "CE2": [300 + n]}
        cells[f"m{n}"]["port_directions"] |= {"CE1": "input", "CE2": "input"}
    start = {f"m{n}": 4 * n for n in range(13)}
    cost = costs(placed(list(start.values()), [(60, 35)] * 13), beside(module(13)))
    found = assign(cells, cost, start, 60_000)
    assert sum(cost[name][site] for name, site in found.items()) < sum(cost[name][site] for name, site in start.items())
    assert len({site // 4 for site in found.values()}) == 13


def test_what_a_block_takes():
    cells = module(4)["cells"]
    plan = Plan(cells, {f"m{n}": n for n in range(4)})
    assert plan.legal(0) and [len(nets) for nets in shared(cells["m0"])] == [1, 1, 0]
    cells["m3"]["connections"]["CE3"] = ["1"]  # a constant is a net too
    assert sum(len(shared(cell)[1]) for cell in cells.values() if cell["type"] == KIND) == MOST + 1
    plan = Plan(cells, {f"m{n}": n for n in range(4)})
    assert not plan.legal(0)
    plan.swap("m3", 4)
    assert plan.legal(0) and plan.legal(4)
    plan.swap("m3", 0)
    assert plan.site == {"m0": 4, "m1": 1, "m2": 2, "m3": 0} and plan.legal(0)


def test_one_long_net_is_dearer_than_two_of_half_its_length():
    there = placed([0], [(10, 34)])
    there["cells"]["out0"]["attributes"]["NEXTPNR_BEL"] = "X110/Y34/A.FF0"
    (cost,) = costs(there, {"m0": {"A0": 4.0, "P0": 4.0}}).values()
    column, row, _ = SITES[int(cost.argmin())]
    assert row == 34 and abs(column - 60) < 6


def test_the_net_with_less_time_is_the_shorter():
    """Without the net it takes 3 ns longer in front of the multiplier than behind: it stands nearer to its source."""
    there = placed([0], [(10, 34)])
    there["cells"]["out0"]["attributes"]["NEXTPNR_BEL"] = "X110/Y34/A.FF0"
    (cost,) = costs(there, {"m0": {"A0": 6.0, "P0": 3.0}}).values()
    column, row, _ = SITES[int(cost.argmin())]
    assert row == 34 and column < 45


@pytest.mark.parametrize(
    ("registers", "before", "behind"),
    [("", TO_Q + MULTIPLIER + NET, TO_Q + NET + MULTIPLIER), ("A", TO_Q, MULTIPLIER)],
)
def test_what_is_beside_a_net(registers, before, behind):
    """Without a register the path goes on through the multiplier; with one it ends there and another begins."""
    there = module(1)
    there["cells"]["m0"]["parameters"] = {f"REG_INPUT{side}_CLK": "CLK0" for side in registers}
    assert beside(there)["m0"] == pytest.approx({"A0": before, "P0": behind})


@pytest.mark.parametrize("seed", [1, 2])
def test_the_netlist_says_where(seed):
    netlist = {"modules": {"t": module()}}
    there = placed(FAR[:HERD], [(BLOCKS[n % 6], ROWS[n % 3]) for n in range(HERD)])
    floorplan.random.seed(seed)  # no other generator decides
    fix(netlist, "t", {"modules": {"top": there, "CCU2C": module(0)}})
    sites = [netlist["modules"]["t"]["cells"][f"m{n}"]["attributes"]["BEL"] for n in range(HERD)]
    again = {"modules": {"t": module()}}
    fix(again, "t", {"modules": {"top": there}})
    assert len(set(sites)) == HERD and set(sites) <= {bel(n) for n in range(len(SITES))}
    assert sites == [again["modules"]["t"]["cells"][f"m{n}"]["attributes"]["BEL"] for n in range(HERD)]
    others = [cell for cell in netlist["modules"]["t"]["cells"].values() if cell["type"] != KIND]
    assert all("BEL" not in cell["attributes"] for cell in others)


def test_without_multipliers_nothing_is_chosen():
    netlist = {"modules": {"t": module(0)}}
    fix(netlist, "t", {"modules": {"top": placed([], [])}})
    assert netlist == {"modules": {"t": module(0)}}
