# SPDX-License-Identifier: BSD-3-Clause
"""Long runs of the converted RTL in Verilator: equal to the golden model, also at the full 200 MHz / 10 kHz ratio."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim.closed_loop import SAMPLE_DELAY, cosimulate, run_now
from fluxproof.cosim.scenarios import SCENARIOS
from fluxproof.cosim.sleeping import with_witness
from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.cosim.verilated_device import VerilatedDevice
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.io import sample_latch
from golden_model.registers import registers

DRIVE = drives.load(PAPER)
NO_TRIP = fluxproof.REGISTERS["fault_ignore"].high  # samples that no healthy drive gives shall not stop the gates


def run_in_verilator(drive, scene):
    register_set = registers(drive)
    result = run_now(cosimulate(VerilatedDevice(register_set.config), drive, register_set, scene))
    assert result.differences == 0, result.first_difference
    assert result.periods_compared == len(scene)
    assert result.sample_to_duty_clocks == fluxproof.SAMPLE_TO_DUTY
    return result


@pytest.mark.slow
def test_full_ratio():
    """The start of Fig. 9 at 20,000 clocks a period; `make demo` runs all 3,000 periods."""
    skip_without_ghdl5()
    assert registers(DRIVE).config.carrier_half == 10_000
    result = run_in_verilator(DRIVE, SCENARIOS["fig9"](DRIVE).first(150))
    assert result.plant["omega_m"][-1] * 30 / np.pi > 25


@pytest.mark.slow
def test_long_at_the_voltage_limit():
    """4,000 periods towards the rated speed, and back through zero, on a bus of 300 V."""
    skip_without_ghdl5()
    drive = drives.with_carrier(DRIVE, 100)
    result = run_in_verilator(drive, SCENARIOS["full_speed"](drive))
    rpm = result.plant["omega_m"] * 30 / np.pi
    assert rpm.max() > 2000 and rpm.min() < -1000
    assert np.count_nonzero(result.observed["sat_q"]) > 200, "the voltage circle was never reached"


def test_samples_at_the_minimum_interval():
    """Random raw samples FLUXPROOF_SAMPLE_INTERVAL clocks apart: each equals the golden model."""
    skip_without_ghdl5()
    register_set = registers(drives.with_carrier(DRIVE, 100))
    config = register_set.config
    core = VerilatedCore({name.upper(): value for name, value in config._asdict().items()})
    core.reset()
    values = register_set.values._replace(fault_ignore=NO_TRIP)
    core.set_many({**values._asdict(), "enable": 1})
    core.tick(3 * 2 * config.carrier_half)
    assert core.get("running") == 1
    rng, state = np.random.default_rng(1), fluxproof.State()
    for _ in range(1000):
        codes, references = rng.integers(0, 1 << 16, 5), rng.integers(-90000, 90000, 3)
        sample = fluxproof.Sample(
            *codes, *references, rng.integers(2), rng.integers(-9999, 9999), *rng.integers(0, 2, 2), 1
        )
        inputs = dict(zip([p.name for p in sample_latch.BLOCK.inputs], map(int, sample), strict=True))
        inputs.pop("run_in")
        core.apply_sample(**inputs)
        core.tick(fluxproof.SAMPLE_INTERVAL - 1)
        state, wanted = fluxproof.step(state, fluxproof.Sample(*map(int, sample)), values, config)
        got = core.get_many(fluxproof.Observed._fields)
        assert tuple(got.values()) == tuple(wanted)


@pytest.mark.slow
def test_nothing_changes_in_what_sleeps():
    """A core with all that it can have: every register that stands between samples, at every clock of a run."""
    skip_without_ghdl5()
    parts = ("references", "position_loop", "residual", "modes", "overmodulation")
    drive = drives.with_carrier(DRIVE, 500)
    values, config = registers(drive)[:2]
    config = config._replace(**dict.fromkeys(parts, 1))
    core = VerilatedCore({name.upper(): value for name, value in config._asdict().items()}, rewrite=with_witness)
    core.reset()
    core.set_many({**values._asdict(), "enable": 1, "fault_ignore": NO_TRIP})
    core.run_period(4 * config.carrier_half)
    rng, ports = np.random.default_rng(1), sample_latch.BLOCK.ports({"ADC_BITS": 16, "POSITION_BITS": 16})
    for period in range(150):
        row = {p.name: int(rng.integers(p.low, p.high + 1)) for p in ports if p.name != "run_in"}
        core.set_many({"position_mode": period // 25 % 2, "use_table": period // 50 % 2})
        core.set("position_target", period << 14)
        core.run_period(4 * config.carrier_half, sample=row, sample_at=SAMPLE_DELAY + 1)
    assert core.get("running") and core.missed == 0


KEPT = ("dead_time", "min_pulse", "flux_mode", "charge_samples")  # a charge of the bootstraps outlasts the run


def test_every_register_at_its_limits():
    """Samples at the ends of their codes, registers at the ends of their ranges, in every combination: no bit differs.

    The RTL computes in words of the declared widths, the model in 64 bits: a wrap-around anywhere would show here.
    """
    skip_without_ghdl5()
    register_set = registers(drives.with_carrier(DRIVE, 100))
    config, rng, seen = register_set.config, np.random.default_rng(6), 0
    core = VerilatedCore({name.upper(): value for name, value in config._asdict().items()})
    ports = [p for p in sample_latch.BLOCK.ports({"ADC_BITS": 16, "POSITION_BITS": 16}) if p.name != "run_in"]
    for run in range(120):
        values = register_set.values
        for name, port in fluxproof.REGISTERS.items():
            if rng.integers(3) > run % 2 and name not in KEPT:
                values = values._replace(**{name: int(rng.choice((port.low, port.high)))})
        values = values._replace(flux_mode=run % 4, fault_ignore=NO_TRIP)
        core.reset()
        core.set_many({**values._asdict(), "enable": 1})
        core.tick(3 * 2 * config.carrier_half)
        assert core.get("running") == 1
        state, row = fluxproof.State(), {p.name: int(rng.choice((p.low, p.high))) for p in ports}
        for _ in range(60):
            for port in ports:  # some values stay for long, so that integrators reach their ends
                if rng.integers(8) == 0:
                    inside = run % 2 and port.name.startswith("adc")  # a code at its very ends sets a flag and holds
                    ends = (port.low + inside, port.high - inside, int(rng.integers(port.low, port.high + 1)))
                    row[port.name] = int(rng.choice(ends))
            core.apply_sample(**row)
            core.tick(fluxproof.SAMPLE_INTERVAL - 1)
            state, wanted = fluxproof.step(state, fluxproof.Sample(*row.values(), 1), values, config)
            assert tuple(core.get_many(fluxproof.Observed._fields).values()) == tuple(wanted), (run, row)
            seen |= wanted.flux_faults
    assert seen == 127, f"only the faults {seen:07b} were ever provoked"
