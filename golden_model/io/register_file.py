# SPDX-License-Identifier: BSD-3-Clause
"""The registers behind the bus, one transaction at a time: twin of generated/register_file.vhd and register_access.vhd.

A write takes effect or is refused as a whole; the response says which (OKAY, SLVERR, DECERR of AXI4).  A register of a
part that the core was built without keeps its reset value: a legal write is OKAY and changes nothing.  The RTL decides
when a write takes effect (see register_map.Kind); the caller reports samples to this model by ``sample()``.
Formats: words are 32 bits as software sees them, unsigned; ``values`` holds the integers.
"""

from __future__ import annotations

from collections.abc import Mapping

from golden_model.fluxproof import Registers
from golden_model.io.register_map import (
    ADDRESS_BITS,
    DECERR,
    GENERICS,
    OKAY,
    SLVERR,
    Kind,
    Register,
    registers,
)

ALL_STROBES = 0b1111
MASK = 0xFFFFFFFF


def to_word(value: int) -> int:
    """A register's integer as 32 bits, sign extended."""
    return value & MASK


def from_word(word: int) -> int:
    """32 bits as a signed integer, for the range check."""
    return word - (1 << 32) if word >> 31 else word


class RegisterFile:
    """The register map with its values; generics and version of the core as built.

    ``generics``: {name: value} of all of register_map.GENERICS; ``beside``: those of a board, 0 where not given.
    """

    def __init__(self, generics: Mapping[str, int], version: int = 0, beside: Mapping[str, int] | None = None) -> None:
        self.map = registers()
        self.at = {register.address: register for register in self.map.values()}
        if set(generics) != set(GENERICS):
            raise ValueError(f"generics are {', '.join(sorted(generics))}: expected {', '.join(GENERICS)}")
        self._built = {**generics, **(beside or {})}
        self._constant = {**generics, "identification": self.map["identification"].reset, "version": version}
        self.status: dict[str, int] = {
            field.name: 0 for register in self.map.values() if register.kind is Kind.STATUS for field in register.fields
        }
        self.reset()

    def reset(self) -> None:
        """What ``rst`` does: every register to its reset value."""
        self.values = {r.name: r.reset for r in self.map.values() if r.kind.writable}

    def write(self, address: int, word: int, strobe: int = ALL_STROBES) -> int:
        """A write on the bus; returns the response.  A refused write changes nothing."""
        register = self._at(address)
        if register is None:
            return DECERR
        if not register.kind.writable or strobe != ALL_STROBES:
            return SLVERR
        value = from_word(word)
        if not register.port.low <= value <= register.port.high:
            return SLVERR
        if register.kind is Kind.STILL and self.status["running"]:
            return SLVERR
        if not register.needs or self._built.get(register.needs, 0):
            self.values[register.name] = value
        return OKAY

    def read(self, address: int) -> tuple[int, int]:
        """A read on the bus: (response, word); OKAY and zero where there is no register."""
        register = self._at(address)
        if register is None:
            return OKAY, 0
        return OKAY, self._word(register)

    def clock(self) -> None:
        """One clock after the last write: pulses return to zero."""
        self._fall(Kind.PULSE)

    def sample(self) -> None:
        """A sample was taken: the pulses that waited for it return to zero."""
        self._fall(Kind.SAMPLE_PULSE)

    def settings(self) -> Registers:
        """The core's registers as a Registers tuple for fluxproof.step."""
        return Registers(*(self.values[name] for name in Registers._fields))

    def _at(self, address: int) -> Register | None:
        """The register at a byte address of the window; None if the address is free."""
        return self.at.get(address % (1 << ADDRESS_BITS))

    def _fall(self, kind: Kind) -> None:
        for register in self.map.values():
            if register.kind is kind:
                self.values[register.name] = 0

    def _word(self, register: Register) -> int:
        if register.name in self._constant:
            return to_word(self._constant[register.name])
        if register.kind.writable:
            return to_word(self.values[register.name])
        word = 0
        for field in register.fields:
            word |= (self.status[field.name] & ((1 << field.width) - 1)) << field.bit
        return word
