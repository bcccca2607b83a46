# SPDX-License-Identifier: BSD-3-Clause
"""The converted core, compiled by Verilator into a library: the RTL, bit by bit, at millions of clocks/s.

    core = VerilatedCore({"CARRIER_HALF": 10000})
    core.set_many({"enable": 1, "dead_time": 100, "min_pulse": 300, ...})
    core.reset()
    clocks, edge_clocks, gate_words = core.run_period(30000, sample={"adc_a": 32768, ...}, sample_at=50)

Values are the integers on the ports, signed where the VHDL says so.  Time is counted in ticks, that is rising
edges of the clock: what is set before a tick is seen by it, what is read after a tick holds from that edge on.
"""

from __future__ import annotations

import argparse
import ctypes
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np

from fluxproof.checkout import RTL
from fluxproof.cosim.verilator import LIBRARY, build, clock_of
from fluxproof.cosim.verilog import TOP, top_ports

_INT, _LONG, _CORE = ctypes.c_int, ctypes.c_int64, ctypes.c_void_p
_LONGS = np.ctypeslib.ndpointer(np.int64, flags="C_CONTIGUOUS")
_INTS = np.ctypeslib.ndpointer(np.int32, flags="C_CONTIGUOUS")
_BYTES = np.ctypeslib.ndpointer(np.uint8, flags="C_CONTIGUOUS")
_FUNCTIONS = {  # name: (result, arguments), as in verilated.cpp
    "core_new": (_CORE, []),
    "core_delete": (None, [_CORE]),
    "core_clock": (_LONG, [_CORE]),
    "core_missed": (_LONG, [_CORE]),
    "core_set": (None, [_CORE, _INT, _LONG]),
    "core_get": (_LONG, [_CORE, _INT]),
    "core_eval": (None, [_CORE]),
    "core_tick": (None, [_CORE, _LONG]),
    "core_until": (_LONG, [_CORE, _INT, _LONG]),
    "core_trace": (None, [_CORE, _LONG, _INTS, _LONG, _LONGS]),
    "core_play": (None, [_CORE, _LONG, _INTS, _LONG, _LONGS, _INTS, _LONG, _LONGS]),
    "core_read": (None, [_CORE, _INTS, _LONG, _LONGS]),
    "core_run_period": (_LONG, [_CORE, _LONG, _LONG, _INTS, _BYTES, _LONGS]),
}


