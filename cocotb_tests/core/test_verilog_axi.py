# SPDX-License-Identifier: BSD-3-Clause
"""The converted AXI top is the VHDL: bus, stream and trip pin at random, every output compared at every clock."""

from __future__ import annotations

import os

import numpy as np
import pytest

from cocotb_tests.support.core.converted import differences, trace_of_verilog, trace_of_vhdl
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.io import register_map

TOP = "fluxproof_axi"
GENERICS = {"ADC_BITS": 14, "POSITION_BITS": 17, "CARRIER_HALF": 60, "CLOCK_HZ": 1_000_000}
CLOCKS = 8000
SETTLED = {
    "dead_time": 3,
    "min_pulse": 8,
    "u_dc_gain": 65536,
    "fault_ignore": 32767,
    "brake_on": 1,
    "enable": 1,
    "telemetry_enable": 1,
}


def word(rng, register) -> int:
    """Mostly a legal value, sometimes any 32 bits."""
    if not register.kind.writable or rng.integers(8) == 0:
        return int(rng.integers(0, 1 << 32))
    return int(rng.integers(register.port.low, register.port.high + 1)) & 0xFFFFFFFF


def transfers(rng, writes) -> None:
    """A write or a read every 16 clocks, both now and then; mostly by the protocol, sometimes withdrawn early."""
    registers = list(register_map.registers().values())
    first = [(register_map.registers()[name], value) for name, value in SETTLED.items()]
    for number, at in enumerate(range(20, CLOCKS - 20, 16)):
        known = number < len(first)
        register = first[number][0] if known else registers[int(rng.integers(len(registers)))]
        data = first[number][1] if known else word(rng, register)
        if register.name in SETTLED and not known:  # the gates shall go on switching
            data = SETTLED[register.name]
        address = register.address if known or rng.integers(10) else int(rng.integers(0, 1 << 12))
        if known or rng.integers(3):
            writes[at] |= {
                "s_axi_awaddr": address,
                "s_axi_wdata": data,
                "s_axi_awvalid": 1,
                "s_axi_wvalid": 1,
            }
            writes[at] |= {"s_axi_wstrb": 15 if known or rng.integers(10) else int(rng.integers(16))}
            withdrawn = not known and rng.integers(2)
            writes[at + 1] |= {"s_axi_awvalid": 0, "s_axi_wvalid": 0} if withdrawn else {}
            writes[at + 4] |= {"s_axi_awvalid": 0, "s_axi_wvalid": 0}
        if rng.integers(3) == 0:
            writes[at] |= {"s_axi_araddr": address, "s_axi_arvalid": 1}
            writes[at + 3] |= {"s_axi_arvalid": 0}


def stimulus(seed: int) -> list[dict[str, int]]:
    """For each clock the inputs that change before its rising edge."""
    rng = np.random.default_rng(seed)
    writes: list[dict[str, int]] = [{} for _ in range(CLOCKS)]
    transfers(rng, writes)
    settled = 20 + 16 * len(SETTLED)  # until then no sample and a ready master: every write is taken, the gates switch
    for at in range(settled, CLOCKS - 2, 75):
        codes = {f"adc_{x}": int(rng.integers(7900, 8500)) for x in "abc"} | {"adc_u_dc": 12000}
        writes[at] |= {**codes, "position_code": int(rng.integers(1 << 17)), "sample_valid": 1}
        writes[at + 1] |= {"sample_valid": 0}
    writes[0] |= {"m_axis_tready": 1, "s_axi_bready": 1, "s_axi_rready": 1}
    for at in range(settled, CLOCKS):
        if rng.integers(6) == 0:
            ready = {"m_axis_tready": int(at % 2000 < 1500), "s_axi_bready": 1, "s_axi_rready": 1}
            writes[at] |= {name: int(value and rng.integers(4) > 0) for name, value in ready.items()}
    for at in range(2500, CLOCKS - 400, 1700):
        writes[at] |= {"trip": 1}
        writes[at + int(rng.integers(1, 9))] |= {"trip": 0}
        clear = {
            "s_axi_awaddr": 0x44,
            "s_axi_wdata": 1,
            "s_axi_wstrb": 15,
            "s_axi_awvalid": 1,
            "s_axi_wvalid": 1,
        }
        writes[at + 300] |= clear
    for at in (3300, 5555):
        writes[at] |= {"aresetn": 0}
        writes[at + int(rng.integers(1, 6))] |= {"aresetn": 1}
        for k, (name, value) in enumerate(SETTLED.items()):
            put = {
                "s_axi_awaddr": register_map.registers()[name].address,
                "s_axi_wdata": value,
                "s_axi_wstrb": 15,
            }
            writes[at + 20 + 16 * k] |= {**put, "s_axi_awvalid": 1, "s_axi_wvalid": 1, "s_axi_bready": 1}
    writes[0] |= {"aresetn": 0}
    writes[4] |= {"aresetn": 1}
    return writes


@pytest.mark.slow
def test_axi_top_equals_vhdl_clock_by_clock(ghdl5, tmp_path, capsys):  # noqa: F811
    seed = int(os.environ.get("FLUXPROOF_SEED", "1"))
    core = VerilatedCore(GENERICS, top=TOP)
    writes, names = stimulus(seed), core.outputs
    got = trace_of_verilog(writes, core)
    wanted = trace_of_vhdl(writes, core, GENERICS, tmp_path, TOP)
    assert len(got) == len(wanted) == CLOCKS
    undefined = sum(value is None for row in wanted for value in row)
    late = [names[j] for row in wanted[2000:] for j, value in enumerate(row) if value is None]
    assert not set(late) - {"s_axi_rdata", "m_axis_tdata", "m_axis_tlast"}, f"undefined for long: {set(late)}"
    wrong = differences(names, wanted, got)
    assert not wrong, "\n".join([f"{len(wrong)} differences", *wrong[:12]])
    still = [name for j, name in enumerate(names) if len({row[j] for row in wanted} - {None}) < 2]
    # A read answers OKAY at every address.
    assert still == ["s_axi_rresp"], f"the stimulus never moves {still}"
    with capsys.disabled():
        print(f"\nseed {seed}: {CLOCKS} clocks x {len(names)} outputs are equal; {undefined} values undefined")
