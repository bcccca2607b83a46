# SPDX-License-Identifier: BSD-3-Clause
"""The periods of a simulated drive, compiled: converters, encoder, golden core, gates and switching plant in turn."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fluxproof.cosim.golden_loop import mixed_kernel
from fluxproof.cosim.sensor_edges import COUNTS, HALL, Edges, edge_speed, hall_code
from fluxproof.plant import Bus, advance_bus, advance_switching, centred_gates
from fluxproof.plant import layout as L
from fluxproof.plant.sensors import current_code, position_code, sensed_angle, u_dc_code
from golden_model import fluxproof
from golden_model.encoders import forced_position
from golden_model.io.fault_latch import NAMES, TRIP
from golden_model.kernel import kernel
from golden_model.units import TURN_RAD

PLACES = 1 << forced_position.PLACE_W
SHIFT, PLACE_W = forced_position.SHIFT, forced_position.PLACE_W
SOURCE, ANGLE, RATE, TRAVELLED, LAST_SOURCE, LAST_ANGLE = range(6)  # of ``forced``
# Of ``counting``: the index is believed; true code at power-up, of the last sample; passes of the index so far
REFERENCED, ZERO, LAST_CODE, PASSES = range(4)
INPUTS = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "temp_winding", "temp_valid")
FIELDS = fluxproof.Observed._fields
# (place in Observed, bit of the fault flags) of what a sample can trip by
FAULTS = [(FIELDS.index("sample_faults"), 0)]
FAULTS += [
    (FIELDS.index(field), NAMES.index(name))
    for field, name in (
        ("motion_faults", "overspeed"),
        ("open_load", "open_load"),
        ("encoder_lost", "encoder_lost"),
        ("current_offset", "current_offset"),
    )
    if field in FIELDS
]
FAULT_PLACES, FAULT_BITS = (np.array(column, np.int64) for column in zip(*FAULTS, strict=True))


class Around(NamedTuple):
    """What lies around the core and does not change."""

    config: fluxproof.Config
    params: Any  # of plant_params()
    sensors: Any  # of sensor_params()
    legs: np.ndarray  # (3,) the machine's phase at each leg
    sensed: np.ndarray  # (3,) the leg that sensor x sees
    polarity: np.ndarray  # (3,) of the sensors, 1 or -1
    open_leg: int  # 3: none
    dead_time_s: float  # s
    period_s: float  # s
    source_v: float  # V, of the supply
    bus: Bus  # what is between the supply and the inverter
    has_index: bool
    passes: int  # of the index until it is believed


class Memory(NamedTuple):
    """Arrays that change in place."""

    plant: np.ndarray  # as plant/layout.py
    flags: np.ndarray  # (3,) enable, tripped, latched faults
    forced: np.ndarray  # (6,) SOURCE to LAST_ANGLE
    counting: np.ndarray  # (4,) REFERENCED to PASSES
    edges: Edges  # of its encoder
    codes: np.ndarray  # (6,) CODES of the last sample
    observed: np.ndarray  # (len(FIELDS),) its values
    held: np.ndarray  # (2,) 1: the encoder does not move any more; mechanical rad at which it stands
    peak: np.ndarray  # (1,) A, the largest phase current so far
    u_dc: np.ndarray  # (1,) V, of the bus


@kernel
def counted(counting, code, turn, has_index, passes):
    """(the code of an encoder that counts from where it was powered up until its index, 1 where it finds the index).

    ``turn``: codes of a turn; ``passes`` of the index until it is believed.
    """
    if counting[REFERENCED] == 1:
        return code, 0
    if counting[ZERO] < 0:
        counting[ZERO], counting[LAST_CODE] = code, code
    found = abs(code - counting[LAST_CODE]) > turn >> 1
    counting[LAST_CODE] = code
    if found and has_index:
        counting[PASSES] += 1
        if counting[PASSES] >= passes:
            counting[REFERENCED] = 1
            return code, 1
    return (code - counting[ZERO]) % turn, 0


@kernel
def forced_code(forced, code, found, position_bits):
    """(the code that the core takes, 1 where it has nothing to do with the last one), as encoders/forced_position."""
    jumped = forced[SOURCE] != forced[LAST_SOURCE] or (found == 1 and forced[SOURCE] == 0)
    if forced[SOURCE] == 1:
        jumped = jumped or forced[ANGLE] != forced[LAST_ANGLE]
        forced[TRAVELLED] = forced[TRAVELLED] + forced[RATE] if forced[LAST_SOURCE] == 1 else 0
        code = ((forced[ANGLE] << SHIFT) + forced[TRAVELLED]) % PLACES >> (PLACE_W - position_bits)
    forced[LAST_SOURCE], forced[LAST_ANGLE] = forced[SOURCE], forced[ANGLE]
    return code, 1 if jumped else 0


@mixed_kernel
def encoder(around, memory, usual, k):
    """(code, 1 where the count finds its index, omega_given) of the encoder at sample ``k``."""
    a, plant, edges, bits = around, memory.plant, memory.edges, around.config.position_bits
    lost = memory.held[0] == 1.0
    theta_m, omega_m = (memory.held[1], 0.0) if lost else (plant[L.THETA_M], plant[L.OMEGA_M])
    code, omega = position_code(a.sensors, theta_m, k), usual.omega_given
    turns = sensed_angle(a.sensors, theta_m) / TURN_RAD
    turns_per_s = a.sensors.direction * omega_m / TURN_RAD
    if edges.speed[COUNTS] > 0.0:
        omega = (-1 if usual.reverse else 1) * edge_speed(edges, turns, turns_per_s, k * a.period_s)
    if edges.speed[HALL] > 0.0:
        code = hall_code(edges, turns, turns_per_s, k * a.period_s, bits)
    code, found = counted(memory.counting, code, 1 << bits, a.has_index, a.passes)
    return code, found, omega


@mixed_kernel
def convert(around, memory, k):
    """The converters' codes of sample ``k``."""
    a, currents = around, np.zeros(3)
    for leg in range(3):
        currents[leg] = memory.plant[L.I_A + a.legs[leg]]
        memory.peak[0] = max(memory.peak[0], abs(currents[leg]))
    for x in range(3):
        memory.codes[2 + x] = current_code(a.sensors, x, a.polarity[x] * currents[a.sensed[x]], k)
    memory.codes[5] = u_dc_code(a.sensors, memory.u_dc[0], k)


