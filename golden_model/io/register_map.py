# SPDX-License-Identifier: BSD-3-Clause
"""The register map for software: one fixed address for every register, command and status value.

The address of a register is one entry in ``_SETTINGS``; ``registers()`` raises an error for a register without one.
Addresses never change: a new register does not move others, and the address of a removed one stays free.
Formats, ranges and meanings come from the ports of the blocks; nothing is declared a second time here.

Words have 32 bits; negative values are sign-extended.  When a write takes effect (``Kind``):

* SETTING: between two samples, never during one; the bus response comes when the write takes effect.
* STILL: likewise, and while the gates are off alone: what a quantity means to the controller, or how the gates switch.
  A write while they switch is refused.
* COMMAND, PULSE: at the next clock.  A pulse is set by ones and returns to zero after one clock.
* SAMPLE_PULSE: between two samples; returns to zero after the next sample.
* STATUS, CONSTANT, GENERIC: read only; a constant is fixed here, a generic when the core is built.

scripts/registers writes the SystemRDL from this map, and everything else from the SystemRDL.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from golden_model import fluxproof
from golden_model.block import Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io import fault_latch, interrupts, sample_guard, sample_latch, telemetry, telemetry_ring
from golden_model.modulation import gate_generation

ADDRESS_BITS, WORDS = 12, 256  # the slave decodes 4 KiB; the registers are in the first WORDS words
OKAY, SLVERR, DECERR = 0, 2, 3  # responses of AXI4
PATIENCE = fluxproof.SAMPLE_INTERVAL + 16  # clocks that a write waits for the end of a sample
IDENTIFICATION = int.from_bytes(b"FLUX", "big")

WORD = Format(0, 32, 0)
GENERICS = (
    "adc_bits",
    "position_bits",
    "carrier_half",
    "clock_hz",
    "estimators",
    "references",
    "position_loop",
    "residual",
    "modes",
    "overmodulation",
    "gearing",
)


class Kind(Enum):
    """The kind of a register, which decides when a write to it takes effect."""

    SETTING = "setting"
    STILL = "still setting"
    COMMAND = "command"
    PULSE = "pulse"
    SAMPLE_PULSE = "sample pulse"
    STATUS = "status"
    CONSTANT = "constant"
    GENERIC = "generic"

    @property
    def writable(self) -> bool:
        return self in (Kind.SETTING, Kind.STILL, Kind.COMMAND, Kind.PULSE, Kind.SAMPLE_PULSE)

    @property
    def waits(self) -> bool:
        """The write waits until no sample is in flight."""
        return self in (Kind.SETTING, Kind.STILL, Kind.SAMPLE_PULSE)


@dataclass(frozen=True)
class Field:
    """Bits of a word; ``port`` is the corresponding port of the core, whose name may differ from the field's."""

    name: str
    port: Port
    bit: int = 0

    @property
    def width(self) -> int:
        """Bits in the word: a signed number is sign-extended to the last bit of the word."""
        return 32 - self.bit if self.port.fmt.signed else self.port.fmt.width


@dataclass(frozen=True)
class Register:
    """One word of the map; ``reset`` is its value after a reset (of a constant: always).

    ``needs``: the generic without which nothing reads the register: it then keeps its reset value, whatever is written.
    """

    name: str
    address: int
    kind: Kind
    fields: tuple[Field, ...]
    doc: str
    reset: int = 0
    needs: str = ""

    @property
    def port(self) -> Port:
        """The port of a register that is one number."""
        return self.fields[0].port


