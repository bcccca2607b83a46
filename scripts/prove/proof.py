# SPDX-License-Identifier: BSD-3-Clause
"""A proof: an entity, a harness around it, a method, and the planted faults that it must detect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

HARNESSES = Path(__file__).resolve().parents[2] / "tb" / "formal"


@dataclass(frozen=True)
class Fault:
    """A planted fault: ``old`` occurs exactly once in the file ``file`` of rtl/ and is replaced by ``new``."""

    says: str
    file: str
    old: str
    new: str


@dataclass(frozen=True)
class Proof:
    """One property of one entity.

    ``harness`` makes the SystemVerilog module ``formal_top`` from the entity's Verilog; its asserts are the
    property, its assumes are described by ``assumed``, its covers must be reachable under the assumptions.  ``spies``
    are signals of the entity that the harness gets as outputs spy_NAME if LEMMAS is defined: lemmas help induction and
    are proved with the property.  The faults are searched without lemmas, up to ``search_depth`` clocks from reset,
    with ``search_generics``.  ``seen`` are signals that the harness gets as outputs seen_NAME, in the search as well.
    """

    name: str
    says: str
    entity: str
    harness: Callable[[str], str]
    faults: tuple[Fault, ...]
    method: str = "induction"  # induction (z3), pdr (ABC), bmc (z3, bounded)
    depth: int = 3  # clocks: k of the induction or the bound
    generics: Mapping[str, int] = field(default_factory=dict)
    macros: tuple[str, ...] = ()
    spies: tuple[str, ...] = ()
    seen: tuple[str, ...] = ()
    assumed: str = "nothing"
    search_generics: Mapping[str, int] | None = None  # None: those of the proof
    search_depth: int = 20
    covers: bool = True
    cut: Callable[[str], tuple[str, ...]] | None = None  # modules of the Verilog whose outputs become free
    free: tuple[str, ...] = ()  # signals of the entity that take any value at any clock, such as a product
    patience: int = 0  # additional seconds that this proof needs
    vhdl: Callable[[], str] | None = None  # a generated entity around the RTL under proof

    @property
    def mode(self) -> str:
        """``prove``: without a bound; ``bmc``: up to ``depth`` clocks from reset."""
        return "bmc" if self.method == "bmc" else "prove"

    @property
    def searched_with(self) -> Mapping[str, int]:
        return self.generics if self.search_generics is None else self.search_generics


def committed(file: str) -> Callable[[str], str]:
    """The harness tb/formal/``file``, used unchanged."""
    return lambda verilog: (HARNESSES / file).read_text()
