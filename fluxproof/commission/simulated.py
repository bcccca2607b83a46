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

from fluxproof.commission.bus import CODES, VALUES, checked
from fluxproof.commission.simulated_edges import COUNTS, HALL, edge_speed, edges_of, hall_code
from fluxproof.cosim.closed_loop import described_sensors
from fluxproof.cosim.golden_loop import mixed_kernel
from fluxproof.plant import (
    FREE,
    IMPOSED_SPEED,
    Inverter,
    Machine,
    Sensors,
    advance_switching,
    centred_gates,
    initial_state,
    plant_params,
    sensor_params,
)
from fluxproof.plant import layout as L
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model import fluxproof
from golden_model.board_registers import board_generics
from golden_model.drive_keys import DriveError
from golden_model.encoders import forced_position
from golden_model.io import board_map
from golden_model.io.fault_latch import NAMES
from golden_model.registers import registers
from golden_model.units import TURN_RAD

PLACES = 1 << forced_position.PLACE_W
SHIFT, PLACE_W = forced_position.SHIFT, forced_position.PLACE_W
SOURCE, ANGLE, RATE, TRAVELLED, LAST_SOURCE, LAST_ANGLE = range(6)  # of ``forced``
REFERENCED, ZERO, LAST_CODE = (
    6,
    7,
    8,
)  # count once at the index; true code at power-up, of the last sample
INPUTS = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "temp_winding", "temp_valid")
FIELDS = fluxproof.Observed._fields
# (place in Observed, bit of the fault flags) of what a sample can trip by
FAULTS = [(FIELDS.index("sample_faults"), 0)]
FAULTS += [
    (FIELDS.index(field), NAMES.index(name))
    for field, name in (
        ("motion_faults", "overspeed"),
        ("open_load", "open_load"),
        ("current_offset", "current_offset"),
    )
    if field in FIELDS
]
FAULT_PLACES, FAULT_BITS = (np.array(column, np.int64) for column in zip(*FAULTS, strict=True))


@dataclass(frozen=True)
class Board:
    """What lies outside the core; ``legs``: the machine's phase at each leg, ``sensed``: the leg that sensor x sees."""

    machine: Machine
    inverter: Inverter = Inverter()
    dead_time_s: float = 0.0
    sensors: Sensors | None = None
    u_dc: float | None = None  # V; nominal if none
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
    return Board(machine, drops, i.dead_time_s, sensors, theta_m=2.0)


@mixed_kernel
def advance(
    state, inputs, flags, forced, usual, config, plant_state, params, sensors, wires, polarity, dead_time_s,
    period_s, u_dc, load, has_index, first, periods, peak, codes, observed, edges,
):  # fmt: skip
    """``periods`` periods; the last sample's codes and values are in ``codes`` and ``observed``.

    ``inputs``: INPUTS; ``flags``: enable, tripped, latched faults; ``wires``: legs, sensed, leg that is open or 3;
    ``peak``: largest phase current [A] so far; ``edges``: see simulated_edges.
    """
    duties = np.zeros(3)
    currents = np.zeros(3)
    for k in range(first, first + periods):
        for leg in range(3):
            currents[leg] = plant_state[L.I_A + wires[leg]]
            peak[0] = max(peak[0], abs(currents[leg]))
        for x in range(3):
            codes[2 + x] = current_code(sensors, x, polarity[x] * currents[wires[3 + x]], k)
        codes[5] = u_dc_code(sensors, u_dc, k)
        code, found, omega = position_code(sensors, plant_state[L.THETA_M], k), False, usual.omega_given
        turns = (sensors.direction * plant_state[L.THETA_M] + sensors.position_offset) / TURN_RAD
        if edges[COUNTS] > 0.0:
            sense = -1 if usual.reverse else 1
            omega = sense * edge_speed(
                edges, turns, sensors.direction * plant_state[L.OMEGA_M] / TURN_RAD, k * period_s
            )
        if edges[HALL] > 0.0:
            code = hall_code(params.machine.pole_pairs, turns, config.position_bits)
        half = 1 << (config.position_bits - 1)
        if forced[REFERENCED] == 0:
            if forced[ZERO] < 0:
                forced[ZERO], forced[LAST_CODE] = code, code
            found = abs(code - forced[LAST_CODE]) > half  # past the index
            forced[LAST_CODE] = code
            if found and has_index:
                forced[REFERENCED] = 1
            else:
                code, found = (code - forced[ZERO]) % (2 * half), False
        codes[0] = code
        jumped = found if forced[SOURCE] == 0 else False
        jumped = jumped or forced[SOURCE] != forced[LAST_SOURCE]
        jumped = jumped or (forced[SOURCE] == 1 and forced[ANGLE] != forced[LAST_ANGLE])
        if forced[SOURCE] == 1:
            forced[TRAVELLED] = forced[TRAVELLED] + forced[RATE] if forced[LAST_SOURCE] == 1 else 0
            place = ((forced[ANGLE] << SHIFT) + forced[TRAVELLED]) % PLACES
            codes[1] = place >> (PLACE_W - config.position_bits)
        else:
            codes[1] = codes[0]
        forced[LAST_SOURCE], forced[LAST_ANGLE] = forced[SOURCE], forced[ANGLE]
        run = 1 if flags[0] == 1 and flags[1] == 0 else 0
        sample = fluxproof.Sample(
            codes[2], codes[3], codes[4], codes[5], codes[1], inputs[0], inputs[1], inputs[2], inputs[3], inputs[4],
            inputs[5], 0, run,
        )  # fmt: skip
        duties[0] = state.compare_a / config.carrier_half
        duties[1] = state.compare_b / config.carrier_half
        duties[2] = state.compare_c / config.carrier_half
        given = 1 if usual.speed_given == 1 and forced[SOURCE] == 0 else 0
        of_speed = fluxproof.Given(given, omega, 1 if jumped else usual.position_restart)
        state, seen = fluxproof.step_given(state, sample, usual, config, of_speed)
        for n, value in enumerate(seen):
            observed[n] = value
        if flags[0] == 1:
            for n in range(len(FAULT_PLACES)):
                flags[2] |= observed[FAULT_PLACES[n]] << FAULT_BITS[n]
            if flags[2] & ~usual.fault_ignore:
                flags[1] = 1
        times, words = centred_gates(duties, dead_time_s, period_s)
        for n in range(len(words)):
            word = 0
            for leg in range(3):
                if run == 1 and leg != wires[6]:
                    word |= ((words[n] >> leg) & 1) << wires[leg]
                    word |= ((words[n] >> (leg + 3)) & 1) << (wires[leg] + 3)
            words[n] = word
        advance_switching(plant_state, params, times, words, u_dc, load, period_s, -1.0)
    return state


