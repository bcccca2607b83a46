# SPDX-License-Identifier: BSD-3-Clause
"""The RTL against its golden model over a million edges: in Verilator, and a part of them in GHDL."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from cocotb_tests.support.peripherals.golden_player import GoldenPlayer
from cocotb_tests.support.peripherals.incremental_model import edges
from cocotb_tests.support.peripherals.incremental_stimulus import BITS, incremental
from fluxproof.cosim import ghdl
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.encoders import incremental_encoder

CLOCKS = 250_000
EDGES = 1_000_000


@pytest.mark.slow
def test_edges_in_verilator():
    assert compare(EDGES // 20) >= EDGES // 20


@pytest.mark.study
def test_a_million_edges(figure):
    passed = compare(EDGES)
    figure("equal edges, RTL and golden model, every output at every clock", passed, EDGES, "edges", passed >= EDGES)


def compare(wanted_edges: int) -> int:
    """Every output at every clock; and the ride is one: counts are lost, indices wrong, transitions illegal."""
    skip_without_ghdl5()
    core = VerilatedCore({"POSITION_BITS": BITS}, top="incremental_encoder")
    golden = GoldenPlayer(incremental_encoder.BLOCK, {"POSITION_BITS": BITS}, {})
    names = [p.name for p in incremental_encoder.BLOCK.outputs]
    core.reset()
    most, passed = dict.fromkeys(names, 0), 0
    for chunk, (registers, inputs) in enumerate(incremental(1, CLOCKS)):
        core.set_many(registers)
        golden.registers = registers
        got, wanted = core.play(inputs, names), golden.play(inputs)
        for k, name in enumerate(names):
            wrong = np.flatnonzero(got[:, k] != wanted[name])
            assert not len(wrong), f"{name} differs at clock {wrong[0]} of chunk {chunk}, {registers}"
            most[name] = max(most[name], int(np.abs(wanted[name]).max()))
        passed += edges(inputs)
        if passed >= wanted_edges:
            break
    assert all(most[name] for name in names if name != "setting_refused"), most
    return passed


@pytest.mark.parametrize("seed", [1])
def test_a_ride_in_ghdl(seed):
    folder = ghdl.run(
        "incremental_encoder",
        "cocotb_tests.support.in_simulator.dut_encoder",
        {"POSITION_BITS": BITS},
        {"FLUXPROOF_SEED": str(seed)},
    )
    problem = ghdl.failure(folder)
    assert problem is None, problem


def test_the_ride_differs():
    """Two chunks of a ride, and two seeds, are not the same."""
    (first, a), (_, b) = islice(incremental(1, 1000), 2)
    (_, c) = next(incremental(2, 1000))
    assert first and not (a["pin_a"] == b["pin_a"]).all() and not (a["pin_a"] == c["pin_a"]).all()
