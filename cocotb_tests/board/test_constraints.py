# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof_board.xdc names a register for every asynchronous pin, and registers that exist."""

from __future__ import annotations

import re

import pytest

from cocotb_tests.support.vivado.tclsh import stubbed
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
    labels = set(re.findall(r"(?:NAME =~ \*|get_pins )(\w+)/", TEXT))
    assert labels == {"position", "master_pins", "converters", "stage"}
    assert all(re.search(rf"^  {label} : entity work\.", top, re.MULTILINE) for label in labels)


PINS = (
    "stage/caught_reg/PRE", "stage/filtered.filter/sync_1_reg/D",
    "position/edges/filter_a/sync_1_reg/D", "master_pins/built.filters[0].filter/sync_1_reg/D",
    "converters/spi/frame/busy_meta_reg/D",
    "converters/bits/clock_meta_reg/D", "converters/spi/words/miso_meta_reg[0]/D", "converters/bits/data_meta_reg[3]/D",
)  # fmt: skip


@pytest.mark.parametrize("above", ["", "system_i/drive/inst/"])
def test_every_pattern_finds_its_pins_wherever_the_board_is(tmp_path, above):
    """As the top, and in a block design, where NAME begins with the cells above; and the count is printed."""
    facts = tmp_path / "facts.tcl"
    facts.write_text("set design_pins {" + " ".join(above + pin for pin in PINS) + "}\n")
    done = stubbed(facts, ROOT / "scripts" / "vivado" / "fluxproof_board.xdc")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\nset_false_path") == 6 and done.stdout.count("\nset_max_delay") == 2
    counted = stubbed(facts, ROOT / "scripts" / "vivado" / "board_pins.tcl")
    told = re.findall(r"^fluxproof_board.xdc: (\d+) pins match", counted.stdout, re.MULTILINE)
    assert told == ["1"] * len(PINS) and "8 pins in all" in counted.stdout, counted.stdout + counted.stderr


def test_what_is_not_built_counts_as_nothing_and_a_missing_board_is_an_error(tmp_path):
    facts = tmp_path / "facts.tcl"
    facts.write_text(f"set design_pins {{drive/{PINS[0]} drive/{PINS[2]}}}\n")
    counted = stubbed(facts, ROOT / "scripts" / "vivado" / "board_pins.tcl")
    assert counted.returncode == 0 and "0 pins match *converters/*/busy_meta_reg/D" in counted.stdout
    facts.write_text(f"set design_pins {{drive/{PINS[1]}}}\n")
    nothing = stubbed(facts, ROOT / "scripts" / "vivado" / "board_pins.tcl")
    assert nothing.returncode != 0 and "the trip pin is unconstrained" in nothing.stderr
