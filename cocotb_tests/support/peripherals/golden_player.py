# SPDX-License-Identifier: BSD-3-Clause
"""The golden model of a clocked block over arrays, row by row; compiled, so that millions of clocks take seconds."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache

import numba
import numpy as np

from golden_model.block import Block
from golden_model.registry import BLOCKS

PIECE = 1 << 18  # clocks at a time, for the memory


@cache
def _loop(name: str):
    """loop(state, rows, seen, config values): the block's step with the columns of a row as its arguments."""
    block = BLOCKS[name]
    columns = [f"row[{k}]" for k in range(len(block.inputs + block.registers))]
    arguments = ", ".join(columns)
    if block.takes:
        rest = iter(columns)
        records = [", ".join(next(rest) for _ in record._fields) for record in block.takes]
        arguments = ", ".join(f"takes_{k}({values})" for k, values in enumerate(records))
    generics = ", ".join(f"config[{k}]" for k in range(len(block.configs[0])))
    shown = "\n        ".join(f"seen[k, {j}] = out[{j}]" for j in range(len(block.outputs)))
    text = f"""
def loop(state, rows, seen, config):
    for k in range(len(rows)):
        row = rows[k]
        state, out = step(state, {arguments}{", " + generics if generics else ""})
        {shown}
    return state
"""
    space = {"step": block.step} | {f"takes_{k}": record for k, record in enumerate(block.takes)}
    exec(text, space)
    return numba.njit(space["loop"])


class GoldenPlayer:
    """A clocked block that keeps its state from one ``play`` to the next; outputs are those after each clock."""

    def __init__(self, block: Block, config: Mapping[str, int], registers: Mapping[str, int]):
        self.block, self.config, self.registers = block, dict(config), dict(registers)
        self.state = block.state

    def play(self, values: Mapping[str, np.ndarray], keep: Collection[str] | None = None) -> dict[str, np.ndarray]:
        """One clock for each row of {input: integers}; inputs that are not given are 0.

        Returns {output: int64}, of all outputs or of those in ``keep``.  ValueError for a name the block does not have.
        """
        length = len(next(iter(values.values())))
        names = [p.name for p in self.block.inputs + self.block.registers]
        shown = [(j, p.name) for j, p in enumerate(self.block.outputs) if keep is None or p.name in keep]
        unknown = (set(values) | set(self.registers)) - set(names)
        unknown |= set(keep or ()) - {name for _, name in shown}
        if unknown:
            raise ValueError(f"{self.block.name} has no port {sorted(unknown)}")
        out = {name: np.empty(length, np.int64) for _, name in shown}
        config = np.array(list(self.config.values()) or [0], np.int64)
        for at in range(0, length, PIECE):
            part = slice(at, min(at + PIECE, length))
            rows = np.zeros((part.stop - at, len(names)), np.int64)
            for j, name in enumerate(names):
                rows[:, j] = values[name][part] if name in values else self.registers.get(name, 0)
            seen = np.empty((len(rows), len(self.block.outputs)), np.int64)
            self.state = _loop(self.block.name)(self.state, rows, seen, config)
            for j, name in shown:
                out[name][part] = seen[:, j]
        return out
