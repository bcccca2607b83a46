# SPDX-License-Identifier: BSD-3-Clause
"""What is printed and drawn: tables as text, the stacked bars of build/synth/resources.svg."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from scripts.synth.count import Count
from scripts.synth.groups import OUTSIDE, PLAIN_FOC, ROWS

HEADINGS = {
    **{"lut": "LUT", "lut_memory": "of them memory", "ff": "FF", "dsp": "DSP48", "bram": "RAMB36"},
    **{"carry_bits": "carry bits", "muxf": "MUXF"},
}
COLOURS = dict(zip(ROWS, ("#8e5ea2", "#e76f51", "#2a9d8f", "#e9c46a", "#577590", "#7a8b99"), strict=True))
# (figure, the most it may be): the targets, on xc7
TARGETS = {"foc": {"lut": 2600, "dsp": 34}, "core": {"lut": 6200, "dsp": 76}}


def table(rows: Mapping[str, Count | None]) -> str:
    """A line per row; None says that its blocks are not there."""
    wide = max(20, *(len(name) for name in rows))
    lines = [" " * wide + "".join(f"{heading:>16}" for heading in HEADINGS.values())]
    for name, row in rows.items():
        if row is None:
            lines.append(f"{name:{wide}}" + f"{'not there':>16}")
        else:
            lines.append(f"{name:{wide}}" + "".join(f"{getattr(row, key):16g}" for key in HEADINGS))
    return "\n".join(lines)


def sums(groups: Mapping[str, Count | None]) -> dict[str, Count]:
    """ "foc" = field-oriented control with SVM and gates; "core" = all but registers_telemetry; "sum" = all."""
    there = {name: row for name, row in groups.items() if row is not None}
    core = [row for name, row in there.items() if name != OUTSIDE]
    return {
        "foc": sum((there[name] for name in PLAIN_FOC), Count()),
        "core": sum(core, Count()),
        "sum": sum(there.values(), Count()),
    }


def against_targets(groups: Mapping[str, Count | None]) -> list[str]:
    """A line per target: the figure, the target, met or missed."""
    names = {"foc": "field-oriented control + SVM + gates", "core": "with both papers' estimators"}
    lines = []
    for key, limits in TARGETS.items():
        for figure, most in limits.items():
            is_ = getattr(sums(groups)[key], figure)
            verdict = "met" if is_ <= most else f"missed by {is_ - most:g}"
            lines.append(f"{names[key]}: {is_:g} {HEADINGS[figure]}, target {most}: {verdict}")
    return lines


def draw(counted: Mapping[str, Mapping[str, Count | None]], path: Path) -> Path:
    """Stacked bars: a bar per family, a colour per row, one panel per kind of cell."""
    figures = ("lut", "ff", "dsp", "bram")
    canvas, panels = plt.subplots(1, len(figures), figsize=(11, 3.4), layout="constrained")
    for panel, figure in zip(panels, figures, strict=True):
        for k, groups in enumerate(counted.values()):
            base = 0.0
            for name in ROWS:
                value = getattr(groups[name], figure) if groups.get(name) else 0
                panel.bar(k, value, bottom=base, color=COLOURS[name], width=0.7, label=name if k == 0 else None)
                base += value
            panel.text(k, base, f"{base:g}", ha="center", va="bottom", fontsize=9)
        panel.set_xticks(range(len(counted)), list(counted))
        panel.set_title(HEADINGS[figure])
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].legend(fontsize=7, frameon=False, loc="lower center", bbox_to_anchor=(0.5, -0.6))
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}")
    canvas.savefig(temporary, format="svg")
    plt.close(canvas)
    temporary.replace(path)
    return path
