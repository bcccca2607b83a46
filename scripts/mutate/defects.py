# SPDX-License-Identifier: BSD-3-Clause
"""Defects planted by hand in copies of the VHDL, for what no netlist of one configuration shows, or no block's bench.

They are in generics and functions that run at elaboration, in the register bus, in the asynchronous path of
power_stage, and in the wiring of both tops; the tests of pytest judge them.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from fluxproof.checkout import BUILD, ROOT
from golden_model.registry import BLOCKS

FOLDER = BUILD / "mutate" / "defects"


class Defect(NamedTuple):
    """A text that stands once in a file below rtl/, and its replacement."""

    says: str
    file: str
    old: str
    new: str


# fmt: off
# ruff: noqa: E501
DEFECTS = (
    Defect("carrier constant cut off", "estimators/applied_voltage.vhd",
           "    if remainder >= CARRIER_HALF then\n      quotient := quotient + 1;", "    if remainder > 2 * CARRIER_HALF then\n      quotient := quotient + 1;"),
    Defect("power of two scaled too far", "estimators/applied_voltage.vhd", "while 2 ** n < CARRIER_HALF loop", "while 2 ** n <= CARRIER_HALF loop"),
    Defect("setting answered inside a sample", "io/register_access.vhd", " and not (between_3 and sample_busy)", ""),
    Defect("still setting answered while the gates switch", "io/register_access.vhd", " and not barred_5;", ";"),
    Defect("still setting taken while the gates switch", "io/register_access.vhd", " and not barred;", ";"),
    Defect("still setting that waited is taken", "io/register_access.vhd", " or (barred_5 and patient_5);", ";"),
    Defect("least value refused", "io/register_access.vhd", "below(number, low_3)", "not below(low_3, number)"),
    Defect("unaligned address taken", "io/register_access.vhd", "address(1 downto 0) = 0 and ", ""),
    Defect("setting counts inside a sample", "generated/register_file.vhd", "(row(2) and column(4) and not sample_busy)", "(row(2) and column(4))"),
    Defect("old values read after reset", "generated/register_file.vhd", "        written                   <= (others => '0');\n", ""),
    Defect("short trip forgotten", "io/power_stage.vhd", "    if trip_on = '1' then", "    if trip_on = '1' and rising_edge(clk) then"),
    Defect("gates let go before the core knows", "io/power_stage.vhd", "if sync_2 = '1' or rst = '1' then", "if sync_1 = '1' or rst = '1' then"),
    Defect("filtered trip acts a clock late", "io/power_stage.vhd", "to_unsigned(TRIP_FILTER, 10)", "to_unsigned(TRIP_FILTER + 1, 10)"),
    Defect("trip filter left out", "io/power_stage.vhd", "pin => pin_on, filter_clocks => to_unsigned(TRIP_FILTER, 10)", "pin => pin_on, filter_clocks => to_unsigned(0, 10)"),
    Defect("trip kept for ever", "io/power_stage.vhd", "if sync_2 = '1' or rst = '1' then", "if rst = '1' then"),
    Defect("one synchroniser stage", "io/power_stage.vhd", "trip <= sync_2;", "trip <= sync_1;"),
    Defect("upper and lower gates swapped", "generated/fluxproof_axi.vhd", "gate_high_next => gate_high_next,", "gate_high_next => gate_low_next,"),
    Defect("registers change in mid-sample", "generated/fluxproof_axi.vhd", "sample_busy       => sample_busy,", "sample_busy       => '0',"),
    Defect("the host is never missed", "generated/fluxproof_axi.vhd", "      host_write      => host_write,", "      host_write      => '1',"),
    Defect("the host of a board is never missed", "generated/fluxproof_board.vhd", "      host_write      => host_write,", "      host_write      => '1',"),
    Defect("faults of the board do not trip", "generated/fluxproof_board.vhd", "  core_trip <= trip_now or board_stop;", "  core_trip <= trip_now;"),
    Defect("every fault of the board ignored", "generated/fluxproof_board.vhd", "      board_ignore   => board_ignore,", "      board_ignore   => \"111\","),
    Defect("limits of the fast overcurrent swapped", "generated/fluxproof_board.vhd",
           "      limit_high        => limit_high,\n      limit_low         => limit_low,\n      adc_a", "      limit_high        => limit_low,\n      limit_low         => limit_high,\n      adc_a"),
    Defect("two faults of the board swapped", "generated/fluxproof_board.vhd",
           "      index_wrong    => index_wrong,\n      position_lost  => position_lost,\n", "      index_wrong    => position_lost,\n      position_lost  => index_wrong,\n"),
)
# fmt: on

# File without its folder and suffix -> the tests that detect a defect in it; others: the block's bench.
TESTS = {
    **dict.fromkeys(
        ("axi_lite_slave", "register_access", "register_file"),
        ["cocotb_tests/blocks/test_registers_axi.py::test_axi_slave_equals_its_twin"],
    ),
    "power_stage": ["cocotb_tests/blocks/test_power_stage.py"],
    "fluxproof_axi": [
        "cocotb_tests/core/test_axi_top.py",
        "cocotb_tests/core/test_bring_up.py::test_the_program_writes_within_its_own_heartbeat",
    ],
    "fluxproof_board": ["cocotb_tests/board/test_closed_loop.py::test_every_fault_of_the_board_through_the_pins"],
}
WHY = re.compile(r"^E\s+(?:AssertionError: )?(.*\S)", re.MULTILINE)


def plant(defect: Defect) -> Path:
    """A copy of the RTL with the defect; ValueError unless its text occurs exactly once."""
    tree = FOLDER / re.sub(r"\W+", "_", defect.says)
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(ROOT / "rtl", tree)
    text = (tree / defect.file).read_text()
    if text.count(defect.old) != 1:
        raise ValueError(f"defect '{defect.says}': its text occurs {text.count(defect.old)} times in rtl/{defect.file}")
    (tree / defect.file).write_text(text.replace(defect.old, defect.new))
    return tree


def tests_of(file: str) -> list[str]:
    """The tests that pytest runs for a defect in this file of rtl/."""
    name = Path(file).stem
    bench = "cocotb_tests/blocks/test_blocks.py::test_rtl_equals_model"
    return TESTS.get(name) or [f"{bench}[{name}-{k}]" for k in range(len(BLOCKS[name].configs))]


def noticed_by(defect: Defect) -> str:
    """What a test says of the defect; empty if none fails.  RuntimeError where the tests cannot run or it does not build."""
    tree = plant(defect)
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist"]
    environment = {**os.environ, "FLUXPROOF_RTL": str(tree)}
    done = subprocess.run([*command, *tests_of(defect.file)], cwd=ROOT, env=environment, capture_output=True, text=True)
    shutil.rmtree(tree, ignore_errors=True)
    if done.returncode not in (0, 1) or "BuildError" in done.stdout:
        raise RuntimeError(f"defect '{defect.says}': its tests do not run:\n{done.stdout[-2000:]}{done.stderr[-500:]}")
    found = WHY.search(done.stdout)
    return "" if done.returncode == 0 else found[1][:200] if found else "a test failed"
