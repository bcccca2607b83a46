# SPDX-License-Identifier: BSD-3-Clause
"""`python -m scripts.synth --board`: cells of every choice of fluxproof_board's front ends, and of whole boards.

A front end is counted alone, with its generic; a board in one piece, with the core and all registers.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

from fluxproof.checkout import RTL
from fluxproof.cosim.sources import rtl_sources
from fluxproof.cosim.verilog import synthesize
from golden_model.converters import current_front
from golden_model.encoders import position_front
from scripts.synth.count import Count, count, read_cells
from scripts.synth.yosys import SYNTH, yosys

FRONTS = {
    **{f"position_front, {kind}": ("position_front", {"ENCODER": k}) for k, kind in enumerate(position_front.KINDS)},
    **{f"current_front, {kind}": ("current_front", {"CURRENTS": k}) for k, kind in enumerate(current_front.KINDS)},
    **{name: (name, {}) for name in ("forced_position", "sample_join", "board_faults", "board_snapshot")},
    "board_register_file": ("board_register_file", {}),
}
BOARDS = {"fluxproof_board, abz, spi": ("fluxproof_board", {"ENCODER": 1, "CURRENTS": 1})}


def counted(entity: str, generics: Mapping[str, int], family: str, rtl: Path = RTL) -> Count:
    """An entity with these generics in one piece; every input is free and every output used."""
    verilog = synthesize(rtl_sources(rtl), entity, generics)
    top = re.search(rf"^module ({entity}\w*)", verilog, re.MULTILINE)[1]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "design.v").write_text(verilog)
        script = ["read_verilog design.v", SYNTH.format(family=family, top=top), "tee -q -o stat.json stat -json"]
        yosys(script, folder)
        return count(read_cells(folder / "stat.json")[top])


def counts(family: str) -> dict[str, Count]:
    """{what: Count} of all of them, some seconds each."""
    rows = {}
    for what, (entity, generics) in (FRONTS | BOARDS).items():
        began = time.monotonic()
        rows[what] = counted(entity, generics, family)
        print(f"{family}: {what}: {time.monotonic() - began:.0f} s", flush=True, file=sys.stderr)
    return rows
