# SPDX-License-Identifier: BSD-3-Clause
"""Turns the converted Verilog into a library, by Verilator and the C++ compiler; built once per state of its sources.

``verilated.VerilatedCore`` runs what ``build`` makes.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.sleeping import MISSED, WAKE
from fluxproof.cosim.verilog import TOP, VerilogPort, conversion_key, convert, top_ports

CACHE = ROOT / "build" / "verilated"
WRAPPER = Path(__file__).with_name("verilated.cpp")
LIBRARY = "libcore.so"

# Registers without a reset start as 0; what the VHDL calls 'U' there is the business of the comparing test.
# GHDL writes Verilog, in which SystemVerilog's words (final, ...) are names like any other.
VERILATOR_FLAGS = "--cc --language 1364-2005 -O3 --x-assign fast --x-initial fast".split()
VERILATOR_FLAGS += "--no-assert -Wno-lint -Wno-fatal".split()
# One function for a whole clock costs the C++ compiler three times as long; in parts it runs as fast (measured).
VERILATOR_FLAGS += ["--output-split-cfuncs", "1000"]
DEFINES = ["VERILATOR=1", "VL_IGNORE_UNKNOWN_ARCH"]
DEFINES += [f"VM_{x}=0" for x in "COVERAGE SC TIMING TRACE TRACE_FST TRACE_VCD TRACE_SAIF".split()]
COMPILE = ["-std=gnu++17", "-fPIC", "-fno-semantic-interposition", "-w", *(f"-D{name}" for name in DEFINES)]
# What runs every clock; what fills the tables, once; the run-time library, which has a little of both.
# Measured: -O2 compiles as long as -O1, -O3 runs no faster; -O0 for the library costs a third.
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


def _defines(ports: Collection[VerilogPort], verilog: str) -> list[str]:
    """What verilated.cpp must know of a top with these ports and this text."""
    names = {port.name for port in ports}
    valids = ["-DCORE_SHOWS_VALIDS"] if {"duty_valid", "values_valid"} <= names else []
    gates = ["-DCORE_HAS_GATES"] if {"gate_high", "gate_low", "sample_trigger"} <= names else []
    samples = ["-DCORE_TAKES_SAMPLES"] if "sample_valid" in {port.name for port in ports if port.is_input} else []
    trip = ["-DCORE_HAS_ASYNC"] if {"trip", "aresetn"} <= names else []  # io/power_stage
    added = {"CORE_SLEEPS": WAKE, "CORE_HAS_WITNESS": MISSED}  # ports of the text that the VHDL does not have
    sleeps = [f"-D{name}" for name, port in added.items() if port in verilog]
    return [f"-DCORE_CLOCK={clock_of(names)}", *valids, *gates, *samples, *trip, *sleeps]


def clock_of(names: Iterable[str]) -> str:
    """The clock among the ports."""
    return "clk" if "clk" in names else "aclk"


def compile_library(
    folder: Path,
    top: str,
    ports: Collection[VerilogPort],
    wrapper: Path = WRAPPER,
    hot: str = HOT,
    options: Iterable[str] = (),
) -> None:
    """Turns ``folder``/``top``.v and the C++ of ``wrapper`` into ``folder``/libcore.so.

    ``hot``: the compiler's effort for what runs every clock; ``options``: more of Verilator's, after the usual ones.
    """
    verilator, _, root = find_verilator()
    compiler = _compiler()
    defines = _defines(ports, (folder / f"{top}.v").read_text())
    (folder / "ports.inc").write_text("".join(f"PORT({p.name}, {p.width}, {int(p.signed)})\n" for p in ports))
    names = ["--Mdir", "obj", "--prefix", "Vcore", "--top-module", top, f"{top}.v"]
    _run([verilator, *VERILATOR_FLAGS, *options, *names], folder)
    model = sorted(folder.glob("obj/*.cpp"))
    parts = {
        ("hot", hot): [wrapper, *(path for path in model if "Slow" not in path.name)],
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


def build(
    generics: Mapping[str, int],
    rtl: Path = RTL,
    top: str = TOP,
    rewrite: Callable[[str], str] | None = None,
) -> Path:
    """The folder with libcore.so and ``top``.v for these generics, made if it is not there yet.

    rewrite(text): another text with the same ports is compiled in place of the converted one (sleeping.py).
    """
    verilog = convert(generics, ROOT / "build" / "verilog" / conversion_key(generics, rtl, top), rtl, top)
    # The text, not the VHDL, is what gets compiled: someone may be editing the VHDL just now.
    text = verilog.read_bytes()
    if rewrite is None:
        return compiled(text, rtl, top)
    rewritten = rewrite(text.decode())

    def change(work: Path) -> None:
        (work / f"{top}.v").write_text(rewritten)

    return compiled(text, rtl, top, rewritten, change)


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