@kernel
def latch_faults(flags, observed, fault_ignore):
    """Faults of an enabled sample; one that is not ignored turns the gates off."""
    for n in range(len(FAULT_PLACES)):
        flags[2] |= observed[FAULT_PLACES[n]] << FAULT_BITS[n]
    if flags[2] & ~fault_ignore:
        flags[1] = 1


@kernel
def at_the_legs(words, legs, open_leg, run):
    """Gate words in place: the core's legs at the machine's phases, none where a leg is open or the gates are off."""
    for n in range(len(words)):
        word = 0
        for leg in range(3):
            if run == 1 and leg != open_leg:
                word |= ((words[n] >> leg) & 1) << legs[leg]
                word |= ((words[n] >> (leg + 3)) & 1) << (legs[leg] + 3)
        words[n] = word


@mixed_kernel
def advance(state, inputs, usual, around, memory, first, periods):
    """``periods`` periods from number ``first`` on; returns the core's state.

    ``inputs`` (6,): INPUTS; ``usual``: fluxproof.Registers; ``around``: Around, ``memory``: Memory.
    """
    a, m, config = around, memory, around.config
    duties = np.zeros(3)
    for k in range(first, first + periods):
        convert(a, m, k)
        m.codes[0], found, omega = encoder(a, m, usual, k)
        m.codes[1], jumped = forced_code(m.forced, m.codes[0], found, config.position_bits)
        run = 1 if m.flags[0] == 1 and m.flags[1] == 0 else 0
        sample = fluxproof.Sample(
            adc_a=m.codes[2],
            adc_b=m.codes[3],
            adc_c=m.codes[4],
            adc_u_dc=m.codes[5],
            position_code=m.codes[1],
            omega_ref=inputs[0],
            i_d_ref=inputs[1],
            i_q_ext=inputs[2],
            speed_mode=inputs[3],
            temp_winding=inputs[4],
            temp_valid=inputs[5],
            clear_faults=0,
            run=run,
        )
        duties[0] = state.compare_a / config.carrier_half
        duties[1] = state.compare_b / config.carrier_half
        duties[2] = state.compare_c / config.carrier_half
        emf_samples = usual.emf_samples if m.forced[SOURCE] == 0 else 0
        of_speed = fluxproof.Given(
            speed_given=1 if usual.speed_given == 1 and m.forced[SOURCE] == 0 else 0,
            omega_given=omega,
            position_restart=1 if jumped else usual.position_restart,
            emf_samples=emf_samples,
            gear_code=usual.gear_code,
        )
        state, seen = fluxproof.step_given(state, sample, usual, config, of_speed)
        for n, value in enumerate(seen):
            m.observed[n] = value
        if m.flags[0] == 1 and m.forced[SOURCE] == 0 and m.counting[REFERENCED] == 0:
            m.flags[1], m.flags[2] = 1, m.flags[2] | 1 << TRIP  # no_index of board_faults
        if m.flags[0] == 1:
            latch_faults(m.flags, m.observed, usual.fault_ignore)
        times, words = centred_gates(duties, a.dead_time_s, a.period_s)
        at_the_legs(words, a.legs, a.open_leg, run)
        advance_switching(m.plant, a.params, times, words, m.u_dc[0], 0.0, a.period_s, -1.0)
        brake = state.of_brake_chopper.brake
        m.u_dc[0] = advance_bus(m.u_dc[0], a.bus, a.source_v, m.plant[L.P_IN], brake, a.period_s)
    return state
