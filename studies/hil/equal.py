# SPDX-License-Identifier: BSD-3-Clause
"""The RTL of the motor in Verilator against its golden model, every output at every step, with gates of every kind."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.hil.registers import motor_registers, motor_tables
from golden_model.motor import motor_model
from golden_model.motor.motor_model import STARTING, STEP, Inputs, Registers, Shown, State, Tables
from studies.hil.drive import U_DC_V, servo
from studies.hil.figure import least, most

HALF_WORD = 1 << 18
STEPS = 100_000


@dataclass(frozen=True)
class Compared:
    """Outputs at every tick, a row a step: of the RTL and of the model; from the first row that both know."""

    rtl: np.ndarray
    golden: np.ndarray
    shoot_through: np.ndarray

    @property
    def wrong(self) -> np.ndarray:
        """(step, output) of each difference."""
        return np.argwhere(self.rtl != self.golden)


def write_tables(core: VerilatedCore, tables: Tables, prefix: str = "") -> None:
    """All words of the tables through the motor's port, whose names begin with ``prefix``."""
    words = [
        *((0, 64 * r + c, tables.map_d[r, c], tables.map_q[r, c]) for r in range(64) for c in range(64)),
        *((1, k, tables.wave_d[k], tables.wave_q[k]) for k in range(len(tables.wave_d))),
        *((2, k, 0, tables.cogging[k]) for k in range(len(tables.cogging))),
    ]
    columns = np.array([(s, at, (int(d) % HALF_WORD) << 18 | int(q) % HALF_WORD) for s, at, d, q in words], np.int64).T
    names = [f"{prefix}{name}" for name in ("table_select", "table_at", "table_word")]
    write = f"{prefix}table_write"
    core.play(dict(zip(names, columns, strict=True)) | {write: np.ones(len(words), np.int64)}, [core.outputs[0]])
    core.set(write, 0)


def gates(rng: np.random.Generator, clocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower gates of every clock: legs that switch at random with dead time, all off for a tenth."""
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


def golden(inputs: dict[str, np.ndarray], registers: Registers, tables: Tables) -> np.ndarray:
    """What stands at the outputs at each tick, a row a step."""
    steps = len(inputs["u_dc"]) // STEP
    of_step = {name: values.reshape(steps, STEP) for name, values in inputs.items()}
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


def compare(steps: int, seed: int = 1) -> Compared:
    """Dead times, all gates off, a bus and loads that move, a second start in the middle."""
    drive, rng = servo(), np.random.default_rng(seed)
    machine = replace(drive.machine, inertia_kgm2=drive.machine.inertia_kgm2 / 10)  # a shaft that turns in a few ms
    registers, tables = motor_registers(drive.scale, machine, drive.inverter), motor_tables(drive.scale, machine)
    core = VerilatedCore({}, top="motor_model")
    core.set_many(registers._asdict())
    write_tables(core, tables)
    core.reset()
    upper, lower = gates(rng, steps * STEP)
    inputs = {
        "gate_high": upper,
        "gate_low": lower,
        "u_dc": np.repeat(drive.scale.u_dc(U_DC_V) + rng.integers(-9999, 9999, steps), STEP),
        "load": np.repeat(rng.integers(-(1 << 20), 1 << 20, steps // 100), 100 * STEP),
        "start": np.repeat((np.arange(steps) // 40 == steps // 50).astype(np.int64), STEP),
    }
    got = core.play(inputs, ["tick", *Shown._fields, "shoot_through"])
    # Row k is what clock k left: the outputs at a tick are in the row before the clock that has it.
    at_tick = np.flatnonzero(got[:, 0])
    assert (at_tick == STEP - 1 + STEP * np.arange(len(at_tick))).all(), "ticks are not STEP clocks apart"
    wanted = golden(inputs, registers, tables)
    return Compared(got[at_tick[STARTING:-1], 1:-1], wanted[STARTING + 1 : len(at_tick)], got[:, -1])


def figures(_options) -> list[dict]:
    done = compare(STEPS)
    return [
        least("steps of the RTL compared with the golden model", len(done.rtl), STEPS - 2 * STARTING, "steps"),
        most("differences of the RTL from the golden model", len(done.wrong), 0, "differences"),
    ]
