# SPDX-License-Identifier: BSD-3-Clause
"""Registers and tables of the motor in the FPGA from the data of machine and inverter; docs/hil.md derives them.

scale = motor_scale(machine, u_dc_v, current_a, clock_hz)
registers, tables = motor_registers(scale, machine, inverter), motor_tables(scale, machine)
bus_registers(scale, bus)                            of the bus; the source's voltage is scale.u_dc(volts)
filter_register(scale, time_constant_s)              of the filter of the current sensors
heat_registers(scale, machine, thermal)              of the temperatures
machine_of(scale, registers, machine, inverter)      what the rounded registers say, in SI units
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fluxproof.plant.bus import Bus
from fluxproof.plant.inverter import Inverter
from fluxproof.plant.pmsm import SATURATED, Machine, currents_from_flux, harmonic_flux, machine_params
from golden_model.fixed import Format
from golden_model.formats import FLUX, MOTOR_SPEED, MOTOR_VOLTAGE, MOTOR_WAVE
from golden_model.motor import motor_bus, motor_filter, motor_heat, motor_model
from golden_model.motor.motor_angle import POINTS
from golden_model.motor.motor_current import POINT
from golden_model.motor.motor_flux import CLOCKS_BITS
from golden_model.motor.motor_model import STEP, Registers, Tables

PORTS = {p.name: p for p in motor_model.REGISTERS}
ROOM = 1.5  # largest flux and voltage per unit: the formats end at 2
# Loop gain of a leg's stiffness: i(n + 1) = i(n) - RINGING*i(n - 3) decays to 0.89 in a step.  27/256 would just not
# overshoot, 2*sin(pi/14) = 0.445 would not decay; what is left of a blocked current goes with its inverse.
RINGING = 1 / 4
MAP = 64  # points of the map along each axis, a 32nd of the current's base apart


@dataclass(frozen=True)
class Scale:
    """What 1.0 means in the motor's formats, and its time."""

    clock_hz: float
    current_a: float
    flux_wb: float
    voltage_v: float
    torque_nm: float

    @property
    def step_s(self) -> float:
        return STEP / self.clock_hz

    def u_dc(self, volts: float) -> int:
        """Code of a bus voltage."""
        return code("u_dc", volts / self.voltage_v, MOTOR_VOLTAGE)

    def load(self, torque_nm: float) -> int:
        """Code of a load torque."""
        return code("load", torque_nm / self.torque_nm, FLUX)

    def speed_rad_s(self, omega_m):
        """Mechanical speed of a code."""
        return omega_m * MOTOR_SPEED.lsb * 2 * math.pi / self.step_s


@dataclass(frozen=True)
class Thermal:
    """Bodies of the winding and, behind it, of the magnets: first order each."""

    winding_j_per_k: float
    winding_s: float  # time constant to the ambient
    magnet_s: float  # time constant to the winding
    share: float = 1.0  # of the copper loss that warms the winding
    ambient_c: float = 20.0


def code(name: str, value: float, fmt: Format) -> int:
    """The integer of a value; ValueError where its format ends before it."""
    number = math.floor(value / fmt.lsb + 0.5)
    if not fmt.lo <= number <= fmt.hi:
        raise ValueError(f"motor: {name} = {value:.6g} per unit does not fit {fmt}, up to {fmt.hi * fmt.lsb:.6g}")
    return number


def motor_scale(machine: Machine, u_dc_v: float, current_a: float, clock_hz: float) -> Scale:
    """Bases: the current is given; flux and voltage are tied by the clock, and neither exceeds ROOM."""
    seconds = 2.0**CLOCKS_BITS / clock_hz / 3
    most = abs(machine.magnet_flux_wb) + max(machine.inductance_d_h, machine.inductance_q_h) * current_a
    flux = max(most, u_dc_v * seconds) / ROOM
    return Scale(clock_hz, current_a, flux, flux / seconds, 1.5 * machine.pole_pairs * flux * current_a)


def motor_registers(
    scale: Scale, machine: Machine, inverter: Inverter, omega_set_rad_s: float | None = None
) -> Registers:
    """Registers; ValueError where a value does not fit.  ``omega_set_rad_s``: held speed, None: the shaft is free."""
    ohm = scale.voltage_v / scale.current_a
    turn = 2 * math.pi / scale.step_s  # rad/s of a turn a step
    slope = (inverter.r_switch_ohm + inverter.r_diode_ohm) / 2
    phases = machine.resistance_ohm * (1.0 + np.asarray(machine.phase_resistance_asymmetry, float)) + slope
    smallest = min(machine.inductance_d_h, machine.inductance_q_h)
    values = {
        "stiffness": 1.5 * RINGING * smallest / scale.step_s / ohm,
        "v_switch": inverter.v_switch_v / scale.voltage_v,
        "v_diode": inverter.v_diode_v / scale.voltage_v,
        **{f"r_{x}": r / ohm * STEP for x, r in zip("abc", phases, strict=True)},
        "psi_start": machine.magnet_flux_wb / scale.flux_wb,
        "psi_m": machine.magnet_flux_wb / scale.flux_wb,
        "inv_l_d": scale.flux_wb / machine.inductance_d_h / scale.current_a,
        "inv_l_q": scale.flux_wb / machine.inductance_q_h / scale.current_a,
        "k_j": scale.torque_nm / machine.inertia_kgm2 * scale.step_s / turn,
        "viscous": machine.viscous_friction_nms * turn / scale.torque_nm,
        "coulomb": machine.coulomb_friction_nm / scale.torque_nm,
        "pole_pairs": machine.pole_pairs,
        "hold": int(omega_set_rad_s is not None),
        "omega_set": (omega_set_rad_s or 0.0) / turn,
    }
    limit = PORTS["stiffness"].fmt
    values["stiffness"] = min(values["stiffness"], limit.hi * limit.lsb)  # a softer snubber does no harm
    return Registers(**{name: code(name, values[name], port.fmt) for name, port in PORTS.items()})