def _load(path: Path) -> ctypes.CDLL:
    library = ctypes.CDLL(str(path))
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class VerilatedCore:
    """One core with all inputs 0, before its first clock; as many as wanted may live side by side.

    ``top`` is the entity: the core, or the AXI top around it, which does not show the two valids; ``folder`` has
    another library with the same ports; ``rewrite`` is that of ``verilator.build``.
    """

    def __init__(
        self,
        generics: Mapping[str, int] | None = None,
        rtl: Path = RTL,
        top: str = TOP,
        folder: Path | None = None,
        rewrite: Callable[[str], str] | None = None,
    ):
        self._handle = None
        folder = folder or build(dict(generics or {}), rtl, top, rewrite)
        self.ports = {p.name: p for p in top_ports(folder / f"{top}.v", rtl, top)}
        self.clock_name = clock_of(self.ports)
        self.inputs = tuple(name for name, p in self.ports.items() if p.is_input)
        self.outputs = tuple(name for name, p in self.ports.items() if not p.is_input)
        self._index = {name: k for k, name in enumerate(self.ports)}
        self._lists: dict[tuple[str, ...], np.ndarray] = {}
        self._edges = (np.empty(0, np.int32), np.empty(0, np.uint8))
        self.running_at = 0  # running when the sample of the last run_period entered
        self.duty_at = self.values_at = 0  # ticks of the last run_period that raised the two valids, 0: none
        self._library = _load(folder / LIBRARY)
        self._handle = self._library.core_new()

    def __del__(self):
        if self._handle is not None:
            self._library.core_delete(self._handle)
            self._handle = None

    @property
    def clock(self) -> int:
        """Ticks since the core was made."""
        return self._library.core_clock(self._handle)

    @property
    def missed(self) -> int:
        """With the text of ``with_witness``: ticks that changed a register which would have slept."""
        return self._library.core_missed(self._handle)

    @property
    def gate_word(self) -> int:
        """The gates now: bits 0..2 upper gates of legs a, b, c, bits 3..5 lower gates."""
        return self.get("gate_high") | self.get("gate_low") << 3

    def set(self, name: str, value: int) -> None:
        """Drives an input from the next tick on; ValueError where the value does not fit the port."""
        port, value = self.ports[name], int(value)
        if not port.is_input or name == self.clock_name:
            raise ValueError(f"{name} is not an input to set")
        if not port.low <= value <= port.high:
            raise ValueError(f"{name}={value} does not fit {port.low} .. {port.high}")
        self._library.core_set(self._handle, self._index[name], value)

    def set_many(self, values: Mapping[str, int]) -> None:
        """``set`` for each item."""
        for name, value in values.items():
            self.set(name, value)

    def get(self, name: str) -> int:
        """A port's value as the last tick left it; inputs read back as set."""
        return self._library.core_get(self._handle, self._index[name])

    def get_many(self, names: Iterable[str] | None = None) -> dict[str, int]:
        """Several ports, all outputs by default, in one call."""
        names = self.outputs if names is None else tuple(names)
        values = np.empty(len(names), np.int64)
        self._library.core_read(self._handle, self._indices(names), len(names), values)
        return dict(zip(names, values.tolist(), strict=True))

    def _indices(self, names: tuple[str, ...]) -> np.ndarray:
        if names not in self._lists:
            self._lists[names] = np.array([self._index[name] for name in names], np.int32)
        return self._lists[names]

    def settle(self) -> None:
        """Lets outputs that depend on inputs directly follow what was set, without a clock."""
        self._library.core_eval(self._handle)

    def tick(self, n: int = 1) -> None:
        """``n`` rising edges of the clock."""
        self._library.core_tick(self._handle, n)

    def reset(self, n: int = 4) -> None:
        """``n`` clocks of reset, which is over afterwards; the other inputs stay."""
        name, on = ("rst", 1) if "rst" in self.ports else ("aresetn", 0)
        self.set(name, on)
        self.tick(n)
        self.set(name, 1 - on)

    def clocks_until(self, name: str, most: int) -> int:
        """Ticks, at least once, until port ``name`` is not 0: how many; TimeoutError beyond ``most``."""
        clocks = self._library.core_until(self._handle, self._index[name], most)
        if clocks < 0:
            raise TimeoutError(f"{name} stayed 0 for {most} clocks, to clock {self.clock}")
        return clocks

    def trace(self, n: int, names: Iterable[str]) -> np.ndarray:
        """Ticks ``n`` times: int64, shape (n, len(names)), row k as tick k left the ports."""
        names = tuple(names)
        values = np.empty((n, len(names)), np.int64)
        self._library.core_trace(self._handle, n, self._indices(names), len(names), values)
        return values

    def play(self, given: Mapping[str, np.ndarray], names: Iterable[str]) -> np.ndarray:
        """Drives inputs tick by tick, n of each: int64, shape (n, len(names)), row k as tick k left the ports.

        ValueError where a value does not fit its port.  The inputs keep their last value.
        """
        names, inputs = tuple(names), tuple(given)
        rows = np.ascontiguousarray(np.stack([np.asarray(given[name], np.int64) for name in inputs], axis=1))
        for name, column in zip(inputs, rows.T, strict=True):
            port = self.ports[name]
            if not port.is_input or name == self.clock_name:
                raise ValueError(f"{name} is not an input to set")
            if len(column) and not port.low <= column.min() <= column.max() <= port.high:
                raise ValueError(f"{name} from {column.min()} to {column.max()} does not fit {port.low} .. {port.high}")
        values = np.empty((len(rows), len(names)), np.int64)
        given_ports, seen = self._indices(inputs), self._indices(names)
        self._library.core_play(self._handle, len(rows), given_ports, len(inputs), rows, seen, len(names), values)
        return values

    def apply_sample(self, **inputs: int) -> None:
        """One tick with these inputs and sample_valid high; sample_valid is low again afterwards."""
        self.set_many(inputs)
        self.set("sample_valid", 1)
        self.tick()
        self.set("sample_valid", 0)

    def run_sample(self, wait: int | None = None, most: int = 1000, **inputs: int) -> dict[str, int]:
        """``apply_sample``, then ``wait`` ticks or until values_valid: all outputs of the sample."""
        self.apply_sample(**inputs)
        if wait is None:
            self.clocks_until("values_valid", most)
        else:
            self.tick(wait)
        return self.get_many()

    def run_period(
        self, max_clocks: int, sample: Mapping[str, int] | None = None, sample_at: int = 1
    ) -> tuple[int, np.ndarray, np.ndarray]:
        """Ticks until sample_trigger is high again, at most ``max_clocks`` times, and records the gates.

        Returns (clocks, edge_clocks, gate_words): the ticks made; int32 and uint8 arrays, one entry for each
        change of the gate word: the number of the tick that made it (1 .. clocks, so the change is that many
        clocks after the call's start) and the new word (see ``gate_word``).  An entry with number 0 comes
        first where the word changed between the last call and this one, by ``tick`` and the like.

        ``sample``: inputs to set now, entering the core with sample_valid at tick ``sample_at``; RuntimeError
        where the call ended before that tick.  ``duty_at`` and ``values_at`` then say at which tick the
        duties and all values of the sample were there; they stay readable until the next sample's.
        """
        if sample is not None:
            if sample_at < 1:
                raise ValueError("sample_at counts ticks from 1")
            self.set_many(sample)
        if len(self._edges[0]) <= max_clocks:
            self._edges = (np.empty(max_clocks + 1, np.int32), np.empty(max_clocks + 1, np.uint8))
        facts = np.empty(4, np.int64)
        at = 0 if sample is None else sample_at
        clocks = self._library.core_run_period(self._handle, max_clocks, at, *self._edges, facts)
        found, self.duty_at, self.values_at, self.running_at = facts.tolist()
        if clocks < at:
            raise RuntimeError(f"the sample of tick {at} never entered: the call ended after {clocks}")
        return clocks, self._edges[0][:found].copy(), self._edges[1][:found].copy()


def measure(carrier_half: int, periods: int) -> float:
    """Clocks per second of processor time over whole control periods, one sample each, gates switching."""
    core = VerilatedCore({"CARRIER_HALF": carrier_half})
    core.set_many({"enable": 1, "dead_time": 3, "min_pulse": 8})
    core.reset()
    begin, start = core.clock, time.process_time()
    for k in range(periods):
        core.run_period(4 * carrier_half, {"position_code": k % 128, "adc_u_dc": 4000})
    return (core.clock - begin) / (time.process_time() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description="Builds the verilated core and measures its speed.")
    parser.add_argument("--carrier-half", type=int, default=10000, help="half a PWM period in clocks")
    parser.add_argument("--periods", type=int, default=500, help="control periods to run")
    arguments = parser.parse_args()
    start = time.perf_counter()
    build({"CARRIER_HALF": arguments.carrier_half})
    print(f"library ready after {time.perf_counter() - start:.1f} s")
    speed = measure(arguments.carrier_half, arguments.periods)
    print(f"{speed / 1e6:.2f} million clocks per second of processor time")


if __name__ == "__main__":
    main()
