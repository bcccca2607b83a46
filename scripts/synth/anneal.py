"""Moves cells of a placed ECP5 design where its paths get shorter: simulated annealing, compiled.

The cost of a wire is what it takes, little, and the excess of the slowest path over it, e times more every ``tau`` ps:
    cost = weight*ps + tau*exp((rest + ps - goal)/tau)
``rest`` is that path without the wire when `paths` last looked.  What is far below the goal costs nothing, so there is
no weight to be found for it, and no wire can get longer than its path allows without the cost noticing at once.

A move exchanges what stands in two places, or in two rows of places of one shape: a flip-flop alone, a LUT alone, both
together, a group that must stay together (a carry chain, a wide multiplexer), or two multipliers on their sites.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from scripts.synth.floorplan import MOST, PLACES

SEATS = len(PLACES)  # multipliers of a block
LANES = 8  # places for a LUT and a flip-flop in a tile
BOTH, LUT_ALONE, FLIP_FLOP_ALONE = 0, 1, 2  # what a move exchanges
LUT, FLIP_FLOP, MULTIPLIER = 1, 2, 3  # kinds of cells; 0 never moves
NONE = -1
AS_MANY = 20.0  # a multiplier has so many wires for each of another cell, and is to be as hot


class Chip(NamedTuple):
    """Cells and places, int arrays unless said; cell, place, tile and wire are numbers, NONE where there is none."""

    # of each cell
    kind: np.ndarray
    x: np.ndarray
    y: np.ndarray
    place: np.ndarray
    site: np.ndarray  # of a multiplier
    group: np.ndarray
    carry: np.ndarray  # bool: a step of a carry chain
    chooses: np.ndarray  # bool: a multiplexer that needs the slice's M
    beside: np.ndarray  # bool: a LUT and the flip-flop that takes its output inside the slice
    control: np.ndarray  # clock enable and reset of a flip-flop: one of each in a slice
    reset: np.ndarray  # of a flip-flop: one in a tile, none being one too
    enables: np.ndarray  # of a multiplier, 4 columns: four in a block
    resets: np.ndarray
    # of each place, tile, site
    lut_at: np.ndarray
    flip_flop_at: np.ndarray
    tile_x: np.ndarray
    tile_y: np.ndarray
    tile_at: np.ndarray  # by column and row
    multiplier_at: np.ndarray
    site_x: np.ndarray
    site_y: np.ndarray
    # of each group: members from first[g] to first[g + 1], and by how many lanes it may move inside its tile
    first: np.ndarray
    member: np.ndarray
    stride: np.ndarray
    # of each wire, and the wires of each cell, from begin[c] to begin[c + 1]
    source: np.ndarray
    sink: np.ndarray
    weight: np.ndarray  # float
    begin: np.ndarray
    wire: np.ndarray
    ps: np.ndarray  # float, by columns and rows apart


class Wish(NamedTuple):
    """What the moves are for: see the module."""

    rest: np.ndarray
    pull: np.ndarray  # of each wire: how much it attracts, for choosing where to
    goal: float
    tau: float


# Arrays are handed over one by one: numba counts the references of all arrays of a Chip at each call, and that takes
# longer than the move.
_part = njit(cache=True, nogil=True)


@_part
def _slice_fits(place, lut_at, flip_flop_at, carry, control, chooses, beside):
    low = place & ~1
    one, other, this, that = lut_at[low], lut_at[low + 1], flip_flop_at[low], flip_flop_at[low + 1]
    if one >= 0 and other >= 0 and carry[one] != carry[other]:
        return False
    if this >= 0 and that >= 0 and control[this] != control[that]:
        return False
    # A flip-flop without a LUT beside it takes M too.
    if one >= 0 and this >= 0 and chooses[one] and not beside[this]:
        return False
    return not (other >= 0 and that >= 0 and chooses[other] and not beside[that])


@_part
def _tile_fits(tile, flip_flop_at, resets):
    one = NONE
    for place in range(tile * LANES, (tile + 1) * LANES):
        flip_flop = flip_flop_at[place]
        if flip_flop < 0:
            continue
        if one >= 0 and resets[flip_flop] != one:
            return False
        one = resets[flip_flop]
    return True


@_part
def _block_fits(block, multiplier_at, nets):
    seen, count = np.empty(4 * SEATS, np.int64), 0
    for site in range(SEATS * block, SEATS * (block + 1)):
        cell = multiplier_at[site]
        if cell < 0:
            continue
        for pin in range(4):
            net = nets[cell, pin]
            if net >= 0 and not (seen[:count] == net).any():
                seen[count] = net
                count += 1
    return count <= MOST


@_part
def _cost(moved, count, stamp, turn, x, y, source, sink, weight, begin, wire, ps, rest, goal, tau):
    """Of all wires of the moved cells, each once; cells of this turn are stamped."""
    total, low = 0.0, goal - 8 * tau
    for n in range(count):
        cell = moved[n]
        for w in range(begin[cell], begin[cell + 1]):
            k = wire[w]
            one, other = source[k], sink[k]
            if one != cell and stamp[one] == turn:
                continue
            takes = ps[abs(x[one] - x[other]), abs(y[one] - y[other])]
            total += weight[k] * takes
            path = rest[k] + takes
            if path > low:
                total += tau * np.exp((path - goal) / tau)
    return total


@_part
def _put(cell, position, place, x, y, tile_x, tile_y):
    if cell >= 0:
        tile = position // LANES
        place[cell], x[cell], y[cell] = position, tile_x[tile], tile_y[tile]


@_part
def _exchange(here, there, what, lut_at, flip_flop_at, place, x, y, tile_x, tile_y):
    if what != FLIP_FLOP_ALONE:
        one, other = lut_at[here], lut_at[there]
        lut_at[here], lut_at[there] = other, one
        _put(one, there, place, x, y, tile_x, tile_y)
        _put(other, here, place, x, y, tile_x, tile_y)
    if what != LUT_ALONE:
        one, other = flip_flop_at[here], flip_flop_at[there]
        flip_flop_at[here], flip_flop_at[there] = other, one
        _put(one, there, place, x, y, tile_x, tile_y)
        _put(other, here, place, x, y, tile_x, tile_y)


@_part
def _seat(cell, position, site, multiplier_at, x, y, site_x, site_y):
    multiplier_at[position] = cell
    if cell >= 0:
        site[cell], x[cell], y[cell] = position, site_x[position], site_y[position]


@_part
def _middle(cell, at_x, at_y, source, sink, begin, wire, pull):
    """(column, row) of what a cell is wired to, weighted by what it attracts; (NONE, NONE) where nothing does."""
    x = y = total = 0.0
    for w in range(begin[cell], begin[cell + 1]):
        k = wire[w]
        end = sink[k] if source[k] == cell else source[k]
        x += pull[k] * at_x[end]
        y += pull[k] * at_y[end]
        total += pull[k]
    if total <= 0:
        return NONE, NONE
    return int(round(x / total)), int(round(y / total))


@_part
def _shape(group, tile, here, there, first, member, stride, place, x, y, tile_x, tile_y, tile_at, lut_at, groups):
    """Fills ``here``, ``there`` with a group's places now and moved to ``tile``; their number, 0 where not free."""
    anchor, shift, count = place[member[first[group]]], 0, 0
    if stride[group] < LANES:
        step = stride[group]
        shift = np.random.randint(LANES // step) * step - (anchor % LANES) // step * step
    columns, rows = tile_x[tile] - tile_x[anchor // LANES], tile_y[tile] - tile_y[anchor // LANES]
    if columns == 0 and rows == 0 and shift == 0:
        return 0
    for m in range(first[group], first[group + 1]):
        cell = member[m]
        to_x, to_y = x[cell] + columns, y[cell] + rows
        if to_x < 0 or to_y < 0 or to_x >= tile_at.shape[0] or to_y >= tile_at.shape[1] or tile_at[to_x, to_y] < 0:
            return 0
        goal = tile_at[to_x, to_y] * LANES + place[cell] % LANES + shift
        if lut_at[goal] >= 0 and groups[lut_at[goal]] >= 0:
            return 0
        here[count], there[count] = place[cell], goal
        count += 1
    return count


@_part
def _granted(more, heat):
    return more <= 0 or (heat > 0 and np.random.random() < np.exp(-more / heat))


@_part
def anneal(chip, wish, units, chances, heat, reach, moves, seed):
    """Tries ``moves`` moves, and returns how many were made.

    ``units``: cells, and groups as -1 - group; ``chances``: running sum of how often each is to be chosen.
    """
    np.random.seed(seed)
    (
        kind, x, y, place, site, groups, carry, chooses, beside, control, reset, enables, resets, lut_at, flip_flop_at,
        tile_x, tile_y, tile_at, multiplier_at, site_x, site_y, first, member, stride, source, sink, weight, begin,
        wire, ps,
    ) = chip  # fmt: skip
    rest, pull, goal, tau = wish
    size = max(2, (first[1:] - first[:-1]).max() if len(member) else 0)
    here, there, moved = np.empty(size, np.int64), np.empty(size, np.int64), np.empty(4 * size, np.int64)
    stamp, made = np.zeros(len(kind), np.int64), 0
    for turn in range(1, moves + 1):
        unit = units[np.searchsorted(chances, np.random.random() * chances[-1])]
        group, cell = NONE, unit
        if unit < 0:
            group = -1 - unit
            cell = member[np.random.randint(first[group], first[group + 1])]
        multiplier = kind[cell] == MULTIPLIER
        anchor = member[first[group]] if group >= 0 else cell

        # Where to: near what the cell is wired to, or near where it is
        to_x, to_y, near = x[anchor], y[anchor], reach
        if np.random.random() < 0.5:
            to_x, to_y = _middle(cell, x, y, source, sink, begin, wire, pull)
            if to_x < 0:
                continue
            to_x, to_y, near = to_x + x[anchor] - x[cell], to_y + y[anchor] - y[cell], min(reach, 3)
        if multiplier:
            there[0] = np.random.randint(len(multiplier_at))
            for _ in range(12 if near < reach else 0):
                other = np.random.randint(len(multiplier_at))
                far = abs(site_x[other] - to_x) + abs(site_y[other] - to_y)
                if far < abs(site_x[there[0]] - to_x) + abs(site_y[there[0]] - to_y):
                    there[0] = other
            here[0] = site[cell]
            if there[0] == here[0]:
                continue
        else:
            to_x += np.random.randint(-near, near + 1)
            to_y += np.random.randint(-near, near + 1)
            if to_x < 0 or to_y < 0 or to_x >= tile_at.shape[0] or to_y >= tile_at.shape[1]:
                continue
            tile = tile_at[to_x, to_y]
            if tile < 0:
                continue

        # What is exchanged
        what, steps, count = BOTH, 1, 0
        if group >= 0:
            steps = _shape(
                group, tile, here, there, first, member, stride, place, x, y, tile_x, tile_y, tile_at, lut_at, groups
            )
        elif not multiplier:
            here[0], there[0] = place[cell], tile * LANES + np.random.randint(LANES)
            lut, flip_flop = lut_at[there[0]], flip_flop_at[there[0]]
            if here[0] == there[0]:
                continue
            if kind[cell] == FLIP_FLOP:
                what = FLIP_FLOP_ALONE
                if flip_flop >= 0 and beside[flip_flop]:
                    continue
            elif lut >= 0 and groups[lut] >= 0:
                continue
            elif not beside[cell] and (lut < 0 or not beside[lut]):
                what = LUT_ALONE
        if steps == 0:
            continue
        for n in range(2 * steps):
            at = here[n // 2] if n % 2 == 0 else there[n // 2]
            if multiplier:
                if multiplier_at[at] >= 0:
                    moved[count] = multiplier_at[at]
                    count += 1
                continue
            if what != FLIP_FLOP_ALONE and lut_at[at] >= 0:
                moved[count] = lut_at[at]
                count += 1
            if what != LUT_ALONE and flip_flop_at[at] >= 0:
                moved[count] = flip_flop_at[at]
                count += 1
        for n in range(count):
            stamp[moved[n]] = turn

        # Made, looked at, and taken back where it does not fit or costs too much
        before = _cost(moved, count, stamp, turn, x, y, source, sink, weight, begin, wire, ps, rest, goal, tau)
        fits = True
        if multiplier:
            other = multiplier_at[there[0]]
            _seat(cell, there[0], site, multiplier_at, x, y, site_x, site_y)
            _seat(other, here[0], site, multiplier_at, x, y, site_x, site_y)
            for at in (here[0] // SEATS, there[0] // SEATS):
                fits = fits and _block_fits(at, multiplier_at, enables) and _block_fits(at, multiplier_at, resets)
        else:
            for n in range(steps):
                _exchange(here[n], there[n], what, lut_at, flip_flop_at, place, x, y, tile_x, tile_y)
            for n in range(2 * steps):
                at = here[n // 2] if n % 2 == 0 else there[n // 2]
                fits = fits and _slice_fits(at, lut_at, flip_flop_at, carry, control, chooses, beside)
                fits = fits and (what == LUT_ALONE or _tile_fits(at // LANES, flip_flop_at, reset))
        if fits:
            after = _cost(moved, count, stamp, turn, x, y, source, sink, weight, begin, wire, ps, rest, goal, tau)
            if _granted(after - before, heat * AS_MANY if multiplier else heat):
                made += 1
                continue
        if multiplier:
            _seat(cell, here[0], site, multiplier_at, x, y, site_x, site_y)
            _seat(other, there[0], site, multiplier_at, x, y, site_x, site_y)
        else:
            for n in range(steps - 1, -1, -1):
                _exchange(here[n], there[n], what, lut_at, flip_flop_at, place, x, y, tile_x, tile_y)
    return made
