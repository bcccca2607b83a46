# SPDX-License-Identifier: BSD-3-Clause
"""Converts the core to one Verilog file, by GHDL 5 or newer only: ``make verilog``.

GHDL 2 converts without a complaint and wrongly (a signed ``shift_right`` loses its sign), so the version is
checked before anything else, and a test holds the converted design against the VHDL clock by clock.

The file's first line carries a key: a hash of the sources, the generics and GHDL's version.  A file with the
right key is not written again.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.flat import flat_top
from fluxproof.cosim.sources import rtl_sources

TOP = "fluxproof_flat"
OLDEST_GHDL = 5

_ENTITY = re.compile(r"entity\s+(\w+)\s+is(.*?)end\s+entity", re.IGNORECASE | re.DOTALL)
_VHDL_PORT = re.compile(r"(\w+)\s*:\s*(?:in|out)\s+(\w+)", re.IGNORECASE)
_VERILOG_PORT = re.compile(r"\b(input|output)\s+(?:\[(\d+):0\]\s*)?(\w+)")


class NoUsableGhdl(RuntimeError):
    """There is no GHDL here whose Verilog can be trusted."""


@dataclass(frozen=True)
class VerilogPort:
    """A port of the converted top: ``width`` in bits; ``signed`` as the VHDL has it, for Verilog forgets."""

    name: str
    width: int
    signed: bool
    is_input: bool

    @property
    def low(self) -> int:
        return -(1 << (self.width - 1)) if self.signed else 0

    @property
    def high(self) -> int:
        return (1 << (self.width - self.signed)) - 1


def ghdl_version(ghdl: Path | str) -> str:
    """The version as GHDL prints it, for instance "5.0.1"; empty where it does not run."""
    try:
        said = subprocess.run([str(ghdl), "--version"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""
    found = re.match(r"GHDL (\d+[\w.]*)", said)
    return found.group(1) if found else ""


@lru_cache(maxsize=1)
def find_ghdl() -> tuple[Path, str]:
    """(executable, version) of a GHDL that converts rightly: ours from ``make setup``, else the machine's."""
    seen = []
    own = ROOT / ".cache" / "ghdl5" / "bin" / "ghdl"
    for candidate in (own, shutil.which("ghdl"), shutil.which("ghdl-mcode")):
        version = ghdl_version(candidate) if candidate else ""
        if candidate and version and int(version.split(".")[0]) >= OLDEST_GHDL:
            return Path(candidate), version
        seen += [version] if version else []
    raise NoUsableGhdl(
        f"found {'GHDL ' + ', '.join(seen) if seen else 'no GHDL'}, but the conversion to Verilog needs "
        f"GHDL {OLDEST_GHDL} or newer: GHDL 2 miscompiles silently (a signed shift_right becomes a logical "
        "shift). `make setup` fetches GHDL 5."
    )


def synthesize(sources: Sequence[Path], top: str, generics: Mapping[str, int]) -> str:
    """The Verilog of entity ``top``; raises RuntimeError with GHDL's words where it refuses."""
    ghdl, _ = find_ghdl()
    options = ["--std=08", "--out=verilog", *(f"-g{name}={value}" for name, value in generics.items())]
    # The Verilog names its sources line by line: relative names keep it the same in every checkout.
    base = Path(os.path.commonpath([path.parent for path in sources]))
    files = [str(path.relative_to(base)) for path in sources]
    with tempfile.TemporaryDirectory() as scratch:
        command = [str(ghdl), "--synth", *options, f"--workdir={scratch}", *files, "-e", top]
        done = subprocess.run(command, capture_output=True, text=True, cwd=base)
    if done.returncode or f"module {top}" not in done.stdout:
        raise RuntimeError(f"GHDL cannot convert {top} {dict(generics)} to Verilog:\n{done.stderr}")
    return done.stdout


def sources_of(top: str, rtl: Path = RTL) -> list[Path]:
    """The files of the core in compile order, then the flat top's where ``top`` is one."""
    return [*rtl_sources(rtl), *flat_top(top, rtl)[1]]


def conversion_key(generics: Mapping[str, int], rtl: Path = RTL, top: str = TOP) -> str:
    """16 hex digits that change with the sources, the generics and the version of GHDL."""
    digest = hashlib.sha256(repr((find_ghdl()[1], top, sorted(generics.items()))).encode())
    for path in sources_of(top, rtl):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def convert(generics: Mapping[str, int], out_dir: Path | str, rtl: Path = RTL, top: str = TOP) -> Path:
    """Writes ``out_dir``/``top``.v with these generics (the VHDL's defaults for the others) if it is stale.

    Safe if another process writes the same file: it appears complete or not at all.
    """
    path = Path(out_dir) / f"{top}.v"
    key = conversion_key(generics, rtl, top)
    if _key_of(path, top) == key:
        return path
    text, converted = "", None
    while converted != key:  # once, unless someone saves a source meanwhile
        converted = key
        text = synthesize(sources_of(top, rtl), top, generics)
        key = conversion_key(generics, rtl, top)
    setting = ", ".join(f"{name}={value}" for name, value in generics.items()) or "as in the VHDL"
    heading = f"// {top} {key}: converted from VHDL by GHDL {find_ghdl()[1]}; generics: {setting}\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(heading + text)
    os.replace(temporary, path)
    return path


def _key_of(path: Path, top: str) -> str | None:
    """The key in the first line of a converted file, or None."""
    if not path.exists():
        return None
    with path.open() as file:
        found = re.match(rf"// {top} (\w+):", file.readline())
    return found.group(1) if found else None


def top_ports(verilog: Path, rtl: Path = RTL, top: str = TOP) -> tuple[VerilogPort, ...]:
    """The ports of the converted top in order: widths from the Verilog, signs from the VHDL entity."""
    header = re.search(rf"^module {top}\s*\((.*?)\);", verilog.read_text(), re.MULTILINE | re.DOTALL)
    file = next(path for path in sources_of(top, rtl) if path.stem == top)
    entities = {name.lower(): body for name, body in _ENTITY.findall(file.read_text())}
    if header is None or top not in entities:
        raise ValueError(f"no {top} in {verilog.name}, or none in {top}.vhd")
    kinds = {name.lower(): kind.lower() for name, kind in _VHDL_PORT.findall(entities[top])}
    ports = tuple(
        VerilogPort(name, int(msb or 0) + 1, kinds[name] == "signed", direction == "input")
        for direction, msb, name in _VERILOG_PORT.findall(header.group(1))
    )
    missing = set(kinds) - {p.name for p in ports}
    if missing:
        raise ValueError(f"the Verilog lacks ports of the VHDL: {sorted(missing)}")
    return ports


def generic(text: str) -> tuple[str, int]:
    """``NAME=VALUE`` of the command line."""
    name, value = text.split("=")
    return name.upper(), int(value)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("generics", nargs="*", type=generic, metavar="NAME=VALUE", help="generics of the top")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "verilog", help="folder to write to")
    arguments = parser.parse_args()
    try:
        path = convert(dict(arguments.generics), arguments.out)
    except NoUsableGhdl as reason:
        parser.exit(1, f"{reason}\n")
    ports = top_ports(path)
    lines = len(path.read_text().splitlines())
    print(f"{os.path.relpath(path)}: {lines} lines, {len(ports)} ports, by GHDL {find_ghdl()[1]}")


if __name__ == "__main__":
    main()
