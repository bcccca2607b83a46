# SPDX-License-Identifier: BSD-3-Clause
"""The registers of fluxproof_board in front of the golden core, the switching plant and imperfect sensors.

Period by period as in cosim/golden_loop.  A write of a setting acts from the next sample on, a snapshot is that of a
sample some periods later, and what a host does takes time: snapshots are no consecutive samples.  A fault of a sample
turns the gates off until ``clear_trip``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from fluxproof.commission.bus import CODES, RUNNING, VALUES, checked
from fluxproof.commission.simulated_loop import FIELDS, INPUTS, LAST_ANGLE, REFERENCED, Around, Memory, advance
from fluxproof.cosim.driven_plant import bus_of, described_sensors
from fluxproof.cosim.sensor_edges import edges_of
from fluxproof.plant import (
    FREE,
    IMPOSED_SPEED,
    Bus,
    Inverter,
    Machine,
    Sensors,
    initial_state,
    plant_params,
    sensor_params,
)
from fluxproof.plant import layout as L
from golden_model import fluxproof
from golden_model.board_registers import board_generics
from golden_model.drive_keys import DriveError
from golden_model.io import board_map
from golden_model.io.fault_latch import NAMES
from golden_model.registers import registers

HOST_LOST = NAMES.index("host_lost")


@dataclass(frozen=True)
class Board:
    """What lies outside the core; ``legs``: the machine's phase at each leg, ``sensed``: the leg that sensor x sees."""

    machine: Machine
    inverter: Inverter = Inverter()
    dead_time_s: float = 0.0
    sensors: Sensors | None = None
    u_dc: float | None = None  # V of the supply; nominal if none
    bus: Bus = Bus()  # what is between it and the inverter; by default nothing
    legs: tuple[int, int, int] = (0, 1, 2)
    sensed: tuple[int, int, int] = (0, 1, 2)
    polarity: tuple[float, float, float] = (1.0, 1.0, 1.0)
    open_leg: int | None = None
    locked: bool = False
    has_index: bool = True  # an incremental encoder counts from anywhere until it has passed its index
    theta_m: float = 0.0  # rad, at the start
    seed: int = 0
    host_periods: tuple[int, int] = (1, 4)  # a snapshot comes after so many, at random
    registers: dict = field(default_factory=board_map.registers)


def board_of(drive) -> Board:
    """What a drive file describes, with sensors as they come: offsets, noise, an encoder mounted anyhow.

    The encoder counts as [sensors] position_reverse says; offsets are 1, -2 and 0.5 % of the range, noise 0.03 %.
    """
    i, span = drive.inverter, drive.sensors.current_range_a
    sensors = replace(
        described_sensors(drive),
        current_offset_a=(0.01 * span, -0.02 * span, 0.005 * span),
        current_noise_a=3e-4 * span,
        position_offset_rad=1.0,
        position_direction=-1 if drive.sensors.position_reverse else 1,
    )
    machine = Machine.from_mapping(vars(drive.machine))
    if machine.inertia_kgm2 <= 0.0:
        raise DriveError("[machine] inertia_kgm2 is missing: the simulated shaft needs one")
    drops = Inverter(0.0, i.v_switch_v, i.v_diode_v, i.r_switch_ohm, i.r_diode_ohm)
    return Board(machine, drops, i.dead_time_s, sensors, bus=bus_of(drive), theta_m=2.0)


