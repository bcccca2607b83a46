# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA as it is wired against its golden model: every output at every step."""

from __future__ import annotations

import numpy as np

from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.hil.registers import motor_registers, motor_scale, motor_tables
from fluxproof.plant.inverter import Inverter
from fluxproof.plant.pmsm import Harmonic, Machine
from golden_model.motor import motor_model
from golden_model.motor.motor_model import STARTING, STEP, Inputs, Shown, State

SERVO = Machine(
    pole_pairs=4,
    resistance_ohm=0.39,
    inductance_d_h=0.2e-3,
    inductance_q_h=0.27e-3,
    magnet_flux_wb=6.3e-3,
    inertia_kgm2=2.5e-6,
    viscous_friction_nms=1e-5,
    coulomb_friction_nm=5e-3,
    saturation_d_per_a2=2e-4,
    saturation_q_per_a2=4e-4,
    cross_saturation_wb_per_a2=2e-7,
    phase_resistance_asymmetry=(0.0, 0.02, -0.01),
    emf_harmonics=(Harmonic(6, 0.02, 0.015, 0.3),),
    cogging_amplitude_nm=4e-3,
    cogging_order=24,
)
SWITCHES = Inverter(v_switch_v=0.2, v_diode_v=0.7, r_switch_ohm=4e-3, r_diode_ohm=4e-3)
U_DC_V, CURRENT_A, CLOCK_HZ = 24.0, 16.5, 200e6
SIGNED_36 = 1 << 18


def write_tables(core: VerilatedCore, tables) -> None:
    """All words of the tables through the motor's port."""
    words = [
        *((0, 64 * r + c, tables.map_d[r, c], tables.map_q[r, c]) for r in range(64) for c in range(64)),
        *((1, k, tables.wave_d[k], tables.wave_q[k]) for k in range(len(tables.wave_d))),
        *((2, k, 0, tables.cogging[k]) for k in range(len(tables.cogging))),
    ]
    columns = np.array([(s, at, (int(d) % SIGNED_36) << 18 | int(q) % SIGNED_36) for s, at, d, q in words], np.int64).T
    given = dict(zip(("table_select", "table_at", "table_word"), columns, strict=True))
    core.play(given | {"table_write": np.ones(len(words), np.int64)}, ["tick"])
    core.set("table_write", 0)


def gates(rng, clocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower gates of every clock: legs that switch at random times with dead time, all off now and then."""
    upper, lower = np.zeros(clocks, np.int64), np.zeros(clocks, np.int64)
    for leg in range(3):
        at, level = 0, int(rng.integers(2))
        while at < clocks:
            dead, on = int(rng.integers(1, 400)), int(rng.integers(1, 6000))
            part = slice(at + dead, min(at + dead + on, clocks))
            (upper if level else lower)[part] |= 1 << leg
            at, level = at + dead + on, 1 - level
    off = slice(clocks // 2, clocks // 2 + clocks // 10)
    upper[off] = lower[off] = 0
    return upper, lower


def golden(inputs: dict[str, np.ndarray], registers, tables) -> np.ndarray:
    """What stands at the outputs at each tick, a row a step."""
    steps = len(inputs["u_dc"]) // STEP
    of_step = {name: np.asarray(v[: steps * STEP]).reshape(steps, STEP) for name, v in inputs.items()}
    on = {
        f"{kind}_{x}": np.concatenate([[0], (of_step[f"gate_{kind}"] >> k & 1).sum(axis=1)])
        for kind in ("high", "low")
        for k, x in enumerate("abc")
    }
    state, rows = State(), []
    for n in range(steps):
        x = Inputs(
            **{name: int(of_step[name][n, 0]) for name in ("u_dc", "load", "start")},
            **{name: int(counts[n]) for name, counts in on.items()},
        )
        state, shown = motor_model.step(state, x, registers, tables, STEP)
        rows.append(shown)
    return np.array(rows)


def test_motor_in_verilator():
    """Linear and saturated paths, harmonics, cogging, friction, dead times, all gates off, a second start."""
    skip_without_ghdl5()
    steps, rng = 3000, np.random.default_rng(1)
    scale = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ)
    registers, tables = motor_registers(scale, SERVO, SWITCHES), motor_tables(scale, SERVO)
    core = VerilatedCore({}, top="motor_model")
    core.set_many(registers._asdict())
    write_tables(core, tables)
    core.reset()
    clocks = steps * STEP
    upper, lower = gates(rng, clocks)
    inputs = {
        "gate_high": upper,
        "gate_low": lower,
        "u_dc": np.repeat(scale.u_dc(U_DC_V) + rng.integers(-9999, 9999, steps), STEP),
        "load": np.repeat(rng.integers(-(1 << 20), 1 << 20, steps // 100), 100 * STEP),
        "start": np.repeat((np.arange(steps) // 40 == 60).astype(np.int64), STEP),
    }
    got = core.play(inputs, ["tick", *Shown._fields, "shoot_through"])
    # Row k shows what clock k left: the outputs at a tick are in the row before the clock that has it.
    at_tick = np.flatnonzero(got[:, 0])
    wanted = golden(inputs, registers, tables)
    assert at_tick[0] == STEP - 1 and (np.diff(at_tick) == STEP).all()
    seen = got[at_tick, 1:-1]
    wrong = np.argwhere(seen[STARTING:-1] != wanted[STARTING + 1 : len(seen)])
    assert not len(wrong), f"step {wrong[0][0] + STARTING + 1}: {Shown._fields[wrong[0][1]]} differs"
    assert (np.ptp(wanted[STARTING:], axis=0) > 1000).all(), "an output that hardly moves shows nothing"
    assert not got[:, -1].any()
