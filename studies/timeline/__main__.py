# SPDX-License-Identifier: BSD-3-Clause
"""`make timeline`: our Fig. 8, measured in the simulation: first and last clock of each block's activity.

Writes build/timeline.json and build/timeline.svg.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from fluxproof.checkout import BUILD, ROOT, RTL
from fluxproof.cosim import ghdl
from fluxproof.files import write_json
from golden_model.registry import BLOCKS

COLOURS = {
    "io": "#7a8b99",
    "transforms": "#2a9d8f",
    "control": "#e76f51",
    "modulation": "#264653",
    "estimators": "#8e5ea2",
    "protection": "#c9a227",
}


def measure() -> dict:
    """One sample through the RTL: {"sample_to_duty_clocks", "blocks": [{block, instance, first, last}]}."""
    environment = {
        "FLUXPROOF_TOP": str(RTL / "fluxproof.vhd"),
        "FLUXPROOF_DRIVE": str(ROOT / "docs" / "drives" / "paper001.toml"),
    }
    folder = ghdl.run("fluxproof", "studies.timeline.dut_timeline", {"CARRIER_HALF": 128}, environment, key="timeline")
    problem = ghdl.failure(folder)
    if problem:
        raise RuntimeError(problem)
    return json.loads((folder / "timeline.json").read_text())


def draw(timeline: dict, path: Path) -> Path:
    """Draw one bar per block over the clocks; the edges show the dependencies."""
    rows = timeline["blocks"]
    figure, axes = plt.subplots(figsize=(10, 0.34 * len(rows) + 1.2))
    for k, row in enumerate(rows):
        colour = COLOURS[BLOCKS[row["block"]].folder]
        axes.barh(k, row["last"] - row["first"], left=row["first"], color=colour, height=0.72)
        axes.text(row["last"] + 0.4, k, f"{row['first']} – {row['last']}", va="center", fontsize=8, color="#444")
    axes.set_yticks(range(len(rows)), [row["block"] for row in rows], fontsize=9)
    axes.invert_yaxis()
    duty = timeline["sample_to_duty_clocks"]
    axes.axvline(duty, color="#b00", lw=1)
    axes.text(duty - 0.4, len(rows) - 0.4, f"duties after {duty} clocks", color="#b00", ha="right", fontsize=9)
    axes.set_xlabel("clocks since the raw sample (5 ns each at 200 MHz)")
    axes.set_xlim(0, max(row["last"] for row in rows) + 5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="x", color="#ddd", lw=0.6)
    axes.set_axisbelow(True)
    for name, colour in COLOURS.items():
        axes.barh(0, 0, color=colour, label=name)
    axes.legend(loc="upper right", frameon=False, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}")
    figure.savefig(temporary, format=path.suffix[1:], bbox_inches="tight", metadata={"Date": None})
    plt.close(figure)
    temporary.replace(path)
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, help="draw it here too")
    arguments = parser.parse_args()
    timeline = measure()
    write_json(BUILD / "timeline.json", timeline)
    draw(timeline, BUILD / "timeline.svg")
    if arguments.picture:
        draw(timeline, arguments.picture)
    for row in timeline["blocks"]:
        print(f"{row['block']:24s} clocks {row['first']:3d} to {row['last']:3d}")
    print(
        f"sample to duties: {timeline['sample_to_duty_clocks']} clocks; wrote build/timeline.json, build/timeline.svg"
    )


if __name__ == "__main__":
    main()
