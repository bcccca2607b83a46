# SPDX-License-Identifier: BSD-3-Clause
"""What is mutated: each block of the registry with each of its configurations, the wiring of the core and both tops."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim.flat import FLAT, flat_top
from fluxproof.cosim.sources import rtl_sources
from fluxproof.cosim.verilog import TOP, sources_of, synthesize, top_ports
from golden_model.block import Block
from golden_model.registry import BLOCKS
from scripts.mutate import axi, board, core
from scripts.mutate.harness import BENCH_SEED, Trial, block_trial

FOLDER = BUILD / "mutate"
LEAST, MOST = 24, 40  # mutants of a block
LEAST_OF_CONFIG = 8


@dataclass(frozen=True)
class Subject:
    """A block with one of its configurations; names alone, for another process."""

    of: str
    index: int
    no_change = None  # mutations that are known to change nothing

    @property
    def block(self) -> Block:
        return BLOCKS[self.of]

    @property
    def config(self) -> Mapping[str, int]:
        return self.block.configs[self.index]

    @property
    def name(self) -> str:
        return f"{self.of}-{self.index}"

    @property
    def folder(self) -> Path:
        return FOLDER / self.name

    @property
    def top(self) -> str:
        """The entity that is converted; the ports of a cell get their widths from a top in tb/."""
        return flat_top(self.block.name)[0] if self.block.strobes else f"{self.block.name}_tb"

    @property
    def flat(self) -> bool:
        """Whether instances are mutated inside too: those of a block are blocks with a bench of their own."""
        return not self.block.strobes

    def verilog(self) -> str:
        """The converted VHDL."""
        if self.block.strobes:
            sources = sources_of(self.top)
        else:
            sources = [*rtl_sources(), ROOT / "tb" / f"{self.top}.vhd"]
        return synthesize(sources, self.top, self.config)

    def trials(self) -> list[Trial]:
        """The schedule of the block's bench."""
        return [block_trial(self.block, self.config, BENCH_SEED)]

    def count(self, cells: int) -> int:
        """Mutants to draw: as many as the block has cells, within limits, shared by its configurations."""
        configs = len(self.block.configs) - len(self.block.too_wide)
        return max(LEAST_OF_CONFIG, min(max(cells, LEAST), MOST) // configs)


@dataclass(frozen=True)
class Core:
    """The core's own cells and connections."""

    of: str = TOP.removesuffix(FLAT)
    flat: bool = False

    @property
    def name(self) -> str:
        return f"{self.of}-0"

    @property
    def top(self) -> str:
        return TOP

    @property
    def folder(self) -> Path:
        return FOLDER / self.name

    def verilog(self) -> str:
        """The converted VHDL."""
        return synthesize(sources_of(self.top), self.top, core.config())

    def count(self, cells: int) -> int:
        return core.MUTANTS

    @property
    def no_change(self) -> re.Pattern[str]:
        """Mutations that change nothing with this configuration."""
        return core.NO_CHANGE

    def trials(self) -> list[Trial]:
        """Its closed loops."""
        ports = top_ports(self.folder / "design.v")
        recorders = [core.every_event(), core.any_settings()]
        for k, changed in enumerate((core.FAST, core.ADRIFT)):
            recorders.append(core.every_event(core.INVERTED, changed, core.SEED + k))
        return [recorder.trial(ports) for recorder in recorders]


@dataclass(frozen=True)
class Board:
    """The own cells and connections of fluxproof_board, with the front ends of one run."""

    index: int
    of: str = board.TOP
    flat: bool = False

    @property
    def no_change(self) -> re.Pattern[str]:
        """What is not drawn."""
        return board.no_change(self.index)

    @property
    def name(self) -> str:
        return f"{self.of}-{self.index}"

    @property
    def top(self) -> str:
        return board.TOP

    @property
    def folder(self) -> Path:
        return FOLDER / self.name

    def verilog(self) -> str:
        """The converted VHDL."""
        return synthesize(sources_of(self.top), self.top, board.RUNS[self.index]().generics())

    def count(self, cells: int) -> int:
        return board.DRAWN

    def trials(self) -> list[Trial]:
        """Its run through the pins."""
        ports = top_ports(self.folder / "design.v", top=self.top)
        return [board.trial(board.RUNS[self.index](), ports)]


@dataclass(frozen=True)
class Axi(Board):
    """The own cells and connections of fluxproof_axi."""

    index: int = 0
    of: str = axi.TOP

    @property
    def no_change(self) -> re.Pattern[str]:
        return axi.NO_CHANGE

    @property
    def top(self) -> str:
        return axi.TOP

    def verilog(self) -> str:
        return synthesize(sources_of(self.top), self.top, axi.clock()[1].generics())

    def count(self, cells: int) -> int:
        return axi.DRAWN

    def trials(self) -> list[Trial]:
        return [axi.trial(top_ports(self.folder / "design.v", top=self.top))]


def subjects(only: str = "") -> list[Subject]:
    """All of them, or those of the blocks whose name is ``only``."""
    chosen = [b for b in BLOCKS.values() if only in ("", b.name)]
    return [Subject(b.name, k) for b in chosen for k in range(len(b.configs)) if k not in b.too_wide]