_SETTINGS = """
    100 offset_a      104 offset_b       108 offset_c     10c gain_a         110 gain_b       114 gain_c
    118 u_dc_offset   11c u_dc_gain      120 k_u_max      124 pole_pairs     128 reverse      12c theta_offset
    130 k_speed       134 k_filter       138 rail_samples 13c jump_max
    140 speed_kp      144 speed_ki       148 i_max
    150 kp_d          154 ki_d           158 kp_q         15c ki_q           160 l_d          164 l_q
    168 lambda_mg     16c k_delay        170 dead_time    174 min_pulse
    178 watchdog      17c fault_ignore
    070 omega_given   074 speed_given    078 position_restart                14c two_sensors
    180 flux_mode     184 r_s            188 t_s          18c omega_0        190 xi           194 omega_min
    198 k_ramp        19c flux_kp        1a0 flux_ki      1a4 delta_max      1a8 k_chord
    1b0 tcr           1b4 t_0            1b8 t_min        1bc t_max
    1c0 compensate    1c4 k_lp           1c8 eta_v        1cc gamma          1d0 zeta         1d4 v_thr
    1d8 v_comp_max    1dc i_learn        1e0 eta_psi      1e4 omega_psi_min  1e8 k_ahead      1ec k_sign
    1f0 i_trip        1f4 sum_trip       1f8 u_dc_min     1fc u_dc_max
    200 omega_trip    204 omega_away     208 runaway_samples               20c omega_stall  210 stall_samples
    384 way_stall
    214 i_open        218 offset_max     21c heartbeat    220 brake_on     224 brake_off
    228 emf_min       22c emf_i          230 emf_w        234 emf_samples    238 emf_l
    240 double_update
    250 use_table     254 k_flux         258 u_share      25c k_voltage      260 share_min    264 k_torque
    268 omega_learn   26c table_word     270 v_start        274 torque_step
    23c regen_start   244 regen_slope     248 charge_samples
    280 position_mode 284 position_target                 288 position_kp    28c position_band  290 omega_most
    294 move_speed    298 move_step      29c jerk_bits      2a0 torque_lead    2a4 use_stops      2a8 stop_low
    2ac stop_high     2b0 k_inertia      2b4 k_viscous      2b8 coulomb
    2bc voltage_mode  2c0 u_d_ext         2c4 u_q_ext      2c8 u_step         2cc i_step
    2d0 omega_step    2d4 k_ripple
    2ec gear_on       2f0 gear_numerator  2f4 gear_denominator                2f8 gear_step      2fc gear_lead
    300 gear_smooth   304 gear_code
    340 residual_min  344 residual_w     348 residual_i     34c residual_samples
    350 residual_sum_max                 354 residual_sum_i
    378 residual_leg  37c residual_light
    380 residual_slow
"""  # 24c, 278 to 27c, 2d8 to 2dc, 308 to 33c, 388 to 3bc and 3f0 to 3fc are free
# What a code or a voltage means to the controller, and how the gates switch. What one trims while the drive runs (zeros
# of the sensors, theta_offset), gains and limits are no such settings.
STILL = (
    "reverse pole_pairs k_speed two_sensors gain_a gain_b gain_c u_dc_gain k_u_max k_delay dead_time min_pulse"
).split()
_COMMANDS = {
    "enable": (0x040, Kind.COMMAND),
    "clear_trip": (0x044, Kind.PULSE),
    "clear_faults": (0x048, Kind.SAMPLE_PULSE),
    "telemetry_enable": (0x04C, Kind.COMMAND),
    "omega_ref": (0x050, Kind.SETTING),
    "i_d_ref": (0x054, Kind.SETTING),
    "i_q_ext": (0x058, Kind.SETTING),
    "speed_mode": (0x05C, Kind.SETTING),
    "temp_winding": (0x060, Kind.SETTING),
    "temp_valid": (0x064, Kind.SETTING),
    "irq_mask": (0x068, Kind.COMMAND),
    "irq_clear": (0x06C, Kind.PULSE),
    "ring_arm": (0x3C0, Kind.PULSE),
    "ring_stop": (0x3C4, Kind.PULSE),
    "ring_faults": (0x3C8, Kind.COMMAND),
    "ring_word": (0x3CC, Kind.COMMAND),
    "ring_high": (0x3D0, Kind.COMMAND),
    "ring_low": (0x3D4, Kind.COMMAND),
    "ring_after": (0x3D8, Kind.COMMAND),
    "ring_address": (0x3DC, Kind.COMMAND),
}
_STATUS = """
    084 flux_faults   088 min_pulse_used  08c omega_me     090 theta_me       094 i_d          098 i_q
    09c i_q_ref       0a0 u_dc            0a4 u_d          0a8 u_q            0ac torque       0b0 lambda_d
    0b4 lambda_q      0b8 psi_m           0bc v_dead       0c0 v_comp
    0c8 telemetry_dropped                 0cc fault_flags      0d0 first_fault    0d4 early_samples
    0d8 irq_cause     0dc code_a          0e0 code_b           0e4 code_c         0e8 code_u_dc
    0ec code_theta    2e0 shaft_position  2e4 position_error   2e8 gear_way
    358 residual_d     35c residual_q     360 residual_mean_d
    364 residual_mean_q                  368 residual_sixth_d                 36c residual_sixth_q
    370 residual_power                   374 residual_sum
    3e4 ring_depth      3e8 ring_next    3ec ring_data
"""
# Bits of the word "flags", read together: name -> lowest bit.
_FLAGS = {
    "running": 0,
    "tripped": 1,
    "setting_refused": 2,
    "current_at_rail": 3,
    "u_dc_at_rail": 6,
    "u_dc_low": 7,
    "speed_limited": 8,
    "v_comp_limited": 9,
    "psi_held": 10,
    "temp_lost": 11,
    "merge_known": 12,
    "delta_held": 13,
    "brake_asked": 14,
    "double_used": 15,
    "regen_limited": 16,
    "gear_engaged": 17,
    "gear_stopped": 18,
    "motor_differs": 24,
}
# Bits of the word "ring_state", likewise
_RING_STATE = {"ring_recording": 0, "ring_ended": 1, "ring_full": 2, "ring_cause": 4}

