# SPDX-License-Identifier: BSD-3-Clause
"""The converted Verilog is the VHDL: both run on the same stimulus, every output is compared at every clock.

The VHDL runs in the machine's GHDL, which had no part in the conversion; the Verilog runs in Verilator.
"""

from __future__ import annotations

import os

import pytest

from cocotb_tests.support.core.converted import (
    CLOCKS,
    GENERICS,
    RARE,
    differences,
    stimulus,
    trace_of_verilog,
    trace_of_vhdl,
)
from fluxproof.cosim import verilog
from fluxproof.cosim.sources import rtl_sources
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.io.sample_checks import IGNORE

OTHER = {"ADC_BITS": 12, "POSITION_BITS": 18, "CARRIER_HALF": 75}


@pytest.mark.parametrize("generics", [GENERICS, OTHER], ids=["sixteen_bits", "other_widths"])
@pytest.mark.slow
def test_equals_vhdl_clock_by_clock(ghdl5, generics, tmp_path, capsys):
    seed = int(os.environ.get("FLUXPROOF_SEED", "1"))
    core = VerilatedCore(generics)
    names = core.outputs
    writes = stimulus(seed, generics)
    got = trace_of_verilog(writes, core)
    wanted = trace_of_vhdl(writes, core, generics, tmp_path)
    assert len(got) == len(wanted) == CLOCKS

    # Registers without a reset are undefined in VHDL and 0 in Verilog until the first sample has passed.
    first = next(k for k, row in enumerate(wanted) if row[names.index("values_valid")] == 1)
    undefined = [k for k, row in enumerate(wanted) for value in row if value is None]
    assert max(undefined, default=0) < first, f"undefined at clock {max(undefined)}, first valid at {first}"

    wrong = differences(names, wanted, got)
    again = f"rerun: FLUXPROOF_SEED={seed} make test ARGS='-k equals_vhdl'"
    assert not wrong, "\n".join([f"{len(wrong)} differences", *wrong[:12], again])

    # The comparison is significant only if every output changed.
    still = [name for j, name in enumerate(names) if len({row[j] for row in wanted} - {None}) < 2]
    assert not set(still) - RARE, f"the stimulus never moves {still}"
    with capsys.disabled():
        equal = f"{CLOCKS} clocks x {len(names)} outputs are equal"
        print(f"\nseed {seed}: {equal}; {len(undefined)} values undefined before clock {first}")


@pytest.mark.slow
def test_constant_wider_than_the_vector(ghdl5, tmp_path):
    """min_pulse has 12 bits, CARRIER_HALF more: GHDL 5 would compare with its lower 12 bits."""
    generics = GENERICS | {"CARRIER_HALF": 10_000}
    core = VerilatedCore(generics)
    settings = [{"dead_time": 3, "min_pulse": pulse} for pulse in (1800, 1900, 4095, 2, 1808, 1809)]
    writes = [{"rst": 1, "enable": 0}, {}, {"rst": 0}, *settings, {}]
    refused = core.outputs.index("setting_refused")
    got = [row[refused] for row in trace_of_verilog(writes, core)]
    wanted = [row[refused] for row in trace_of_vhdl(writes, core, generics, tmp_path)]
    assert got[1:] == wanted[1:]
    assert got[3:9] == [0, 0, 0, 1, 0, 0]


@pytest.mark.slow
def test_run_period_records_what_a_trace_shows(ghdl5):
    settings = {"enable": 1, "fault_ignore": IGNORE.hi, "dead_time": 3, "min_pulse": 8}
    settings |= {"lambda_mg": 9000, "u_dc_gain": 60000}
    sample, sample_at = {"adc_a": 40000, "adc_u_dc": 50000, "position_code": 777}, 5
    names = ("gate_high", "gate_low", "sample_trigger")
    fast, slow = VerilatedCore(GENERICS), VerilatedCore(GENERICS)
    for core in (fast, slow):
        core.set_many(settings)
        core.reset()
        assert core.clocks_until("sample_trigger", 10) == 1
    edges = 0
    for _ in range(10):
        words = [slow.gate_word]
        clocks, edge_clocks, gate_words = fast.run_period(1000, sample, sample_at)
        slow.set_many(sample)
        rows = slow.trace(sample_at - 1, names).tolist()
        slow.apply_sample()
        rows.append([slow.get(name) for name in names])
        rows += slow.trace(clocks - sample_at, names).tolist()
        words += [high | low << 3 for high, low, _ in rows]
        changes = [(k, words[k]) for k in range(1, clocks + 1) if words[k] != words[k - 1]]
        assert fast.duty_at - sample_at > 0 and fast.values_at > fast.duty_at
        assert [row[2] for row in rows] == [0] * (clocks - 1) + [1]
        assert changes == list(zip(edge_clocks.tolist(), gate_words.tolist(), strict=True))
        edges += len(changes)
    assert clocks == 2 * GENERICS["CARRIER_HALF"]
    assert edges > 20 and fast.clock == slow.clock


def test_set_refuses_values_out_of_range(ghdl5):
    core = VerilatedCore(GENERICS)
    core.set("omega_ref_in", -(1 << 17))
    assert core.get("omega_ref_in") == -(1 << 17)
    for name, value in (("omega_ref_in", 1 << 17), ("adc_a", -1), ("adc_a", 1 << 16), ("i_a", 0), ("clk", 1)):
        with pytest.raises(ValueError):
            core.set(name, value)
    with pytest.raises(TimeoutError):
        core.clocks_until("values_valid", 50)


SHIFT = """\
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity shifted is port (a : in signed(7 downto 0); y : out signed(7 downto 0)); end entity;
architecture rtl of shifted is begin y <= shift_right(a, 3); end architecture;
"""


def test_signed_shift_stays_arithmetic(ghdl5, tmp_path):
    source = tmp_path / "shifted.vhd"
    source.write_text(SHIFT)
    assert ">>>" in verilog.synthesize([source], "shifted", {})


def test_old_ghdl_is_refused(monkeypatch):
    monkeypatch.setattr(verilog, "ghdl_version", lambda path: "2.0.0")
    with pytest.raises(verilog.NoUsableGhdl, match="miscompiles silently.*make setup"):
        verilog.find_ghdl.__wrapped__()


def test_sources_are_in_compile_order(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.vhd").write_text("use work.p.all; entity a is end; -- entity work.z\n x : entity work.b\n")
    (tmp_path / "sub" / "b.vhd").write_text("entity b is end entity;")
    (tmp_path / "z_pkg.vhd").write_text("package p is end package;")
    assert [path.stem for path in rtl_sources(tmp_path)] == ["z_pkg", "b", "a"]
    order = [path.stem for path in rtl_sources()]
    tops = {"fluxproof_axi", "fluxproof_board", "fluxproof_hil", "core_and_motor"}
    assert set(order[-4:]) == tops and order.index("fluxproof") < len(order) - 4