def bus_registers(scale: Scale, bus: Bus) -> motor_bus.Registers:
    """Registers of the bus; ValueError where a value does not fit.  Without a capacitor the bus is its source.

    A source without resistance has the smallest that fits: a time constant R C of 64 steps.
    """
    ports = {p.name: p.fmt for p in motor_bus.REGISTERS}
    if bus.capacitance <= 0.0:
        return motor_bus.Registers(0, 0, 0, 0)
    stiff = ports["k_source"].hi * ports["k_source"].lsb
    share = scale.step_s / bus.capacitance
    return motor_bus.Registers(
        inv_c=max(code("inv_c", share / STEP * scale.current_a / scale.voltage_v, ports["inv_c"]), 1),
        k_source=code("k_source", share / bus.source_ohm if bus.source_ohm > 0.0 else stiff, ports["k_source"]),
        k_brake=code("k_brake", share / bus.brake_ohm, ports["k_brake"]),
        rectifier=int(bus.diode),
    )


def filter_register(scale: Scale, time_constant_s: float) -> int:
    """Register of the current sensors' filter; 0: none.  ValueError for a time constant that rounds to none."""
    if time_constant_s == 0.0:
        return 0
    share = code("k_filter", -math.expm1(-scale.step_s / time_constant_s), motor_filter.SHARE)
    if share == 0:
        raise ValueError(f"motor: k_filter: {time_constant_s:.6g} s is beyond {scale.step_s * motor_filter.MOST:.3g} s")
    return share


def heat_registers(scale: Scale, machine: Machine, thermal: Thermal | None = None) -> motor_heat.Own:
    """Registers of the temperatures; ValueError where a value does not fit.

    Without thermal bodies nothing depends on a temperature.
    """
    ports = {p.name: p.fmt for p in motor_heat.OWN}
    window_s = scale.step_s * 2.0**motor_heat.WINDOW_BITS
    values = dict.fromkeys(motor_heat.Own._fields, 0.0)
    if thermal is not None:
        watts = thermal.share * machine.resistance_ohm * scale.current_a**2  # per square of a phase current
        values |= {
            "ambient": thermal.ambient_c,
            "t_ref": machine.temperature_ref_c,
            "heating": watts * scale.step_s / thermal.winding_j_per_k,
            "k_winding": window_s / thermal.winding_s,
            "k_magnet": window_s / thermal.magnet_s,
            "tcr_winding": machine.resistance_temp_coeff_per_k,
            "tcr_magnet": -machine.magnet_temp_coeff_per_k,
        }
    return motor_heat.Own(**{name: code(name, value, ports[name]) for name, value in values.items()})


def motor_tables(scale: Scale, machine: Machine) -> Tables:
    """The map of what saturation adds, harmonic fluxes over the electrical turn, cogging over the mechanical one."""
    params, tables = machine_params(machine), motor_model.no_tables()
    axis = (np.arange(MAP) - (MAP - 1) / 2) / 32 * scale.current_a
    if params.model == SATURATED:
        for row, x_d in enumerate(axis):
            for column, x_q in enumerate(axis):
                psi_d = machine.magnet_flux_wb + machine.inductance_d_h * x_d
                i_d, i_q = currents_from_flux(
                    params, machine.magnet_flux_wb, psi_d, machine.inductance_q_h * x_q, 0.0, 0.0
                )
                for table, more in ((tables.map_d, i_d - x_d), (tables.map_q, i_q - x_q)):
                    table[row, column] = code("map", more / scale.current_a, POINT)
    for k in range(POINTS):
        turn = 2 * math.pi * k / POINTS
        if machine.emf_harmonics:
            h_d, h_q, _, _ = harmonic_flux(params, machine.magnet_flux_wb, turn / machine.pole_pairs)
            tables.wave_d[k] = code("wave_d", h_d / scale.flux_wb, MOTOR_WAVE)
            tables.wave_q[k] = code("wave_q", h_q / scale.flux_wb, MOTOR_WAVE)
        if machine.cogging_amplitude_nm:
            torque = machine.cogging_amplitude_nm * math.sin(machine.cogging_order * turn + machine.cogging_phase_rad)
            tables.cogging[k] = code("cogging", torque / scale.torque_nm, MOTOR_WAVE)
    return tables


def machine_of(scale: Scale, registers: Registers, machine: Machine, inverter: Inverter) -> Machine:
    """The machine that the rounded registers describe; maps and tables are as given."""
    real = {name: getattr(registers, name) * PORTS[name].fmt.lsb for name in Registers._fields}
    ohm, turn = scale.voltage_v / scale.current_a, 2 * math.pi / scale.step_s
    slope = (inverter.r_switch_ohm + inverter.r_diode_ohm) / 2
    phases = [real[f"r_{x}"] * ohm / STEP - slope for x in "abc"]
    return replace(
        machine,
        resistance_ohm=phases[0],
        phase_resistance_asymmetry=(0.0, phases[1] / phases[0] - 1.0, phases[2] / phases[0] - 1.0),
        magnet_flux_wb=real["psi_m"] * scale.flux_wb,
        inductance_d_h=scale.flux_wb / scale.current_a / real["inv_l_d"],
        inductance_q_h=scale.flux_wb / scale.current_a / real["inv_l_q"],
        inertia_kgm2=scale.torque_nm * scale.step_s / turn / real["k_j"],
        viscous_friction_nms=real["viscous"] * scale.torque_nm / turn,
        coulomb_friction_nm=real["coulomb"] * scale.torque_nm,
    )
