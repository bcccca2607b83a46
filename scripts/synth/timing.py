"""Timing of the whole core: routed Fmax on ECP5 over several seeds, logic-only delay per Xilinx family."""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from scripts.synth.ecp5 import DEVICE, Routing
from scripts.synth.netlist import BITS
from scripts.synth.yosys import Design

TARGET_MHZ = 130
LEAST_SEEDS = 5


def routed(design: Design, seeds: Sequence[int]) -> dict:
    """The "ecp5" part of timing.json, a seed on each core; a line per seed is printed in their order."""
    began = time.monotonic()
    print("ecp5: mapping ...", end=" ", flush=True, file=sys.stderr)
    routing = Routing(design.verilog, design.top)
    print(f"{time.monotonic() - began:.0f} s", flush=True, file=sys.stderr)
    fmax, paths = [], []
    with ThreadPoolExecutor(os.cpu_count()) as cores:
        for one in cores.map(routing.route, seeds):
            fmax.append(round(one.fmax_mhz, 1))
            paths.append(str(one.path))
            took = f"after {time.monotonic() - began:.0f} s"
            print(f"ecp5, seed {one.seed}: {one.fmax_mhz:.1f} MHz; slowest: {one.path}; {took}", flush=True)
    return {
        "fmax_mhz": fmax,
        "median": statistics.median(fmax),
        "spread": round(max(fmax) - min(fmax), 1),
        "seeds": list(seeds),
        "slowest_paths": paths,
        "device": "LFE5U-85F " + " ".join(DEVICE[1:]),
        "multipliers_with_registers": {side: routing.passes[side] for side in BITS},
        "copies": routing.passes["copies"],
    }


def verdict(ecp5: dict) -> str:
    """The median against the target."""
    median = ecp5["median"]
    met = "met" if median >= TARGET_MHZ else f"missed by {TARGET_MHZ - median:.0f} MHz"
    return (
        f"ECP5 routed, {len(ecp5['fmax_mhz'])} seeds: median {median:.1f} MHz, "
        f"{min(ecp5['fmax_mhz']):.1f} to {max(ecp5['fmax_mhz']):.1f}; target {TARGET_MHZ} MHz: {met}"
    )
