# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof_board.xdc names a register for every asynchronous pin, and registers that exist."""

from __future__ import annotations

import re

from fluxproof.checkout import ROOT, RTL

TEXT = (ROOT / "scripts" / "vivado" / "fluxproof_board.xdc").read_text()
FIRST = re.compile(r"attribute async_reg of (\w+_meta|sync_1)\s*:")


def test_every_first_register_of_a_pin_is_constrained():
    named = set(re.findall(r"(\w+)_reg(?:\[\*\])?/D", TEXT))
    first = {
        (folder, register)
        for folder in ("common", "encoders", "converters")
        for path in (RTL / folder).glob("*.vhd")
        for register in FIRST.findall(path.read_text())
    }
    assert first and {register for _, register in first} == named


def test_the_instances_have_these_names():
    top = (RTL / "generated" / "fluxproof_board.vhd").read_text()
    labels = set(re.findall(r"(?:NAME =~ |get_pins )(\w+)/", TEXT))
    assert labels == {"position", "converters", "stage"}
    assert all(re.search(rf"^  {label} : entity work\.", top, re.MULTILINE) for label in labels)
