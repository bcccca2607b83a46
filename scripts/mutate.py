"""`make mutate`: plants the defects of scripts/mutants.py in copies of the RTL, one by one; the suite must notice.

A block's mutant faces that block's bench, with every configuration; a mutant of the top faces the faults and the
closed loop; one of the registers faces their traffic on the bus; see OWN_BENCH for what surrounds the core.
Writes build/mutate/result.json.  Exit status 1 when one survives.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from cocotb_tests import dut_faults, dut_registers, simulate
from golden_model.registry import BLOCKS
from scripts.files import BUILD, ROOT, write_json
from scripts.mutants import MUTANTS

FOLDER = BUILD / "mutate"
DRIVE = ROOT / "docs" / "drives" / "paper001.toml"


def plant(number: int) -> Path:
    """A copy of the RTL with one defect; ValueError where its text does not stand exactly once."""
    name, file, old, new = MUTANTS[number]
    tree = FOLDER / f"{number:02d}"
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(ROOT / "rtl", tree)
    text = (tree / file).read_text()
    if text.count(old) != 1:
        raise ValueError(
            f"mutant '{name}': its text stands {text.count(old)} times in rtl/{file}, expected once"
        )
    (tree / file).write_text(text.replace(old, new))
    return tree


# Entities whose bench is their own: {entity: (cocotb module, generics, environment)}.
OWN_BENCH = {
    "power_stage": ("cocotb_tests.dut_power_stage", {}, {}),
    "fluxproof_axi": (
        "cocotb_tests.dut_axi_loop",
        {"CARRIER_HALF": 128, "CLOCK_HZ": 2_560_000},
        {"FLUXPROOF_DRIVE": str(DRIVE), "FLUXPROOF_CARRIER_HALF": "128", "FLUXPROOF_CLOCK_HZ": "2560000"},
    ),
}


def runs(file: str):
    """(toplevel, cocotb module, generics, environment) of every run that may notice a defect in ``file``."""
    name = Path(file).stem
    if name in ("axi_lite_slave", "register_access", "register_file", "register_map_pkg"):
        yield dut_registers.RUN
        return
    if name == "fluxproof":
        environment = {
            "FLUXPROOF_DRIVE": str(DRIVE),
            "FLUXPROOF_CARRIER_HALF": "128",
            "FLUXPROOF_SCENARIO": "everything",
        }
        yield name, "cocotb_tests.dut_faults", {"CARRIER_HALF": dut_faults.CARRIER_HALF}, {}
        yield name, "cocotb_tests.dut_loop", {"CARRIER_HALF": 128}, environment
        return
    if name in OWN_BENCH:
        yield name, *OWN_BENCH[name]
        return
    block = BLOCKS[name]
    for k, config in enumerate(block.configs):
        environment = {"FLUXPROOF_BLOCK": name, "FLUXPROOF_CONFIG": str(k), "FLUXPROOF_SEED": "1"}
        yield name, "cocotb_tests.dut_bench", dict(config), environment


def judge(number: int) -> dict:
    """Run the suite against one mutant; ``killed`` and what noticed it."""
    name, file, _old, _new = MUTANTS[number]
    verdict = {"mutant": name, "file": f"rtl/{file}", "killed": False, "by": None}
    tree = plant(number)
    for toplevel, module, generics, environment in runs(file):
        try:
            folder = simulate.run(toplevel, module, generics, environment, rtl=tree)
        except simulate.BuildError as error:
            # A defect that does not even compile proves nothing about the tests.
            return verdict | {"by": str(error), "invalid": True}
        problem = simulate.failure(folder)
        shutil.rmtree(folder, ignore_errors=True)
        if problem is not None:
            shutil.rmtree(tree, ignore_errors=True)
            first = next((line for line in problem.splitlines() if line.strip()), "failed")
            return verdict | {"killed": True, "by": first[:200]}
    return verdict


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", help="run only mutants whose name or file holds this text")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    chosen = [n for n, m in enumerate(MUTANTS) if not arguments.only or arguments.only in m[0] + m[1]]
    began, verdicts = time.monotonic(), []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for done, future in enumerate(as_completed([pool.submit(judge, n) for n in chosen]), 1):
            verdict = future.result()
            verdicts.append(verdict)
            word = "killed" if verdict["killed"] else "INVALID" if verdict.get("invalid") else "SURVIVED"
            print(f"{done:3d}/{len(chosen)} {word:8s} {verdict['file']}: {verdict['mutant']}", flush=True)
    alive = [v for v in verdicts if not v["killed"]]
    result = {
        "mutants": len(verdicts),
        "killed": len(verdicts) - len(alive),
        "survivors": alive,
        "seconds": round(time.monotonic() - began, 1),
        "verdicts": sorted(verdicts, key=lambda v: (v["file"], v["mutant"])),
    }
    if not arguments.only:
        write_json(FOLDER / "result.json", result)
    print(f"{result['killed']} of {result['mutants']} mutants killed in {result['seconds']} s")
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main())
