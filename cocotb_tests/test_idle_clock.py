"""Clocks left out for the part that rests: every port at every clock is the same, whatever is done to the core."""

from __future__ import annotations

import numpy as np
import pytest

from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.io import sample_latch
from golden_model.registers import registers
from scripts import idle_clock, verilated, verilog
from scripts.files import ROOT

GENERICS = {"ADC_BITS": 16, "POSITION_BITS": 16, "CARRIER_HALF": 100}
NO_TRIP = fluxproof.REGISTERS["fault_ignore"].high
PORTS = [p for p in sample_latch.BLOCK.ports(GENERICS) if p.name != "run_in"]


@pytest.fixture(scope="module")
def source():
    try:
        verilog.find_ghdl()
    except RuntimeError as reason:
        pytest.skip(str(reason))
    return (verilated.build(GENERICS) / "fluxproof.v").read_text()


def cores():
    """The same core twice, the first one without the second clock."""
    return [verilated.VerilatedCore(folder=verilated.build(GENERICS, rests=rests)) for rests in (False, True)]


def disturbances(rng: np.random.Generator, count: int):
    """Inputs to set and clocks to go on for: samples near and far, registers, run and stop, trips, resets."""
    drive = drives.with_carrier(drives.load(ROOT / "docs" / "drives" / "paper001.toml"), GENERICS["CARRIER_HALF"])
    own = registers(drive).values._replace(fault_ignore=NO_TRIP)._asdict()
    yield {"rst": 1}, 4
    yield {"rst": 0, "enable": 1, **own}, 700
    for _ in range(count):
        what = rng.integers(20)
        if what < 14:
            yield {p.name: int(rng.integers(p.low, p.high + 1)) for p in PORTS} | {"sample_valid": 1}, 1
            yield {"sample_valid": 0}, int(rng.integers(1, 400))
        elif what < 17:
            name = str(rng.choice(list(own)))
            port = fluxproof.REGISTERS[name]
            yield {name: int(rng.integers(port.low, port.high + 1))}, int(rng.integers(1, 300))
            yield {name: own[name]}, int(rng.integers(1, 300))
        elif what == 17:
            yield {"enable": 0}, int(rng.integers(1, 500))
            yield {"enable": 1}, int(rng.integers(1, 500))
        else:
            name = "rst" if what == 18 else "trip"
            yield {name: 1}, int(rng.integers(1, 5))
            yield {name: 0}, int(rng.integers(1, 500))
            yield {"clear_trip": 1}, 1
            yield {"clear_trip": 0}, 1


def test_every_port_at_every_clock(source):
    plain, resting = cores()
    for writes, clocks in disturbances(np.random.default_rng(1), 400):
        traces = []
        for core in (plain, resting):
            core.set_many(writes)
            traces.append(core.trace(clocks, core.outputs))
        different = np.argwhere(traces[0] != traces[1])
        assert not len(different), (writes, different[0], plain.outputs[different[0][1]])
    assert plain.clock == resting.clock > 50_000 and plain.rested == 0
    assert 0.4 < resting.rested / resting.clock < 1, "the test must meet both"


def test_what_the_resting_part_sees(source):
    """Every output of the counting instances that the others read is watched."""
    text = idle_clock.split(source, "fluxproof")
    watched = text.split(f"assign {idle_clock.WATCHED} = {{")[1].split("}")[0].split(", ")
    assert watched == ["gates_min_pulse_used", "gates_running", "guard_sample_busy"]
    assert text.count(f".clk({idle_clock.RESTING})") + len(idle_clock.COUNTING) == source.split("module fluxproof\n")[
        1
    ].count(".clk(clk)")


@pytest.mark.parametrize(
    "old, new", [(" guard (", " other ("), ("endmodule\n", "  always @(posedge clk);\nendmodule\n")]
)
def test_other_tops_stay_whole(source, old, new):
    head, body = source.split("module fluxproof\n")
    assert idle_clock.split(f"{head}module fluxproof\n{body.replace(old, new)}", "fluxproof") is None
