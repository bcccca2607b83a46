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
import contextlib
import ctypes
import fcntl
import hashlib
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np

from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.verilog import TOP, VerilogPort, conversion_key, convert, top_ports

CACHE = ROOT / "build" / "verilated"
WRAPPER = Path(__file__).with_suffix(".cpp")
LIBRARY = "libcore.so"

# Registers without a reset start as 0; what the VHDL calls 'U' there is the business of the comparing test.
# GHDL writes Verilog, in which SystemVerilog's words (final, ...) are names like any other.
VERILATOR_FLAGS = "--cc --language 1364-2005 -O3 --x-assign fast --x-initial fast".split()
VERILATOR_FLAGS += "--no-assert -Wno-lint -Wno-fatal".split()
DEFINES = ["VERILATOR=1", "VL_IGNORE_UNKNOWN_ARCH"]
DEFINES += [f"VM_{x}=0" for x in "COVERAGE SC TIMING TRACE TRACE_FST TRACE_VCD TRACE_SAIF".split()]
COMPILE = ["-std=gnu++17", "-fPIC", "-fno-semantic-interposition", "-w", *(f"-D{name}" for name in DEFINES)]
# What runs every clock; what fills the tables, once; the run-time library, which has a little of both.
# Measured: -O2 runs a sixth faster than -O1 and compiles as fast, -O3 is no faster; -O0 for the library costs a third.
HOT, SLOW, LIBRARY_LEVEL = "-O2", "-O0", "-O1"


class BuildError(RuntimeError):
    """Verilator or the C++ compiler is missing or refused; the message ends with its words."""


@lru_cache(maxsize=1)
def find_verilator() -> tuple[str, str, Path]:
    """(executable, version, its root folder): the virtual environment's, else the machine's."""
    own = ROOT / ".venv" / "bin" / "verilator"
    verilator = str(own) if own.exists() else shutil.which("verilator")
    if verilator is None:
        raise BuildError("there is no verilator: `make setup` installs it")
    version, root = _run([verilator, "--version"]), _run([verilator, "--getenv", "VERILATOR_ROOT"])
    return verilator, version.strip(), Path(root.strip())


def _run(command: list[str], cwd: Path | None = None) -> str:
    """What the command prints; BuildError with its complaints where it fails."""
    try:
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
    except OSError as error:
        raise BuildError(f"cannot start {command[0]}: {error}") from error
    if done.returncode:
        raise BuildError(f"{Path(command[0]).name} failed:\n{done.stdout[-2000:]}{done.stderr[-4000:]}")
    return done.stdout


def _compiler() -> str:
    return os.environ.get("CXX", "g++")


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """Holds the file's lock; the system frees it when the process ends, however it ends."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def _defines(names: Iterable[str]) -> list[str]:
    """What verilated.cpp must know of a top with these ports."""
    valids = ["-DCORE_SHOWS_VALIDS"] if {"duty_valid", "values_valid"} <= set(names) else []
    return [f"-DCORE_CLOCK={_clock(names)}", *valids]


def _clock(names: Iterable[str]) -> str:
    """The clock among the ports."""
    return "clk" if "clk" in names else "aclk"


def compile_library(folder: Path, top: str, ports: tuple[VerilogPort, ...]) -> None:
    """Turns ``folder``/``top``.v into ``folder``/libcore.so."""
    verilator, _, root = find_verilator()
    compiler = _compiler()
    defines = _defines([p.name for p in ports])
    (folder / "ports.inc").write_text("".join(f"PORT({p.name}, {p.width}, {int(p.signed)})\n" for p in ports))
    _run([verilator, *VERILATOR_FLAGS, "--Mdir", "obj", "--prefix", "Vcore", "--top-module", top, f"{top}.v"], folder)
    model = sorted(folder.glob("obj/*.cpp"))
    parts = {
        ("hot", HOT): [WRAPPER, *(path for path in model if "Slow" not in path.name)],
        ("slow", SLOW): [path for path in model if "Slow" in path.name],
    }
    headers = (folder, folder / "obj", root / "include", root / "include" / "vltstd")
    includes = [f"-I{path}" for path in headers]
    objects = []
    # The hot object stays first: of an inline function compiled in several, the linker keeps the first.
    for (name, level), sources in parts.items():  # each one text for the compiler, which reads the headers once
        (folder / f"{name}.cpp").write_text("".join(f'#include "{path}"\n' for path in sources))
        _run([compiler, *COMPILE, *defines, level, *includes, "-c", f"{name}.cpp"], folder)
        objects.append(f"{name}.o")
    _run([compiler, "-shared", "-pthread", "-o", LIBRARY, *objects, *runtime_objects()], folder)


def runtime_objects() -> list[str]:
    """Verilator's run-time library, compiled once for all cores."""
    include = find_verilator()[2] / "include"
    names = ("verilated", "verilated_threads")
    key = repr((find_verilator()[1], _compiler(), COMPILE, LIBRARY_LEVEL)).encode()
    folder = CACHE / f"runtime-{hashlib.sha256(key).hexdigest()[:16]}"
    with locked(folder.with_suffix(".lock")):
        if not folder.exists():
            with tempfile.TemporaryDirectory(prefix=f"{folder.name}.", dir=CACHE) as scratch:
                work = Path(scratch) / "finished"
                work.mkdir()
                flags = [*COMPILE, LIBRARY_LEVEL, f"-I{include}", f"-I{include / 'vltstd'}"]
                _run([_compiler(), *flags, "-c", *(str(include / f"{name}.cpp") for name in names)], work)
                os.replace(work, folder)
    return [str(folder / f"{name}.o") for name in names]


