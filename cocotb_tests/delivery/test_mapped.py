# SPDX-License-Identifier: BSD-3-Clause
"""The netlist that is counted computes what the core does: one block in the test run, the whole in `make synth`."""

from __future__ import annotations

import os

import pytest

from cocotb_tests.support.core.converted import GENERICS, RARE, differences, stimulus, trace_of_verilog
from fluxproof.cosim import verilog
from fluxproof.cosim.verilated import VerilatedCore
from scripts.synth.mapped import MappedCore, with_mapped
from scripts.synth.parts import WHOLE_NETLIST

# A sum of products and a difference before a multiplier, which yosys has packed into a DSP48E1 wrongly before.
QUICK = ("torque", "voltage_limit")
QUICK_CLOCKS, CLOCKS = 10_000, 20_000


@pytest.fixture(scope="module", autouse=True)
def ghdl5():
    """Skips where nothing here converts to Verilog."""
    try:
        return verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))


def compare(mapped: VerilatedCore, clocks: int) -> tuple[list[str], list[str]]:
    """(differences in words, outputs that never change) over ``clocks`` clocks of core and ``mapped``."""
    core = VerilatedCore(GENERICS)
    assert core.outputs == mapped.outputs
    writes = stimulus(2, GENERICS, clocks)
    wanted, got = trace_of_verilog(writes, core), trace_of_verilog(writes, mapped)
    wrong = [
        line.replace("in Verilog", "in the netlist").replace("VHDL", "the core")
        for line in differences(core.outputs, wanted, got)
    ]
    return wrong, [name for j, name in enumerate(core.outputs) if len({row[j] for row in wanted}) < 2]


@pytest.mark.slow
def test_netlist_of_a_block_equals_the_core():
    wrong, _ = compare(MappedCore(GENERICS, QUICK), QUICK_CLOCKS)
    assert not wrong, "\n".join([f"{len(wrong)} differences", *wrong[:12]])


@pytest.mark.skipif(not os.environ.get(WHOLE_NETLIST), reason="some minutes: `make synth` runs it")
def test_whole_netlist_equals_the_core(capsys):
    mapped = MappedCore(GENERICS)
    wrong, still = compare(mapped, CLOCKS)
    assert not wrong, "\n".join([f"{len(wrong)} differences", *wrong[:12]])
    assert not set(still) - RARE, f"the stimulus never moves {still}"
    with capsys.disabled():
        print(f"\n{CLOCKS:,} clocks x {len(mapped.outputs)} outputs of the xc7 netlist and the core are equal")


def test_mapped_module_replaces_its_original():
    text = "/* head */\nmodule a\n  (input x);\n  b y (.x(x));\nendmodule\n\nmodule b\n  (input x);\nendmodule\n"
    changed = with_mapped(text, {"b": "module b(x);\n  input x;\n  wire z;\nendmodule"})
    assert changed.startswith("/* head */\nmodule a") and "  b y (.x(x));" in changed
    assert changed.count("module b") == 1 and "wire z" in changed
    with pytest.raises(ValueError, match="no module c"):
        with_mapped(text, {"c": ""})
