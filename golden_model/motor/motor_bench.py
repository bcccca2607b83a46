# SPDX-License-Identifier: BSD-3-Clause
"""The motor with its bus as they are wired in rtl/motor/motor_bench.vhd, a step of STEP clocks at a time.

The bus voltage that stands at a tick holds for the step that begins, also for the sensors; while the motor starts it
is that of the source.  The charge of the step that ends, by the currents that stood at its tick, and the brake
resistor at this tick change the voltage of the next one.
A sample before the start is over has neither currents nor an angle.
The sensors' filter takes the currents that stand at a tick; its outputs are there FILTERED_AT clocks later.
The temperatures take the same currents; hot resistances act from the next step on, the hot magnet flux in this one.
"""

from typing import NamedTuple

from golden_model.kernel import kernel
from golden_model.motor import motor_bus, motor_charge, motor_filter, motor_heat, motor_model

bus_step, of_step, motor_step = motor_bus.step, motor_charge.of_step, motor_model.step
filter_step, heat_step, hot_of, WINDOW_BITS = motor_filter.step, motor_heat.step, motor_heat.hot, motor_heat.WINDOW_BITS
MotorRegisters, HeatInputs, HeatRegisters = motor_model.Registers, motor_heat.Inputs, motor_heat.Registers
Inputs, DROP_U, STEP = motor_model.Inputs, motor_bus.DROP_U, motor_model.STEP
FILTERED_AT = 2 + motor_filter.BLOCK.latency


class State(NamedTuple):
    motor: motor_model.State = motor_model.State()
    bus: motor_bus.State = motor_bus.State()
    u_dc: int = 0  # since the last tick
    u_dc_1: int = 0  # in the step before
    filter: motor_filter.State = motor_filter.State()
    filtered: tuple = (0,) * 3  # phases a, b, c
    filtered_1: tuple = (0,) * 3  # of the step before
    heat: motor_heat.State = motor_heat.State()
    starting_1: int = motor_model.STARTING  # before the last tick


@kernel
def step(state, inputs, brake, regs, of_bus, k_filter, of_heat, tables, clocks):
    """One step: (state, what stands at the motor's outputs at its tick); ``inputs.u_dc`` is that of the source."""
    x, before = inputs, state.motor.chain_4
    start = 1 if x.start or state.motor.starting > 0 else 0
    u_dc = x.u_dc if start else state.bus.u >> DROP_U
    charge = (
        of_step(x.high_a, x.low_a, before.i_a, clocks)
        + of_step(x.high_b, x.low_b, before.i_b, clocks)
        + of_step(x.high_c, x.low_c, before.i_c, clocks)
    )
    bus, _ = bus_step(
        state.bus, charge, x.u_dc, brake, start, of_bus.inv_c, of_bus.k_source, of_bus.k_brake, of_bus.rectifier
    )
    now = Inputs(u_dc, x.load, x.start, x.high_a, x.low_a, x.high_b, x.low_b, x.high_c, x.low_c)
    r, h, seen = regs, of_heat, state.motor.chain_3
    cold = HeatRegisters(
        r.r_a, r.r_b, r.r_c, r.psi_m, h.ambient, h.t_ref, h.heating, h.k_winding, h.k_magnet, h.tcr_winding,
        h.tcr_magnet,
    )  # fmt: skip
    r_a, r_b, r_c, _ = hot_of(state.heat, cold)
    heat, _ = heat_step(state.heat, HeatInputs(seen.i_a, seen.i_b, seen.i_c, start), cold, WINDOW_BITS)
    _, _, _, psi_m = hot_of(heat, cold)
    warm = MotorRegisters(
        r.stiffness, r.v_switch, r.v_diode, r_a, r_b, r_c, r.psi_start, psi_m, r.inv_l_d, r.inv_l_q, r.k_j,
        r.viscous, r.coulomb, r.pole_pairs, r.hold, r.omega_set,
    )  # fmt: skip
    motor, shown = motor_step(state.motor, now, warm, tables, clocks)
    of_filter, filtered = state.filter, state.filtered
    if motor.starting == 0:  # before, no currents stand at the outputs
        of_filter, filtered = filter_step(state.filter, shown.i_a, shown.i_b, shown.i_c, k_filter)
    starting = state.motor.starting
    return State(motor, bus, u_dc, state.u_dc, of_filter, filtered, state.filtered, heat, starting), shown


@kernel
def sampled(state, chain, theta, clock, k_filter):
    """(i_a, i_b, i_c, u_dc, theta_m) held by a trigger; ``chain``, ``theta``: what stands at the motor's outputs."""
    at_tick = clock % STEP == 0  # whose step acts a clock later
    u_dc = state.u_dc_1 if at_tick else state.u_dc
    if (state.starting_1 if at_tick else state.motor.starting) > 0:
        return 0, 0, 0, u_dc, 0
    i_a, i_b, i_c = chain.i_a, chain.i_b, chain.i_c
    if k_filter > 0:
        i_a, i_b, i_c = state.filtered if clock % STEP >= FILTERED_AT else state.filtered_1
    return i_a, i_b, i_c, u_dc, theta
