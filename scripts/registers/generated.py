# SPDX-License-Identifier: BSD-3-Clause
"""Every committed file generated from the register map, as text: the SystemRDL, and the files generated from it."""

from __future__ import annotations

import tempfile
from pathlib import Path

from systemrdl.node import AddrmapNode

from fluxproof.checkout import ROOT
from scripts.registers import export, rdl, vhdl
from scripts.registers.compiled import compile_file, words

RDL = ROOT / "rtl" / "generated" / "fluxproof.rdl"
MAP_PACKAGE = ROOT / "rtl" / "generated" / "register_map_pkg.vhd"
BOARD_FILE = ROOT / "rtl" / "generated" / "board_register_file.vhd"
HIL_FILE = ROOT / "rtl" / "generated" / "hil_register_file.vhd"
REGISTER_FILE = ROOT / "rtl" / "generated" / "register_file.vhd"
C_HEADER = ROOT / "docs" / "software" / "fluxproof_registers.h"
NAMES = ROOT / "golden_model" / "generated" / "register_names.py"


def compiled(text: str) -> AddrmapNode:
    """The elaborated map of a SystemRDL text."""
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / RDL.name
        path.write_text(text)
        return compile_file(path)


def files() -> dict[Path, str]:
    """{path: text} of all of them."""
    text = rdl.render()
    top = compiled(text)
    found = words(top)
    return {
        RDL: text,
        MAP_PACKAGE: vhdl.package(found),
        REGISTER_FILE: vhdl.register_file(vhdl.of_core(found)),
        BOARD_FILE: vhdl.register_file(vhdl.of_board(found), "board_register_file"),
        HIL_FILE: vhdl.register_file(found, "hil_register_file"),
        C_HEADER: export.c_header(top, C_HEADER.name),
        NAMES: export.python_names(found),
    }
