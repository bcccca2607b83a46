# SPDX-License-Identifier: BSD-3-Clause
"""report.html of the benchmark: figures with their targets, strata, effects, confusion table, failures."""

from __future__ import annotations

from jinja2 import Environment

HEADS = (
    "single_named_right", "pairs_exactly_right", "triples_exactly_right", "confidently_wrong", "false_alarm_healthy",
    "truth_inside_ambiguity", "unknown_recognised", "median_time_s",
)  # fmt: skip

TEMPLATE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Blind benchmark</title>
<style>body{font:15px/1.45 sans-serif;max-width:1200px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:.6em 0 1.6em}td,th{border-bottom:1px solid #ddd;
padding:.2em .6em;text-align:right}
td:first-child,th:first-child{text-align:left}.met{color:#0a7a2f}.missed{color:#b00020;font-weight:bold}
.wide{overflow-x:auto;font-size:12px}.diagonal{background:#d9f0dd}.off{background:#fbdcdc}
th.up{writing-mode:vertical-rl;transform:rotate(180deg);text-align:left}</style>
<h1>Blind benchmark of the diagnosis</h1>
<p>Seed {{ r.seed }}, {{ r.cases_total }} cases; truth sealed before the run,
SHA-256 <code>{{ r.sha256 }}</code>.
{% if r.times %}{{ '%.1f' % r.times.median_s }} s a case (median),
{{ '%.1f' % r.times.max_s }} s at most.{% endif %}</p>
<h2>Figures</h2><table><tr><th>figure<th>value<th>95 % interval<th>cases<th>target<th></tr>
{% for name, f in r.figures.items() %}<tr><td>{{ name }}<td>{{ number(f.value) }}
<td>{% if f.low is defined %}{{ number(f.low) }} to {{ number(f.high) }}{% endif %}
<td>{% if f.k is defined %}{{ f.k }} of {% endif %}{{ f.n }}<td>{{ f.target if f.target is defined else '' }}
<td>{% if f.met is defined %}
<span class="{{ 'met' if f.met else 'missed' }}">{{ 'met' if f.met else 'missed' }}</span>
{% endif %}</tr>{% endfor %}</table>
{% if r.generators is defined %}<h2>Generators</h2><table><tr><th>generator<th>cases
{% for name in heads %}<th>{{ name.replace('_', ' ') }}{% endfor %}</tr>
{% for name, g in r.generators.items() %}<tr><td>{{ name }}, seed {{ g.seed }}<td>{{ g.cases_total }}
{% for key in heads %}{% set f = g.figures[key] %}<td>{{ number(f.value) }}
{% if f.k is defined %}({{ f.k }} of {{ f.n }}){% endif %}{% endfor %}</tr>{% endfor %}</table>
{% for name, g in r.generators.items() %}{{ diagram(name, g.reliability) | safe }}{% endfor %}{% endif %}
<h2>Reliability of the confidence</h2>{{ diagram(r.generator, r.reliability) | safe }}
<h2>The catalogue's functional form and others</h2><table><tr><th>figure<th>catalogue<th>other</tr>
{% for name in r.figures if name in r.by_form.catalogue or name in r.by_form.other %}<tr><td>{{ name }}
{% for kind in ('catalogue', 'other') %}{% set f = r.by_form[kind][name] %}
<td>{% if f %}{{ number(f.value) }} ({% if f.k is defined %}{{ f.k }} of {% endif %}{{ f.n }}){% endif %}
{% endfor %}</tr>{% endfor %}</table>
<h2>Strata</h2><table><tr><th>stratum<th>cases<th>identifiable<th>named right<th>tied, truth inside
<th>confidently wrong<th>verdicts</tr>
{% for name, s in r.by_stratum.items() %}<tr><td>{{ name }}<td>{{ s.cases }}<td>{{ s.identifiable }}
<td>{{ s.named_right.k }}<td>{{ s.inside_ambiguity.k }}<td>{{ s.confidently_wrong.k }}
<td>{% for v, k in s.verdicts.items() -%}
{{ v }} {{ k }}{{ ', ' if not loop.last }}{% endfor %}</tr>{% endfor %}</table>
<h2>Effects</h2><table><tr><th>effect<th>present<th>identifiable<th>of these asserted<th>tied<th>missed
<th>asserted where absent</tr>{% for name, e in r.by_effect.items() %}<tr><td>{{ name }}
{% for key in ('present', 'identifiable', 'identifiable_asserted',
 'identifiable_tied', 'identifiable_missed', 'false') %}
<td>{{ e.get(key, 0) }}{% endfor %}</tr>{% endfor %}</table>
<h2>Truth (rows) against what was asserted (columns)</h2><div class="wide"><table><tr><th>
{% for c in columns %}<th class="up">{{ c }}{% endfor %}</tr>
{% for name, row in r.confusion.items() %}<tr><td>{{ name }}{% for c in columns %}
<td{% if row.get(c) %}
 class="{{ 'diagonal' if c == name else 'off' if not c.startswith('(') else '' }}"{% endif %}>
{{ row.get(c, '') }}{% endfor %}</tr>{% endfor %}</table></div>
<h2>Cases that asserted something absent</h2><table><tr><th>case<th>stratum<th>truth<th>asserted<th>tied</tr>
{% for c in r.cases if c.wrong or c.error %}<tr><td>{{ c.case }}<td>{{ c.stratum }}
<td>{{ c.kind }}{% for e in c.truth %}{{ e.name }} ({{ e.form }}, {{ '%.2g' % e.size }}) {% endfor %}
<td>{{ c.error or c.asserted | join(', ') }}
<td>{% for g in c.ambiguity %}{{ g | join(' or ') }}; {% endfor %}</tr>
{% endfor %}</table></html>
"""


def _number(x):
    return "" if x is None else f"{x:.4g}"


def diagram(name: str, bins: list[dict]) -> str:
    """A reliability diagram as SVG: share of names that are right against the confidence stated."""
    low = 0.9  # the axes begin here; nothing is named below 0.95
    at = lambda p: 30.0 + 260.0 * (max(p, low) - low) / (1.0 - low)  # noqa: E731
    marks = []
    for b in bins:
        if b["n"]:
            x, (bottom, top) = at(b["stated"]), b["interval"]
            marks.append(f'<line x1="{x:.0f}" x2="{x:.0f}" y1="{320 - at(bottom):.0f}" y2="{320 - at(top):.0f}"/>')
            title = f"{b['k']} of {b['n']} right, stated {b['stated']:.3f}"
            marks.append(f'<circle cx="{x:.0f}" cy="{320 - at(b["value"]):.0f}" r="4"><title>{title}</title></circle>')
    axes = "".join(
        f'<text x="{at(p):.0f}" y="312">{p:g}</text><text x="2" y="{324 - at(p):.0f}">{p:g}</text>'
        for p in (0.9, 0.95, 1.0)
    )
    return (
        f'<svg width="320" height="330" font-size="11" stroke="none"><text x="40" y="14">{name}: names right'
        f' against confidence</text><g stroke="#999"><line x1="30" y1="290" x2="290" y2="30"/></g>{axes}'
        f'<g stroke="#0a5" fill="#0a5">{"".join(marks)}</g></svg>'
    )


def page(result: dict) -> str:
    """The whole report as one HTML text."""
    columns = list(result["confusion"])
    columns += sorted({c for row in result["confusion"].values() for c in row} - set(columns))
    columns = [c for c in columns if any(c in row for row in result["confusion"].values())]
    environment = Environment(autoescape=True, trim_blocks=True)
    return environment.from_string(TEMPLATE).render(
        r=result, columns=columns, number=_number, diagram=diagram, heads=HEADS
    )
