# SPDX-License-Identifier: BSD-3-Clause
"""The parts of `make synth`, as many side by side as there are cores: counts, structure, ECP5, netlist against core."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from fluxproof.checkout import ROOT
from scripts.synth import ecp5
from scripts.synth.count import Count
from scripts.synth.yosys import GROUPED, Design, SynthesisFailed

PARTS = ("counts", "structure", "ecp5", "netlist")
STRUCTURE_FAMILY = "xc7"
SMALL = ("clarke", "gate_generation", "sincos")  # counted alone, by the tests too
# Set for the comparison of the whole netlist, which is too long for the test run (cocotb_tests, test_mapped.py).
WHOLE_NETLIST = "FLUXPROOF_WHOLE_NETLIST"


def compare_netlist() -> str:
    """Runs the mapped core against the core, every output at every clock; pytest's last line."""
    (test,) = (ROOT / "cocotb_tests").rglob("test_mapped.py")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(test), "-k", "whole_netlist"]
    environment = {**os.environ, WHOLE_NETLIST: "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    lines = (done.stdout + done.stderr).strip().splitlines()
    if done.returncode or "1 passed" not in lines[-1]:
        raise SynthesisFailed("the mapped netlist and the core:\n" + "\n".join(lines[-20:]))
    return next((line for line in lines if "are equal" in line), lines[-1])


class Work:
    """Futures of everything that was asked for; each part's result is read by its own attribute."""

    def __init__(self, design: Design, pool: ThreadPoolExecutor, folder: Path, families: Sequence[str],
                 parts: Sequence[str], seeds: Sequence[int]):  # fmt: skip
        self.seeds: list[Future] = []
        self.whole: dict[str, Future] = {}
        self.groups: dict[str, Future] = {}
        self.small: Future | None = None
        self.plain: Future | None = None
        self.netlist: Future | None = None
        self.structure: Future | None = None
        # The longest first, so that the cores finish at about the same time.
        if "netlist" in parts:
            self.netlist = pool.submit(_timed, "netlist against core", compare_netlist)
        if "ecp5" in parts:
            mapped = pool.submit(_timed, "ecp5: mapping", ecp5.synthesize, design.verilog, design.top, folder)
        if "structure" in parts:
            self.structure = pool.submit(design.whole_with_netlist, STRUCTURE_FAMILY)
        if "ecp5" in parts:
            self.seeds = [pool.submit(_route, mapped, folder, seed) for seed in seeds]
        if "counts" in parts:
            self.groups = {family: pool.submit(design.groups, family) for family in families if family in GROUPED}
            alone = [f for f in families if f != STRUCTURE_FAMILY or self.structure is None]
            self.whole = {family: pool.submit(design.whole, family) for family in alone}
            self.small = pool.submit(design.blocks, SMALL, STRUCTURE_FAMILY)
            self.plain = pool.submit(design.without_estimators, STRUCTURE_FAMILY)

    def count_of(self, family: str) -> Count:
        """The whole core's count; for the family of the structure it comes with the netlist."""
        return self.whole[family].result() if family in self.whole else self.structure.result()[0]


def _timed(what: str, function, *arguments):
    began = time.monotonic()
    result = function(*arguments)
    print(f"{what}: {time.monotonic() - began:.0f} s", flush=True, file=sys.stderr)
    return result


def _route(mapped: Future, folder: Path, seed: int) -> ecp5.Routed:
    mapped.result()
    return _timed(f"ecp5: seed {seed}", ecp5.route, folder, seed)


@contextmanager
def started(design: Design, families: Sequence[str], parts: Sequence[str], seeds: Sequence[int]) -> Iterator[Work]:
    """Everything under way; what has not begun is given up where the caller ends with an error."""
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            yield Work(design, pool, Path(scratch), families, parts, seeds)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