# Pins of the core: inputs per sample or clock that do not come from software.
PINS = ("adc_a", "adc_b", "adc_c", "adc_u_dc", "position_code", "trip")
INTERNAL = ("run_in", "compare_a", "compare_b", "compare_c")  # between two blocks
_IRQ = {p.name: p for p in (*interrupts.BLOCK.inputs, *interrupts.BLOCK.outputs) if p.name.startswith("irq_")}
_RING = {p.name: p for p in (*telemetry_ring.BLOCK.inputs, *telemetry_ring.BLOCK.outputs) if p.name.startswith("ring_")}
_BESIDE_THE_CORE = (
    _IRQ
    | _RING
    | {
        p.name: p
        for p in (
            Port("telemetry_enable", BIT, doc="1: send a packet for each sample"),
            Port("telemetry_dropped", telemetry.DROPPED, doc="samples without a packet, up to 65535"),
        )
    }
)


def _table(text: str) -> dict[str, int]:
    """{name: address} of a table of hexadecimal addresses and names; ValueError for a duplicate name."""
    words = text.split()
    table = dict(zip(words[1::2], (int(word, 16) for word in words[::2]), strict=True))
    if 2 * len(table) != len(words):
        raise ValueError(f"register map: named twice: {sorted({w for w in words if words.count(w) > 1})}")
    return table


SETTINGS, STATUS = _table(_SETTINGS), _table(_STATUS)


def kind_of(name: str, still: Sequence[str] = STILL) -> Kind:
    """The kind of a register of a block: SETTING, or STILL where it is one of these."""
    return Kind.STILL if name in still else Kind.SETTING


def inputs() -> dict[str, Port]:
    """The inputs of the core that are neither registers nor pins, by the name for software."""
    names = (
        "telemetry_enable",
        "irq_mask",
        "irq_clear",
        *(p.name for p in telemetry_ring.BLOCK.inputs if p.name in _RING),
    )
    beside = (_BESIDE_THE_CORE[name] for name in names)
    ports = (*sample_latch.BLOCK.inputs, *gate_generation.BLOCK.inputs, *beside)
    return {p.name.removesuffix("_in"): p for p in ports if p.name not in PINS + INTERNAL}


def observables() -> dict[str, Port]:
    """The outputs of the core and the telemetry that can be read as status."""
    clocked = (gate_generation, fault_latch, sample_guard)
    gates = {p.name: p for module in clocked for p in module.BLOCK.outputs}
    return gates | dict(fluxproof.OBSERVED) | _BESIDE_THE_CORE


