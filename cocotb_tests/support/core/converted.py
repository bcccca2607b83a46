# SPDX-License-Identifier: BSD-3-Clause
"""A stimulus for the core, and what the converted Verilog and the VHDL show of it at every clock."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from fluxproof.cosim import ghdl, verilog
from fluxproof.cosim.values import random_value
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.fluxproof import REGISTERS, SAMPLE_INTERVAL
from golden_model.io import (
    brake_chopper,
    fault_latch,
    host_watch,
    load_check,
    motion_checks,
    offset_check,
    sample_checks,
    sample_guard,
    sample_latch,
)
from golden_model.io.sample_checks import IGNORE

GENERICS = {"ADC_BITS": 16, "POSITION_BITS": 16, "CARRIER_HALF": 100}
CLOCKS = 10000
GAP = (SAMPLE_INTERVAL, 80)  # clocks from sample to sample
CHECKS = (sample_guard, sample_checks, fault_latch, motion_checks, load_check, offset_check, brake_chopper, host_watch)
PROTECTION = tuple(
    p.name for block in CHECKS for p in block.BLOCK.registers
)  # fmt: skip
RARE = {"current_offset", "open_load"}  # need 64 samples at rest, turns of the rotor: test_blocks, test_limits
LATCHED = "run_in"  # the latch's input that the core makes itself
MODERATE = {  # registers of the size a drive has, with which little saturates
    "speed_given": 0,
    "position_restart": 0,
    **dict.fromkeys(("offset_a", "offset_b", "offset_c"), 32768),
    **dict.fromkeys(("gain_a", "gain_b", "gain_c", "u_dc_gain", "i_max"), 65536),
    **dict.fromkeys(("kp_d", "kp_q", "k_filter", "k_delay", "lambda_mg"), 20000),
    **dict.fromkeys(("ki_d", "ki_q", "speed_ki", "l_d", "l_q"), 300000),
    **{"pole_pairs": 3, "k_speed": 4096, "u_dc_offset": 200, "k_u_max": 75000, "speed_kp": 30000},
    **{"r_s": 600000, "t_s": 33000, "k_chord": 5500, "omega_0": 4000, "xi": 11000, "omega_min": 400},
    **{"k_ramp": 300, "flux_kp": 4000, "flux_ki": 5000, "delta_max": 15000},
    **{"k_sign": 2000000, "k_ahead": 20000, "k_lp": 3000, "eta_v": 300000, "gamma": 80000, "zeta": 80000},
    **{"v_thr": 1, "v_comp_max": 300, "i_learn": 60, "eta_psi": 50000, "omega_psi_min": 300},
}


def settings(rng: np.random.Generator) -> dict[str, int]:
    """dead_time and min_pulse in clocks: small ones that let the gates switch, one in five contradictory."""
    dead_time = int(rng.integers(1, 12))
    min_pulse = int(rng.integers(dead_time + 1, 30))
    if rng.integers(5) == 0:
        return {"dead_time": min_pulse, "min_pulse": dead_time}
    return {"dead_time": dead_time, "min_pulse": min_pulse}


def registers(rng: np.random.Generator, moderate: bool) -> dict[str, int]:
    """Every register but those of ``settings``: anywhere in its legal range, or within a half of MODERATE."""
    ports = [p for p in REGISTERS.values() if p.name not in ("dead_time", "min_pulse", *PROTECTION)]
    values = {p.name: random_value(rng, p) for p in ports}
    if moderate:
        values |= {name: int(value * rng.uniform(0.5, 1.5)) for name, value in MODERATE.items()}
        values |= {"flux_mode": int(rng.integers(2, 4)), "compensate": 1}
    return values


def protection(rng: np.random.Generator, moderate: bool) -> dict[str, int]:
    """Registers anywhere in their ranges; with the moderate samples every fault is reported and none trips."""
    values = {name: random_value(rng, REGISTERS[name]) for name in PROTECTION}
    return values | ({"fault_ignore": IGNORE.hi} if moderate else {})


def raw_sample(rng: np.random.Generator, generics: dict[str, int], moderate: bool = False) -> dict[str, int]:
    """Codes of the converters and references; ``moderate``: small currents, a valid bus, torque mode."""
    ports = [p for p in sample_latch.BLOCK.ports(generics) if p.name != LATCHED]
    values = {p.name: random_value(rng, p) for p in ports}
    if moderate:
        top = (1 << generics["ADC_BITS"]) - 1
        values |= {f"adc_{x}": int(top * rng.uniform(0.49, 0.51)) for x in "abc"}
        values |= {"adc_u_dc": int(0.8 * top), "speed_mode_in": 0}
        values |= {name: int(rng.integers(-6000, 6000)) for name in ("i_d_ref_in", "i_q_ext_in")}
    return values


def stimulus(seed: int, generics: dict[str, int], clocks: int = CLOCKS) -> list[dict[str, int]]:
    """For each clock the inputs that change before its rising edge: what the core may meet, in any order.

    A raw sample every GAP clocks, sometimes none for longer; its inputs turn to noise one clock later.
    Twelve moderate samples, then four wild ones; registers change between them; resets, trips and switching off come
    at any time.
    """
    rng, other = np.random.default_rng(seed), np.random.default_rng((seed, 1))
    writes: list[dict[str, int]] = [{} for _ in range(clocks)]

    def pulse(name: str, at: int, width: int = 1) -> None:
        writes[at][name] = 1
        writes[min(at + width, clocks - 1)][name] = 0

    for at in range(37, clocks, 450):
        writes[at] |= settings(rng)
    for at in sorted(rng.integers(1500, clocks, 4).tolist()):
        pulse("rst", at, int(rng.integers(1, 5)))
    for at in range(900, clocks - 800, 1100):
        pulse("trip", at + int(rng.integers(100)), 3)
        pulse("clear_trip", at + int(rng.integers(250, 350)))
        off = at + int(rng.integers(400, 700))
        writes[off]["enable"], writes[off + 30]["enable"] = 0, 1
    at, number = 20, 0
    while at < clocks - 1:
        writes[at] |= raw_sample(rng, generics, moderate=number % 16 < 12)
        if number % 16 in (0, 12, 14):
            writes[at] |= registers(rng, moderate=number % 16 == 0) | protection(other, number % 16 == 0)
        writes[at + 1] |= raw_sample(rng, generics)
        pulse("sample_valid", at)
        if number % 5 == 3 and at + 46 < clocks:
            pulse("sample_valid", at + int(other.integers(2, 45)))  # too early: must change nothing but its count
        at += int(rng.integers(*GAP, endpoint=True)) + (500 if number % 17 == 16 else 0)
        number += 1
    writes[0] |= {"rst": 1, "enable": 1, "dead_time": 3, "min_pulse": 8}
    writes[4]["rst"] = 0
    return writes


def trace_of_vhdl(
    writes, core: VerilatedCore, generics: dict, folder: Path, top: str = verilog.TOP
) -> list[list[int | None]]:
    """The outputs of the VHDL after every clock; None where GHDL shows a metavalue."""
    given, made = folder / "stimulus.json", folder / "trace.json"
    outputs = {name: core.ports[name].signed for name in core.outputs}
    inputs = [name for name in core.inputs if name != core.clock_name]
    stimuli = {"clock": core.clock_name, "inputs": inputs, "outputs": outputs, "writes": writes}
    given.write_text(json.dumps(stimuli))
    environment = {"FLUXPROOF_STIMULUS": str(given), "FLUXPROOF_TRACE": str(made)}
    run = ghdl.run(top, "cocotb_tests.support.in_simulator.dut_trace", generics, environment, key="trace")
    reason = ghdl.failure(run)
    assert reason is None, reason
    return json.loads(made.read_text())


def trace_of_verilog(writes: list[dict], core: VerilatedCore) -> list[list[int]]:
    """The outputs of the converted core after every clock."""
    rows = []
    for changes in writes:
        core.set_many(changes)
        core.settle()  # what needs no clock comes before it
        rows += core.trace(1, core.outputs).tolist()
    return rows


def differences(names, wanted, got) -> list[str]:
    """Every output that differs at any clock, as text; values that are undefined in the VHDL are no difference."""
    return [
        f"clock {k}: {name} is {b} in Verilog, {a} in VHDL"
        for k, rows in enumerate(zip(wanted, got, strict=True))
        for name, a, b in zip(names, *rows, strict=True)
        if a is not None and a != b
    ]
