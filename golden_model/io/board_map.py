# SPDX-License-Identifier: BSD-3-Clause
"""The registers of a board's front ends: a second block of addresses behind the core's, from BASE on.

As in register_map: an address is one entry here and never changes; formats, ranges and meanings come from the ports of
the blocks.  ``registers()`` is the whole map of fluxproof_board, the core's registers first.
"""

from __future__ import annotations

from dataclasses import replace

from golden_model.block import Port
from golden_model.converters import current_front
from golden_model.encoders import forced_position, master_encoder, position_front
from golden_model.formats import BIT
from golden_model.io import board_faults, board_snapshot, register_map
from golden_model.io.register_map import WORD, Field, Kind, Register

BASE, END = 0x400, 0x600
GENERICS = ("encoder", "currents", "spi_lines", "master")
BLOCKS = (position_front, master_encoder, forced_position, current_front, board_faults, board_snapshot)

_GENERICS = {
    "encoder": (0x400, "0 external, 1 A/B/Z, 2 Hall, 3 A/B/Z and Hall, 4 SSI, 5 BiSS-C, 6 EnDat"),
    "currents": (0x404, "0 external, 1 SPI, 2 XADC, 3 delta-sigma"),
    "spi_lines": (0x408, "data lines of the SPI converters"),
    "master": (0x40C, "1: A/B of a second encoder, the gear's master; 0: register gear_code"),
}
_COMMANDS = {
    "clear_encoder": (0x410, Kind.PULSE),
    "take_snapshot": (0x414, Kind.PULSE),
    "position_source": (0x418, Kind.STILL),
    "forced_angle": (0x41C, Kind.COMMAND),
    "forced_rate": (0x420, Kind.COMMAND),
    "board_ignore": (0x424, Kind.COMMAND),
}
_STATUS = """
    440 encoder_flags    444 encoder_count  448 index_count       44c illegal_count    450 lost_counts
    454 bridged_count    458 converter_errors                     45c converter_refused
    460 forced           464 board_flags    468 board_first       470 snap_ready       474 snap_code
    478 snap_position    47c snap_count     480 snap_flags        484 snap_adc_a       488 snap_adc_b
    48c snap_adc_c       490 snap_adc_u_dc  494 master_illegal
"""
_SETTINGS = """
    500 filter_clocks    504 index_phase    508 counts            50c code_step        510 code_rest
    514 correct_max      518 k_edge         51c hall_reverse      520 hall_offset      524 start_first
    528 sector_counts    52c half_period    530 encoder_bits      534 turn_bits        538 gray
    53c parity_on        540 crc_on         544 start_max         548 mode_command     54c two_errors
    550 position_delay   554 bridge_max     558 index_once       55c whole_lines
    560 clock_ratio      564 spi_bits       568 spi_skip          56c spi_delay        570 wait_clocks
    574 busy_timeout     578 two_words      57c use_convst        580 clock_idle       584 second_edge
    588 signed_code      58c channel_a      590 channel_b         594 channel_c        598 channel_u_dc
    59c conversions      5a0 xadc_channels  5a4 address_0         5a8 address_1        5ac address_2
    5b0 address_3        5b4 xadc_timeout   5b8 mod_ratio         5bc mod_delay        5c0 follow_clock
    5c4 oversampling     5c8 sinc_gain      5cc start_clocks      5d0 trip_oversampling
    5d4 limit_high       5d8 limit_low      5dc master_counts    5e0 master_step      5e4 master_rest
"""
STILL = (
    "counts code_step master_counts master_step hall_reverse encoder_bits gray signed_code channel_a channel_b "
    "channel_c channel_u_dc"
).split()
SETTINGS, STATUS = register_map._table(_SETTINGS), register_map._table(_STATUS)
_LARGEST = {"k_edge": (1 << 31) - 1}  # a register fits a signed word; k_edge of real encoders is far below


def settings() -> dict[str, Port]:
    """The registers of the front ends, by name."""
    ports = {p.name: p for block in BLOCKS for p in block.BLOCK.registers}
    ports |= {"clear_encoder": Port("clear_encoder", BIT, doc="1: clear faults and counters of encoder and converters")}
    ports |= {"take_snapshot": Port("take_snapshot", BIT, doc="1: keep what the next sample brings, see snap_ready")}
    return {name: replace(port, hi=_LARGEST.get(name, port.hi)) for name, port in ports.items()}


def board_registers() -> list[Register]:
    """The second block alone; ValueError for a register without an address, or an address without a register."""
    given = settings()
    shown = {p.name: p for block in BLOCKS for p in block.BLOCK.outputs}
    named = {**SETTINGS, **{name: address for name, (address, _) in _COMMANDS.items()}}
    if wrong := sorted(set(given) ^ set(named)):
        raise ValueError(f"board map: {', '.join(wrong)}: a register needs an address, an address a register")
    kinds = {name: kind for name, (_, kind) in _COMMANDS.items()}
    found = [
        Register(name, address, Kind.GENERIC, (Field(name, Port(name, WORD, doc=doc)),), doc)
        for name, (address, doc) in _GENERICS.items()
    ]
    for name, address in named.items():
        port = given[name]
        reset, kind = max(port.low, min(port.high, 0)), kinds.get(name, register_map.kind_of(name, STILL))
        needs = "master" if name.startswith("master_") else ""
        found.append(Register(name, address, kind, (Field(name, port),), port.doc, reset, needs))
    found += [
        Register(name, address, Kind.STATUS, (Field(name, shown[name]),), shown[name].doc)
        for name, address in STATUS.items()
    ]
    return found


def registers() -> dict[str, Register]:
    """The map of fluxproof_board by name, in the order of the addresses; ValueError describes a contradiction."""
    core = register_map.registers()
    ordered = sorted(board_registers(), key=lambda r: r.address)
    addresses = [register.address for register in ordered]
    if len(set(addresses)) < len(addresses) or twice_named(core, ordered):
        raise ValueError(f"board map: named twice: {', '.join(twice_named(core, ordered)) or 'an address'}")
    for register in ordered:
        register_map.check(register, BASE, END)
    return core | {register.name: register for register in ordered}


def twice_named(core, ordered) -> list[str]:
    """Names that both blocks have, or the second one twice."""
    names = [register.name for register in ordered]
    return sorted({name for name in names if name in core or names.count(name) > 1})
