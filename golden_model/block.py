# SPDX-License-Identifier: BSD-3-Clause
"""The declaration of a block: ports with formats, registers, latency, model, reference, error bounds.

The contract of every block, in the model and in the RTL:

* A sample enters on the clock edge at which ``in_valid`` is high.  Its inputs stay constant for
  ``interval`` clocks from that edge, which is also the least distance of two samples.
* An input that is declared ``late`` is valid that many clocks later and not read before.
* Registers change only while no sample is in flight.
* ``out_valid`` is high ``latency`` clocks later, for one clock.  The outputs stay until the next
  sample changes them; the outputs of an ``atomic`` block change together, with ``out_valid`` only.
* The outputs named in ``soon`` are valid ``ahead`` clocks earlier (default 1), marked by a second
  strobe, ``out_soon``: a block that needs them first starts there and declares the others late.
* ``rst`` is synchronous and active high.  It empties the pipeline and sets the state to ``state``;
  the outputs are undefined after it and must not be read without ``out_valid``.
* A clocked block (``clocked=True``) has no strobes: each clock is a sample, the latency is one.
* A cell (``strobes=False``) has neither strobes nor a reset: its pipeline never stops, each clock is a sample.

``reference`` and ``bound`` take the values as real numbers and the state as the integers before the
sample.  The bound is therefore the error of one sample, derived from the formats alone.

``step(*inputs, *registers, *generics)`` returns a tuple in the order of ``outputs``; a block with
state has ``step(state, ...)`` and returns ``(state, outputs)``, state being a NamedTuple of integers.
A block of many ports has ``step(inputs, regs, *generics)`` and ``takes``, the NamedTuples of both: the caller passes
these, or any record that has fields of these names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from golden_model.fixed import Format
from golden_model.formats import BIT


@dataclass(frozen=True)
class Port:
    """A named signal with its format and, where the block needs it, a narrower legal range."""

    name: str
    fmt: Format
    lo: int | None = None
    hi: int | None = None
    doc: str = ""
    late: int = 0  # input only: clocks after in_valid, less than the block's interval

    @cached_property
    def low(self) -> int:
        return self.fmt.lo if self.lo is None else self.lo

    @cached_property
    def high(self) -> int:
        return self.fmt.hi if self.hi is None else self.hi

    @cached_property
    def is_bit(self) -> bool:
        return self.fmt == BIT


@dataclass(frozen=True)
class Const:
    """A real number rounded to a format: a constant of the VHDL package."""

    real: float
    fmt: Format

    @property
    def value(self) -> int:
        exact = self.fmt.to_int(self.real)
        if abs(exact * self.fmt.lsb - self.real) > self.fmt.lsb / 2:
            raise ValueError(f"{self.real} does not fit {self.fmt}")
        return exact


@dataclass(frozen=True)
class Block:
    """One block of the core; see the module's docstring for the contract."""

    name: str
    folder: str
    paper: str  # where the equation comes from
    step: Callable
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    latency: int
    reference: Callable | None  # float: (values, state) -> {output: value}
    bound: Callable | None  # (values, state) -> {output: largest |golden - reference|}
    registers: tuple[Port, ...] = ()
    takes: tuple[Any, ...] = ()  # NamedTuples of the inputs and of the registers, if step takes them as records
    state: Any = None
    interval: int = 1
    clocked: bool = False
    strobes: bool = True  # False: a cell of common/, without reset
    atomic: bool = False  # outputs change with out_valid only
    soon: tuple[str, ...] = ()  # outputs that are valid with out_soon
    ahead: int = 1  # clocks that out_soon comes before out_valid
    shown_with: Mapping[str, str] = field(default_factory=dict)  # clocked: output -> the output that marks it valid
    after_reset: Mapping[str, int] = field(default_factory=dict)  # clocked: outputs that are not zero after reset
    constants: Mapping[str, int | Const] = field(default_factory=dict)
    roms: Mapping[str, tuple[Format, list[int]]] = field(default_factory=dict)
    configs: tuple[Mapping[str, int], ...] = ({},)  # generics to verify with
    too_wide: tuple[int, ...] = ()  # numbers of configs with counters that no bench can fill: no mutants of these
    stimuli: Callable | None = None  # (rng, config) -> list of {port: value}: corner cases of the block
    patient_stimuli: Callable | None = None  # the same, cases that take too long for GHDL: a wide counter at its end
    possible: Callable | None = None  # ({port: value}, config) -> the nearest values that can occur
    width_from: Mapping[str, Callable] = field(default_factory=dict)  # port -> config -> Format
    generated: bool = False  # the VHDL is written by `make generate`

    @property
    def vhdl(self) -> str:
        """The block's VHDL file, below rtl/."""
        return f"{'generated' if self.generated else self.folder}/{self.name}.vhd"

    def ports(self, config: Mapping[str, int]) -> tuple[Port, ...]:
        """Inputs and registers with the formats that the generics give them."""
        return tuple(self._sized(p, config) for p in self.inputs + self.registers)

    def out_ports(self, config: Mapping[str, int]) -> tuple[Port, ...]:
        """Outputs with the formats that the generics give them."""
        return tuple(self._sized(p, config) for p in self.outputs)

    def _sized(self, port: Port, config: Mapping[str, int]) -> Port:
        if size := self.width_from.get(port.name):
            port = replace(port, fmt=size(config))
        return port

    def grouped(self, values: Sequence[int]) -> list:
        """What ``step`` takes, of the values of inputs and registers in the order of their declaration."""
        if not self.takes:
            return list(values)
        rest = iter(values)
        return [record(*(next(rest) for _ in record._fields)) for record in self.takes]

    def run(self, state, values: Mapping[str, int], config: Mapping[str, int]):
        """One sample by name: returns (next state, {output: integer})."""
        return self.runner(config)(state, values)

    def runner(self, config: Mapping[str, int]) -> Callable:
        """``run`` with this configuration, for many samples: (state, {port: value}) -> (next state, outputs)."""
        ports, outputs = [p.name for p in self.inputs + self.registers], [p.name for p in self.outputs]
        generics, step, stateless, grouped = list(config.values()), self.step, self.state is None, self.grouped

        def run(state, values):
            args = [*grouped([values[name] for name in ports]), *generics]
            if stateless:
                result = step(*args)
            else:
                state, result = step(state, *args)
            return state, dict(zip(outputs, map(int, result), strict=True))

        return run
