"""The netlists that are counted and placed compute what the VHDL does: every output at every clock, whole core."""

from __future__ import annotations

import pytest

from cocotb_tests.core.test_verilog import GENERICS, differences, stimulus, trace_of_verilog
from fluxproof.cosim import verilog
from fluxproof.cosim.verilated import VerilatedCore
from scripts.synth.mapped import MappedCore

CLOCKS = 20_000


@pytest.mark.parametrize("family", ["xc7", "ecp5"])
def test_mapped_netlist_equals_the_core(family, capsys):
    try:
        verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
    core, mapped = VerilatedCore(GENERICS), MappedCore(GENERICS, family)
    assert core.outputs == mapped.outputs
    writes = stimulus(2, GENERICS, CLOCKS)
    wanted, got = trace_of_verilog(writes, core), trace_of_verilog(writes, mapped)
    wrong = [
        line.replace("in Verilog", "in the netlist").replace("VHDL", "the core")
        for line in differences(core.outputs, wanted, got)
    ]
    assert not wrong, "\n".join([f"{len(wrong)} differences", *wrong[:12]])
    still = [name for j, name in enumerate(core.outputs) if len({row[j] for row in wanted}) < 2]
    assert not still, f"the stimulus never moves {still}"
    with capsys.disabled():
        print(f"\n{CLOCKS:,} clocks x {len(core.outputs)} outputs of the {family} netlist are equal")
