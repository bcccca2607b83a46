"""fluxproof_board turns a motor from A/B/Z edges and SPI lines to gates, at every clock as the golden board."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cocotb_tests.support.board_loop import CONSTANT
from cocotb_tests.support.board_runs import RPM, SNAP_AT, first_difference, start_from_standstill, status
from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim import ghdl
from fluxproof.cosim.board_clock import SEEN
from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.golden_model.generated.register_names import ADDRESSES
from fluxproof.plant.sensors import current_code

GENERICS = {"CARRIER_HALF": 250, "CLOCK_HZ": 5_000_000}


def in_ghdl(periods: int) -> dict[str, float]:
    """Facts of the run; AssertionError with the first difference."""
    # Without numba: to compile the golden board takes as long as to run it so often.
    environment = {"FLUXPROOF_PERIODS": str(periods), "NUMBA_DISABLE_JIT": "1"}
    folder = ghdl.run("fluxproof_board", "cocotb_tests.support.dut_board", GENERICS, environment, key=str(periods))
    problem = ghdl.failure(folder)
    assert problem is None, problem
    return json.loads((folder / "board.json").read_text())


def test_closed_loop_in_ghdl():
    """120 periods of 500 clocks: every register over the bus, enabled, the motor turns, the index is found."""
    facts = in_ghdl(120)
    assert facts["clocks"] > 120 * 500 and facts["samples"] > 90 and facts["rpm"] > 50
    assert facts["encoder_flags"] & 1 and facts["index_count"] > 0 and facts["illegal_count"] == 0
    assert facts["board_flags"] == 0 and facts["snap_ready"] == 1


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_closed_loop_over_2000_periods(figure):
    facts = in_ghdl(2000)
    figure("closed loop, A/B/Z and SPI, GHDL against golden, 2,000 periods", 0, 0, "differences", True)
    assert facts["rpm"] < -0.9 * RPM and facts["samples"] > 1900


@pytest.mark.study
def test_start_from_standstill_in_verilator(figure):
    """To 600 rpm and back to -600 rpm; the snapshot read over the bus is what the sample brought."""
    skip_without_ghdl5()
    loop = start_from_standstill()
    core = VerilatedCore(loop.generics(), top="fluxproof_board")
    core.set_many(CONSTANT)
    core.reset()
    core.tick(2)
    fastest, codes = 0.0, {}
    for chunk in loop.run(2000):
        if chunk.number == SNAP_AT:
            codes = {x: int(current_code(loop.codes, n, loop.plant.i_abc[n], 0)) for n, x in enumerate("abc")}
        problem = first_difference(core.play(chunk.inputs, SEEN), chunk.seen, SEEN, chunk.number)
        assert problem is None, problem
        fastest = max(fastest, chunk.omega_m * 60 / (2 * np.pi))
        assert chunk.seen[:, SEEN.index("irq")].max() == 0
    seen = status(chunk)
    assert fastest == pytest.approx(RPM, rel=0.1) and chunk.omega_m < -0.9 * RPM * 2 * np.pi / 60
    assert seen["lost_counts"] == seen["illegal_count"] == seen["board_flags"] == 0 and seen["snap_ready"] == 1
    for name in ("snap_ready", "snap_code", "snap_count", "snap_flags", "snap_adc_a", "snap_adc_u_dc"):
        assert read_register(core, name) == seen[name], name
    assert all(abs(seen[f"snap_adc_{x}"] - code) < 300 for x, code in codes.items())
    figure("closed loop in Verilator, start from standstill, 2,000 periods", 0, 0, "differences", True)


def read_register(core: VerilatedCore, name: str) -> int:
    """A word over AXI4-Lite."""
    core.set_many({"s_axi_araddr": ADDRESSES[name], "s_axi_arvalid": 1})
    for _ in range(200):
        core.settle()
        ready, valid = core.get("s_axi_arready"), core.get("s_axi_rvalid")
        word = core.get("s_axi_rdata")
        assert not valid or core.get("s_axi_rresp") == 0
        core.tick()
        if ready:
            core.set("s_axi_arvalid", 0)
        if valid:
            return word
    raise TimeoutError(name)


def test_the_run_is_told_by_a_wrong_pin():
    """A difference at one pin at one clock is found and named."""
    seen = np.zeros((5, len(SEEN)), np.int64)
    wrong = seen.copy()
    wrong[3, 1] = 1
    assert first_difference(seen, seen.copy(), SEEN, 7) is None
    assert first_difference(wrong, seen, SEEN, 7) == "period 7, clock 3: gate_low is 1 instead of 0"
