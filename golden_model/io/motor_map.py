# SPDX-License-Identifier: BSD-3-Clause
"""The registers of the motor in the FPGA: a third block of addresses behind a board's, which only fluxproof_hil has.

As in board_map: an address is one entry here and never changes; formats, ranges and meanings come from the ports of
the blocks, names have ``motor_`` before them.  All take effect at the next clock: a parameter may change while the
motor runs.  ``registers()`` is the whole map of fluxproof_hil, the registers of core and board first.

A word of a table: motor_table_select, motor_table_at, motor_table_high, motor_table_low, then motor_table_write.
"""

from __future__ import annotations

from golden_model.block import Port
from golden_model.fixed import Format
from golden_model.formats import BIT, FLUX, MOTOR_ANGLE, MOTOR_SPEED, MOTOR_VOLTAGE, PU
from golden_model.io import board_map, register_map
from golden_model.io.register_map import Field, Kind, Register
from golden_model.motor import motor_bus, motor_encoder, motor_filter, motor_heat, motor_model, motor_sensors

BASE, END = 0x800, 0xA00
PREFIX = "motor_"
HALF_WORD = Format(0, 18, 0)

_COMMANDS = """
    800 u_dc             804 load            808 start           80c hold           810 omega_set
    860 inv_c            864 k_source        868 k_brake         86c rectifier
    820 stiffness        824 v_switch        828 v_diode         82c r_a            830 r_b             834 r_c
    838 psi_start        83c psi_m           840 inv_l_d         844 inv_l_q        848 pole_pairs
    850 k_j              854 viscous         858 coulomb
    880 scale_a          884 scale_b         888 scale_c         88c scale_u
    890 zero_a           894 zero_b          898 zero_c          89c zero_u
    8a0 noise_i          8a4 noise_u         8a8 angle_offset    8ac counts         8b0 hall_offset
    8b4 k_filter
    8e0 ambient          8e4 t_ref           8e8 heating         8ec k_winding      8f0 k_magnet
    8f4 tcr_winding      8f8 tcr_magnet
    8c0 table_select     8c4 table_at        8c8 table_high      8cc table_low
"""
_PULSES = "814 clear_faults  8d0 table_write"
_STATUS = """
    900 i_a  904 i_b  908 i_c  90c torque  910 omega_m  914 theta_m  918 theta_e  91c shoot_through  920 ready
    924 u_bus  928 temp_winding  92c temp_magnet
"""
COMMANDS, PULSES, STATUS = (register_map._table(text) for text in (_COMMANDS, _PULSES, _STATUS))
_OWN = (  # inputs of the motor that are no registers of a block
    Port("u_dc", MOTOR_VOLTAGE, doc="voltage of the source; without a capacitor that of the bus"),
    Port("load", FLUX, doc="load torque"),
    Port("start", BIT, doc="1: the rotor is held at the angle zero, with the flux motor_psi_start"),
    Port("table_select", Format(0, 2, 0), doc="0 map, 1 harmonic fluxes, 2 cogging"),
    Port("table_at", Format(0, 12, 0), doc="address of the word: row and column of the map, or share of the turn"),
    Port("table_high", HALF_WORD, doc="the word's d axis"),
    Port("table_low", HALF_WORD, doc="the word's q axis, or its torque"),
    Port("clear_faults", BIT, doc="1: clear motor_shoot_through"),
    Port("table_write", BIT, doc="1: write the word"),
)
_SHOWN = (
    *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
    Port("torque", FLUX, doc="torque of the currents"),
    Port("omega_m", MOTOR_SPEED, doc="mechanical speed, turns a step"),
    Port("theta_m", MOTOR_ANGLE, doc="mechanical angle"),
    Port("theta_e", MOTOR_ANGLE, doc="electrical angle"),
    Port("shoot_through", BIT, doc="1: both gates of a leg were on"),
    Port("ready", BIT, doc="1: the rotor is free"),
    Port("u_bus", MOTOR_VOLTAGE, doc="voltage of the bus"),
    *(p for p in motor_heat.BLOCK.outputs if p.name.startswith("temp_")),
)

_UNITS = {  # what 1.0 is: the bases of fluxproof/hil/registers.py
    "U_motor": "u_dc u_bus v_switch v_diode", "I_motor": "i_a i_b i_c zero_a zero_b zero_c",
    "psi_motor": "psi_start psi_m",
    "T_motor": "load coulomb torque", "U_motor/I_motor": "r_a r_b r_c stiffness",
    "I_motor/psi_motor": "inv_l_d inv_l_q", "U_motor/(I_motor clock)": "inv_c",
    "1/step": "k_source k_brake k_filter", "1/window": "k_winding k_magnet", "1/K": "tcr_winding tcr_magnet",
    "degC": "ambient t_ref temp_winding temp_magnet", "degC/(I_motor^2 window)": "heating",
    "turn": "angle_offset hall_offset theta_m theta_e", "turn/step": "omega_set omega_m", "turn/step^2/T_motor": "k_j",
    "T_motor step/turn": "viscous",
}  # fmt: skip
UNITS = {PREFIX + name: unit for unit, names in _UNITS.items() for name in names.split()}


def settings() -> dict[str, Port]:
    """The ports of the registers that software writes, without the prefix."""
    of_sensors = [port for block in (motor_filter, motor_sensors, motor_encoder) for port in block.BLOCK.registers]
    of_motor = (*motor_model.REGISTERS, *motor_bus.REGISTERS, *motor_heat.OWN)
    return {port.name: port for port in (*_OWN, *of_motor, *of_sensors)}


def motor_registers() -> list[Register]:
    """The third block alone; ValueError for a register without an address, or an address without a register."""
    given, shown = settings(), {port.name: port for port in _SHOWN}
    named = {**COMMANDS, **PULSES}
    if wrong := sorted(set(given) ^ set(named) | set(shown) ^ set(STATUS)):
        raise ValueError(f"motor map: {', '.join(wrong)}: a register needs an address, an address a register")
    found = []
    for ports, places in ((given, named), (shown, STATUS)):
        for name, address in places.items():
            kind = Kind.STATUS if ports is shown else Kind.PULSE if name in PULSES else Kind.COMMAND
            port = Port(PREFIX + name, ports[name].fmt, ports[name].lo, ports[name].hi, ports[name].doc)
            reset = max(port.low, min(port.high, 0))
            found.append(Register(port.name, address, kind, (Field(port.name, port),), port.doc, reset))
    return found


def registers() -> dict[str, Register]:
    """The map of fluxproof_hil by name, in the order of the addresses; ValueError describes a contradiction."""
    before = board_map.registers()
    ordered = sorted(motor_registers(), key=lambda r: r.address)
    addresses = [register.address for register in ordered]
    if len(set(addresses)) < len(addresses) or board_map.twice_named(before, ordered):
        raise ValueError(f"motor map: named twice: {', '.join(board_map.twice_named(before, ordered)) or 'an address'}")
    for register in ordered:
        register_map.check(register, BASE, END)
    return before | {register.name: register for register in ordered}
