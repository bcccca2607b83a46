"""The golden model of a clocked block over arrays, row by row; compiled, so that millions of clocks take seconds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numba
import numpy as np

from fluxproof.golden_model.block import Block
from fluxproof.golden_model.registry import BLOCKS


@lru_cache(maxsize=None)
def _loop(name: str):
    """loop(state, rows, seen, config values): the block's step with the columns of a row as its arguments."""
    block = BLOCKS[name]
    count = len(block.inputs + block.registers)
    arguments = ", ".join(f"row[{k}]" for k in range(count))
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
    space = {"step": block.step}
    exec(text, space)
    return numba.njit(space["loop"])


class GoldenPlayer:
    """A clocked block that keeps its state from one ``play`` to the next; outputs are those after each clock."""

    def __init__(self, block: Block, config: Mapping[str, int], registers: Mapping[str, int]):
        self.block, self.config, self.registers = block, dict(config), dict(registers)
        self.state = block.state

    def play(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """One clock for each row of {input: integers}; inputs that are not given are 0."""
        length = len(next(iter(values.values())))
        names = [p.name for p in self.block.inputs + self.block.registers]
        unknown = (set(values) | set(self.registers)) - set(names)
        if unknown:
            raise ValueError(f"{self.block.name} has no input {sorted(unknown)}")
        rows = np.zeros((length, len(names)), np.int64)
        for j, name in enumerate(names):
            rows[:, j] = values.get(name, self.registers.get(name, 0))
        seen = np.empty((length, len(self.block.outputs)), np.int64)
        config = np.array(list(self.config.values()) or [0], np.int64)
        self.state = _loop(self.block.name)(self.state, rows, seen, config)
        return {p.name: seen[:, j] for j, p in enumerate(self.block.outputs)}