def build(generics: Mapping[str, int], rtl: Path = RTL, top: str = TOP) -> Path:
    """The folder with libcore.so and ``top``.v for these generics, made if it is not there yet."""
    verilog = convert(generics, ROOT / "build" / "verilog" / conversion_key(generics, rtl, top), rtl, top)
    # The text, not the VHDL, is what gets compiled: someone may be editing the VHDL just now.
    return compiled(verilog.read_bytes(), rtl, top)


def compiled(
    text: bytes,
    rtl: Path,
    top: str,
    key: object = None,
    change: Callable[[Path], None] = lambda work: None,
) -> Path:
    """The folder with libcore.so and ``top``.v, which holds ``text``, made if it is not there yet.

    change(work): puts what is to be compiled in its place in work/top.v; key: all that this depends on.
    Processes that want the same one wait for the first; a folder appears under its name only when complete.
    """
    tools = (find_verilator()[1], _compiler(), VERILATOR_FLAGS, COMPILE, HOT, SLOW, LIBRARY_LEVEL, key)
    folder = CACHE / hashlib.sha256(repr(tools).encode() + WRAPPER.read_bytes() + text).hexdigest()[:16]
    if folder.exists():
        return folder
    with locked(folder.with_suffix(".lock")):
        if not folder.exists():
            with tempfile.TemporaryDirectory(prefix=f"{folder.name}.", dir=CACHE) as scratch:
                work = Path(scratch)
                (work / f"{top}.v").write_bytes(text)
                ports = top_ports(work / f"{top}.v", rtl, top)
                change(work)
                compile_library(work, top, ports)
                finished = work / "finished"
                finished.mkdir()
                os.replace(work / LIBRARY, finished / LIBRARY)
                (finished / f"{top}.v").write_bytes(text)  # the ports are read from it
                os.replace(finished, folder)
    return folder


_INT, _LONG, _CORE = ctypes.c_int, ctypes.c_int64, ctypes.c_void_p
_LONGS = np.ctypeslib.ndpointer(np.int64, flags="C_CONTIGUOUS")
_INTS = np.ctypeslib.ndpointer(np.int32, flags="C_CONTIGUOUS")
_BYTES = np.ctypeslib.ndpointer(np.uint8, flags="C_CONTIGUOUS")
_FUNCTIONS = {  # name: (result, arguments), as in verilated.cpp
    "core_new": (_CORE, []),
    "core_delete": (None, [_CORE]),
    "core_clock": (_LONG, [_CORE]),
    "core_set": (None, [_CORE, _INT, _LONG]),
    "core_get": (_LONG, [_CORE, _INT]),
    "core_eval": (None, [_CORE]),
    "core_tick": (None, [_CORE, _LONG]),
    "core_until": (_LONG, [_CORE, _INT, _LONG]),
    "core_trace": (None, [_CORE, _LONG, _INTS, _LONG, _LONGS]),
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
    another library with the same ports.
    """

    def __init__(
        self,
        generics: Mapping[str, int] | None = None,
        rtl: Path = RTL,
        top: str = TOP,
        folder: Path | None = None,
    ):
        self._handle = None
        folder = folder or build(dict(generics or {}), rtl, top)
        self.ports = {p.name: p for p in top_ports(folder / f"{top}.v", rtl, top)}
        self.clock_name = _clock(self.ports)
        self.inputs = tuple(name for name, p in self.ports.items() if p.is_input)
        self.outputs = tuple(name for name, p in self.ports.items() if not p.is_input)
        self._index = {name: k for k, name in enumerate(self.ports)}
        self._lists: dict[tuple[str, ...], np.ndarray] = {}
        self._edges = (np.empty(0, np.int32), np.empty(0, np.uint8))
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
        facts = np.empty(3, np.int64)
        at = 0 if sample is None else sample_at
        clocks = self._library.core_run_period(self._handle, max_clocks, at, *self._edges, facts)
        found, self.duty_at, self.values_at = facts.tolist()
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
