# SPDX-License-Identifier: BSD-3-Clause
"""Inside the simulator: one sample through the top; when does each block's in_valid and out_valid rise?"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import cocotb
from cocotb.triggers import FallingEdge

from fluxproof.cosim.block_bench import read
from fluxproof.cosim.ghdl_device import prepare
from fluxproof.cosim.inside import instance
from golden_model import drive as drives
from golden_model.registers import registers

CLOCKS = 80


def instances(top: Path) -> dict[str, str]:
    """{label: entity} of everything the top, without what is off by default, and its protection instantiate."""
    text = top.read_text()
    for off in ("GEARING", "(REFERENCES|POSITION_LOOP|RESIDUAL|MODES|OVERMODULATION)"):  # the inner one first
        text = re.sub(rf"{off} = 1 generate.*?else generate", "", text, flags=re.DOTALL)
    text += (top.parent / "io" / "protection.vhd").read_text()
    found = dict(re.findall(r"^\s+(\w+)\s*: entity work\.(\w+)", text, re.MULTILINE))
    return {label: entity for label, entity in found.items() if entity != "protection"}


@cocotb.test()
async def timeline(dut):
    labels = instances(Path(os.environ["FLUXPROOF_TOP"]))
    drive = drives.with_carrier(drives.load(os.environ["FLUXPROOF_DRIVE"]), 128)
    await prepare(dut, registers(drive).values)
    await FallingEdge(dut.clk)
    strobes = {label: instance(dut.inside, label) for label in labels}
    strobes = {label: (h.in_valid, h.out_valid) for label, h in strobes.items() if hasattr(h, "in_valid")}
    rows = {label: {"block": labels[label], "instance": label, "first": None, "last": None} for label in strobes}
    duty = None
    dut.sample_valid.value = 1
    for clock in range(CLOCKS):
        # Values sampled here are those at the next rising edge, number `clock`.
        await cocotb.triggers.Timer(1, "ns")
        for label, (begin, end) in strobes.items():
            if read(begin, False) == 1 and rows[label]["first"] is None:
                rows[label]["first"] = clock
            if read(end, False) == 1 and rows[label]["last"] is None:
                rows[label]["last"] = clock
        if read(dut.duty_valid, False) == 1 and duty is None:
            duty = clock
        await FallingEdge(dut.clk)
        dut.sample_valid.value = 0
    with open("timeline.json", "w") as stream:
        json.dump({"sample_to_duty_clocks": duty, "blocks": sorted(rows.values(), key=lambda r: r["first"])}, stream)
