# SPDX-License-Identifier: BSD-3-Clause
"""The comparison as a table: Markdown for the notes, an HTML snippet for the reports."""

from __future__ import annotations

from jinja2 import Environment

from studies.compare.methods import TITLES

COLUMNS = {
    "single_named_right": "single effects named right",
    "pairs_exactly_right": "pairs exactly right",
    "confidently_wrong": "confidently wrong",
    "false_alarm_healthy": "false alarms, healthy",
    "single_truth_among_names": "truth among the names (single)",
    "says_it_cannot_tell": "says it cannot tell",
    "holdout_over_floor": "held-out misfit over noise, median (95 %)",
    "seconds": "time per case, median",
}
HTML = """<table class="compare">
<caption>{{ note }}</caption>
<thead><tr>{% for cell in rows[0] %}<th>{{ cell }}</th>{% endfor %}</tr></thead>
<tbody>
{% for row in rows[1:] %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</tbody>
</table>
"""


def _cell(name, figure):
    if name == "seconds":
        return "-" if figure["median"] is None else f"{figure['median']:.2g} s"
    if name == "holdout_over_floor":
        return "-" if figure["median"] is None else f"{figure['median']:.3g} ({figure['p95']:.3g})"
    if not figure["n"]:
        return "-"
    low, high = 100.0 * figure["low"], 100.0 * figure["high"]
    return f"{100.0 * figure['value']:.0f} % ({low:.0f} to {high:.0f})"


def rows(result: dict) -> list[list[str]]:
    """Heading and one row per method, as text; intervals are Wilson's."""
    out = [["method", *COLUMNS.values()]]
    for name, title in TITLES.items():
        f = result["methods"][name]
        out.append([title, *(_cell(column, f[column]) for column in COLUMNS)])
    return out


def note(result: dict) -> str:
    """The conditions of the table."""
    c, seed = result["cases"], result["tuned_on_seed"]
    return (
        f"Sealed cases of seed {result['seed']}: {c['single']} single effects, {c['pair']} pairs, "
        f"{c['healthy']} healthy drives. The other methods use the preparation and balance of the diagnosis, "
        f'and thresholds tuned for the most correct names on seed {seed}. "Named right" counts identifiable effects; '
        "95 % intervals in brackets."
    )


def markdown(result: dict) -> str:
    """A Markdown table with its note."""
    head, *body = rows(result)
    lines = [" | ".join(head), " | ".join(["---"] * len(head)), *(" | ".join(row) for row in body)]
    return note(result) + "\n\n" + "\n".join(f"| {line} |" for line in lines) + "\n"


def html(result: dict) -> str:
    """A <table> to be placed in a page."""
    return Environment(autoescape=True).from_string(HTML).render(rows=rows(result), note=note(result))