class SimulatedBus:
    """A Bus; ``peak_a`` is the largest true phase current at a sample so far, ``seconds`` the drive's time."""

    def __init__(self, drive, board: Board):
        drive = replace(drive, core=replace(drive.core, updates_per_period=1))
        self.board, self.drive = board, drive
        self._config = registers(drive).config
        self._values = {name: register.reset for name, register in board.registers.items() if register.fields}
        self._values |= {"clock_hz": round(drive.core.clock_hz), **self._config._asdict(), **board_generics(drive)}
        mode = IMPOSED_SPEED if board.locked else FREE
        self._params = plant_params(board.machine, board.inverter, mode=mode)
        self._plant = initial_state(board.machine, self._params, theta_m=board.theta_m)
        self._sensors = sensor_params(board.sensors or described_sensors(drive))
        open_leg = 3 if board.open_leg is None else board.open_leg
        self._wires = np.array([*board.legs, *board.sensed, open_leg], np.int64)
        self._polarity = np.array(board.polarity, float)
        self._u_dc = float(drive.inverter.dc_bus_v if board.u_dc is None else board.u_dc)
        self._state, self._random = fluxproof.State(), np.random.default_rng(board.seed)
        self._forced, self._flags = np.zeros(9, np.int64), np.zeros(3, np.int64)
        self._forced[REFERENCED:] = drive.encoder.kind != "abz", -1, 0
        self._codes, self._edges = np.zeros(6, np.int64), edges_of(drive)
        self._observed = np.zeros(len(FIELDS), np.int64)
        self._peak, self._done, self._due = np.zeros(1), 0, 0.0
        self._settings = None

    @property
    def seconds(self) -> float:
        return self._done * self.drive.sample_time_s

    @property
    def peak_a(self) -> float:
        return float(self._peak[0])

    @property
    def true_theta_m(self) -> float:
        return float(self._plant[L.THETA_M])

    def read(self, name: str) -> int:
        if name in FIELDS:
            return int(self._observed[FIELDS.index(name)])
        if name in ("fault_flags", "first_fault"):
            return int(self._flags[2])
        if name == "encoder_flags":
            return int(self._forced[REFERENCED])
        if name == "flags":
            return int(self._flags[0] and not self._flags[1]) + 2 * int(self._flags[1])
        if name in CODES:
            return int(self._codes[CODES.index(name)])
        return self._values[name]

    def write(self, name: str, value: int) -> None:
        checked(self.board.registers, name, value)
        if name == "clear_trip":
            self._flags[1:] = 0
            return
        self._values[name] = value
        if name == "enable":
            self._flags[0] = value
        self._forced[:3] = [self._values[n] for n in ("position_source", "forced_angle", "forced_rate")]
        self._settings = None

    def snapshot(self) -> dict[str, int]:
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
            usual = fluxproof.Registers(*(self._values[n] for n in fluxproof.Registers._fields))
            self._settings = usual
            self._inputs = np.array([self._values[n] for n in INPUTS], np.int64)
        self._state = advance(
            self._state, self._inputs, self._flags, self._forced, self._settings, self._config, self._plant,
            self._params, self._sensors, self._wires, self._polarity, float(self.board.dead_time_s),
            self.drive.sample_time_s, self._u_dc, 0.0, self.board.has_index, self._done, periods, self._peak,
            self._codes, self._observed, self._edges,
        )  # fmt: skip
        self._done += periods
