"""`make mutate`: plants the defects of scripts/mutants.py in copies of the RTL, one by one; the tests must fail.

$FLUXPROOF_RTL selects the copy for the tests.  A defect of a block is checked by the bench of the block with every
configuration; TESTS lists the tests of files without such a bench.
Writes build/mutate/result.json.  Exit status 1 if a defect is not detected.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_json
from fluxproof.golden_model.registry import BLOCKS
from scripts.mutants import MUTANTS

FOLDER = BUILD / "mutate"
REGISTERS = ["cocotb_tests/blocks/test_registers_axi.py::test_axi_slave_equals_its_twin"]
TOP = [
    "cocotb_tests/core/test_faults.py::test_tour_in_ghdl",
    "cocotb_tests/core/test_closed_loop.py::test_every_event_in_ghdl",
]
# File below rtl/, without its folder and suffix -> the tests that detect a defect in it; others: the block's bench.
TESTS = {
    **dict.fromkeys(("axi_lite_slave", "register_access", "register_file", "register_map_pkg"), REGISTERS),
    "fluxproof": TOP,
    "power_stage": ["cocotb_tests/blocks/test_power_stage.py"],
    "fluxproof_axi": ["cocotb_tests/core/test_axi_top.py"],
}
WHY = re.compile(r"^E\s+(?:AssertionError: )?(.*\S)", re.MULTILINE)


def plant(number: int) -> Path:
    """A copy of the RTL with one defect; ValueError unless its text occurs exactly once."""
    name, file, old, new = MUTANTS[number]
    tree = FOLDER / f"{number:03d}"
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(ROOT / "rtl", tree)
    text = (tree / file).read_text()
    if text.count(old) != 1:
        raise ValueError(f"mutant '{name}': its text occurs {text.count(old)} times in rtl/{file}, not once")
    (tree / file).write_text(text.replace(old, new))
    return tree


def tests_of(file: str) -> list[str]:
    """The tests that pytest runs for a defect in this file of rtl/."""
    name = Path(file).stem
    if name in TESTS:
        return TESTS[name]
    bench = "cocotb_tests/blocks/test_blocks.py::test_rtl_equals_model"
    return [f"{bench}[{name}-{k}]" for k in range(len(BLOCKS[name].configs))]


def judge(number: int) -> dict:
    """Run the tests against one mutant; ``killed`` and the tests that failed."""
    name, file, _old, _new = MUTANTS[number]
    tree = plant(number)
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests_of(file)]
    environment = {**os.environ, "FLUXPROOF_RTL": str(tree)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    verdict = {"mutant": name, "file": f"rtl/{file}", "killed": done.returncode == 1, "by": None}
    if done.returncode not in (0, 1):
        words = done.stdout[-2000:] + done.stderr[-500:]
        raise RuntimeError(f"mutant '{name}': pytest could not run its tests:\n{words}")
    if verdict["killed"]:
        found = WHY.search(done.stdout)
        verdict["by"] = found[1][:200] if found else "a test failed"
        if "BuildError" in done.stdout:  # a defect that does not compile is no check of the tests
            verdict |= {"killed": False, "invalid": True}
    shutil.rmtree(tree, ignore_errors=True)
    return verdict


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", help="run only mutants whose name or file contains this text")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    chosen = [n for n, m in enumerate(MUTANTS) if not arguments.only or arguments.only in m[0] + m[1]]
    began, verdicts = time.monotonic(), []
    with ThreadPoolExecutor(arguments.jobs) as pool:
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