def _read_only() -> list[Register]:
    """Identification, version, generics, status."""
    shown = observables()

    def word(name: str, address: int, kind: Kind, doc: str, reset: int = 0) -> Register:
        return Register(name, address, kind, (Field(name, Port(name, WORD, doc=doc)),), doc, reset)

    flags, ring_state = (
        tuple(Field(name, shown[name], bit) for name, bit in table.items()) for table in (_FLAGS, _RING_STATE)
    )
    return [
        word("identification", 0x000, Kind.CONSTANT, "the letters FLUX", IDENTIFICATION),
        word("version", 0x004, Kind.CONSTANT, "version of the core: major, minor, patch in bits 23 to 0"),
        word("adc_bits", 0x008, Kind.GENERIC, "bits of an ADC code"),
        word("position_bits", 0x00C, Kind.GENERIC, "bits of a position code"),
        word("carrier_half", 0x010, Kind.GENERIC, "half a PWM period in clocks"),
        word("clock_hz", 0x014, Kind.GENERIC, "frequency of the clock, Hz"),
        word("estimators", 0x018, Kind.GENERIC, "1: with estimators, 0: field-oriented control alone"),
        word("references", 0x01C, Kind.GENERIC, "1: with current references by a table of torque and flux limit"),
        word("position_loop", 0x020, Kind.GENERIC, "1: with a position loop and its trajectory"),
        word("residual", 0x024, Kind.GENERIC, "1: with the residual of the motor beside its description"),
        word("modes", 0x028, Kind.GENERIC, "1: with voltage mode and changes of mode without a step of the voltage"),
        word("overmodulation", 0x02C, Kind.GENERIC, "1: with fundamentals of the voltage up to six-step"),
        word("gearing", 0x030, Kind.GENERIC, "1: with a gear to a second encoder, in the position loop"),
        Register("flags", 0x080, Kind.STATUS, flags, "status flags of the core, read together"),
        Register("ring_state", 0x3E0, Kind.STATUS, ring_state, "what the ring of telemetry does, read together"),
        *(
            Register(name, address, Kind.STATUS, (Field(name, shown[name]),), shown[name].doc)
            for name, address in STATUS.items()
        ),
    ]


def _writable(settings: Mapping[str, Port]) -> list[Register]:
    """Commands and the core's registers; ValueError if one has no address, or an address has no register."""
    given = inputs()
    for what, ports, table in (("register", settings, SETTINGS), ("command", given, _COMMANDS)):
        if missing := sorted(set(ports) - set(table)):
            raise ValueError(f"register map: {what} {', '.join(missing)} of the core has no address")
        if unknown := sorted(set(table) - set(ports)):
            raise ValueError(f"register map: {', '.join(unknown)} has an address, but is not a port of the core")
    found = [(name, address, kind, given[name]) for name, (address, kind) in _COMMANDS.items()]
    found += [(name, SETTINGS[name], kind_of(name), port) for name, port in settings.items()]
    needs = fluxproof.NEEDS
    return [
        Register(
            name, address, kind, (Field(name, port),), port.doc, max(port.low, min(port.high, 0)), needs.get(name, "")
        )
        for name, address, kind, port in found
    ]


def registers(settings: Mapping[str, Port] = fluxproof.REGISTERS) -> dict[str, Register]:
    """The map by name, in the order of the addresses; ValueError describes a contradiction.

    The reset value of a register is zero, or the legal value closest to zero: gains zero, gates off.
    """
    ordered = sorted(_read_only() + _writable(settings), key=lambda r: r.address)
    for before, after in pairwise(ordered):
        if before.address == after.address:
            raise ValueError(f"register map: {before.name} and {after.name} share address {after.address:#05x}")
    for register in ordered:
        check(register)
    result = {r.name: r for r in ordered}
    if len(result) != len(ordered):
        raise ValueError("register map: two registers have the same name")
    return result


def check(register: Register, base: int = 0, end: int = 4 * WORDS) -> None:
    """ValueError where a register is not within its block of addresses, or its fields not within their word."""
    if register.address % 4 or not base <= register.address < end:
        raise ValueError(
            f"register map: {register.name} at {register.address:#x}: expected a multiple of 4 below {end:#x}"
        )
    taken = 0
    for f in register.fields:
        bits = ((1 << f.width) - 1) << f.bit
        if bits & taken or bits >> 32:
            raise ValueError(f"register map: {register.name}: {f.name} does not fit bit {f.bit} of its word")
        taken |= bits
    if register.kind.writable and not -(1 << 31) <= register.port.low <= register.port.high < 1 << 31:
        raise ValueError(f"register map: {register.name} does not fit a signed word of 32 bits")