class SimulatedBus:
    """A Bus; ``peak_a`` is the largest true phase current at a sample so far, ``seconds`` the drive's time."""

    def __init__(self, drive, board: Board):
        drive = replace(drive, core=replace(drive.core, updates_per_period=1))
        self.board, self.drive = board, drive
        self._config = registers(drive).config
        self._values = {name: register.reset for name, register in board.registers.items() if register.fields}
        self._values |= {"clock_hz": round(drive.core.clock_hz), **self._config._asdict(), **board_generics(drive)}
        source_v = float(drive.inverter.dc_bus_v if board.u_dc is None else board.u_dc)
        mode = IMPOSED_SPEED if board.locked else FREE
        params = plant_params(board.machine, board.inverter, mode=mode)
        self._around = Around(
            config=self._config,
            params=params,
            sensors=sensor_params(board.sensors or described_sensors(drive)),
            legs=np.array(board.legs, np.int64),
            sensed=np.array(board.sensed, np.int64),
            polarity=np.array(board.polarity, float),
            open_leg=3 if board.open_leg is None else board.open_leg,
            dead_time_s=float(board.dead_time_s),
            period_s=drive.sample_time_s,
            source_v=source_v,
            bus=board.bus,
            has_index=board.has_index,
            passes=drive.encoder.index_passes,
        )
        self._memory = Memory(
            plant=initial_state(board.machine, params, theta_m=board.theta_m),
            flags=np.zeros(3, np.int64),
            forced=np.zeros(LAST_ANGLE + 1, np.int64),
            counting=np.array([drive.encoder.kind != "abz", -1, 0, 0], np.int64),
            edges=edges_of(drive),
            codes=np.zeros(len(CODES), np.int64),
            observed=np.zeros(len(FIELDS), np.int64),
            held=np.zeros(2),
            peak=np.zeros(1),
            u_dc=np.array([source_v]),
        )
        self._state, self._random = fluxproof.State(), np.random.default_rng(board.seed)
        self._done, self._due, self._settings = 0, 0.0, None
        self._written = 0  # period of the last write

    @property
    def seconds(self) -> float:
        return self._done * self.drive.sample_time_s

    @property
    def peak_a(self) -> float:
        return float(self._memory.peak[0])

    @property
    def true_theta_m(self) -> float:
        return float(self._memory.plant[L.THETA_M])

    def lose_encoder(self) -> None:
        """From now on the encoder stands where it is, whatever the shaft does."""
        self._memory.held[:] = 1.0, self.true_theta_m

    def read(self, name: str) -> int:
        now = self._memory
        if name in FIELDS:
            return int(now.observed[FIELDS.index(name)])
        if name in ("fault_flags", "first_fault"):
            return int(now.flags[2])
        if name == "encoder_flags":
            return int(now.counting[REFERENCED])
        if name == "flags":
            return int(now.flags[0] and not now.flags[1]) + 2 * int(now.flags[1])
        if name in CODES:
            return int(now.codes[CODES.index(name)])
        return self._values[name]

    def write(self, name: str, value: int) -> None:
        checked(self.board.registers, name, value, lambda: bool(self.read("flags") & RUNNING))
        self._written = self._done
        if name == "clear_trip":
            self._memory.flags[1:] = 0
            return
        self._values[name] = value
        if name == "enable":
            self._memory.flags[0] = value
        self._memory.forced[:3] = [self._values[n] for n in ("position_source", "forced_angle", "forced_rate")]
        self._settings = None

    def snapshot(self) -> dict[str, int]:
        self._written = self._done  # take_snapshot
        self._run(int(self._random.integers(*self.board.host_periods)) + 1)
        return {name: self.read(name) for name in (*CODES, *VALUES, "theta_me")}

    def wait(self, seconds: float) -> None:
        self._due += seconds / self.drive.sample_time_s
        whole = math.floor(self._due)
        self._due -= whole
        self._run(whole)

    def now(self) -> float:
        return self.seconds

    def _run(self, periods: int) -> None:
        if self._settings is None:
            usual = fluxproof.Registers(**{n: self._values[n] for n in fluxproof.Registers._fields})
            self._settings = usual
            self._inputs = np.array([self._values[n] for n in INPUTS], np.int64)
        self._state = advance(
            self._state, self._inputs, self._settings, self._around, self._memory, self._done, periods
        )
        self._done += periods
        heartbeat, flags = self._values["heartbeat"], self._memory.flags
        if flags[0] and 0 < heartbeat <= self._done - self._written:
            flags[2] |= 1 << HOST_LOST
            flags[1] = 1
