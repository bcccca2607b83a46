# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a Markdown table with one figure replaced, and the benchmark's table from a run of `make blind`."""

from __future__ import annotations

from scripts.evidence.rows import counted

BENCHMARK = (  # (row of docs/benchmark.md, key of the figures)
    ("single effect named, nothing else asserted", "single_named_right"),
    ("pairs exactly correct", "pairs_exactly_right"),
    ("triples exactly correct", "triples_exactly_right"),
    ("asserts an effect that is not there", "confidently_wrong"),
    ("false alarms, healthy drive", "false_alarm_healthy"),
    ("truth within the ambiguity", "truth_inside_ambiguity"),
    ("unknown physics recognised", "unknown_recognised"),
    ("95 % intervals that cover", "coverage_95"),
    ("parameter error, median", "parameter_error_median"),
    ("held-out misfit over noise floor, median", "holdout_over_floor_median"),
    ("median time on one core", "median_time_s"),
)
ORDER = ("own", "sealed", "motulator", "gem")
FIGURE = 1  # column of docs/evidence.md


def with_figure(text: str, claim: str, figure: str) -> str:
    """``text`` with the figure of the row that begins with ``claim``; ValueError unless there is exactly one."""
    lines = text.split("\n")
    mine = [n for n, line in enumerate(lines) if line.startswith(f"| {claim}")]
    if len(mine) != 1:
        raise ValueError(f'{len(mine)} rows begin with "{claim}", not one')
    cells = lines[mine[0]].strip().strip("|").split("|")
    cells[FIGURE] = f" {figure} "
    lines[mine[0]] = f"|{'|'.join(cells)}|"
    return "\n".join(lines)


def cell(figure: dict | None) -> str:
    """A figure of a run: a rate with Wilson's interval or a number; bold where it misses its target."""
    if not figure or figure.get("value") is None:
        return ""
    if "k" in figure:
        text = counted(figure)
        if figure["k"] != figure["n"] or figure["n"] >= 5:
            text += f" ({100 * figure['low']:.0f} to {100 * figure['high']:.0f} %)"
    else:
        text = f"{figure['value']:.3g}"
    return f"**{text}**" if figure.get("met") is False else text


def benchmark(generators: dict) -> str:
    """The table of the newest runs, one column a generator; generators: of build/blind/result.json."""
    names = [n for n in ORDER if n in generators] + sorted(set(generators) - set(ORDER))
    heads = [f"{n}, seed {generators[n]['seed']}, {generators[n]['cases_total']} cases" for n in names]
    lines = [f"| figure | {' | '.join(heads)} |", "|---" * (len(names) + 1) + "|"]
    for title, key in BENCHMARK:
        lines.append(f"| {title} | {' | '.join(cell(generators[n]['figures'].get(key)) for n in names)} |")
    return "\n".join(lines)
