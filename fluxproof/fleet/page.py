# SPDX-License-Identifier: BSD-3-Clause
"""fleet.html: one file, no script, nothing loaded; the style is that of the diagnosis' report."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fluxproof.diagnosis.fleet.findings import Design, Findings
from fluxproof.diagnosis.fleet.groups import signature
from fluxproof.diagnosis.ground.quantities import measured, number, quantity
from fluxproof.diagnosis.report import page as diagnosis_page
from fluxproof.diagnosis.report import words
from fluxproof.files import write_text
from fluxproof.fleet import pictures
from fluxproof.quote import pages

PAGE, REPORTS = "fleet.html", "reports"
FOLDER = Path(__file__).resolve().parent
MOST_ROWS = 3000  # recordings of the table: beyond, those that are worth a look
MOST_PICTURES = 12


def write_page(out: Path, found: Findings) -> Path:
    """Write OUT/fleet.html."""
    return write_text(Path(out) / PAGE, render(found))


def render(found: Findings) -> str:
    """The page as one string."""
    context = {
        "found": found,
        "drives": found.drives,
        "headline": headline(found),
        "mood": "open" if any(d.outliers or d.drifts or d.groups for d in found.designs) or found.failed else "good",
        "verdicts": pictures.verdicts(found.verdicts) if found.verdicts else None,
        "meanings": {v: words.VERDICTS[v][1] for v in found.verdicts if v in words.VERDICTS},
        "designs": [design_view(n, d) for n, d in enumerate(found.designs)],
        "failed": found.failed,
        "number": number,
    }
    return pages(FOLDER, diagnosis_page.FOLDER).get_template("fleet.html").render(context).lstrip()


def headline(found: Findings) -> str:
    """The sentence that says what is worth a look."""
    outlying = sum(len(d.outliers) for d in found.designs)
    drifting = len({drift.serial for d in found.designs for drift in d.drifts})
    grouped = sum(len(d.groups) for d in found.designs)
    parts = [
        _count(outlying, "drive differs from the rest", "drives differ from the rest"),
        _count(drifting, "drifts", "drift"),
        _count(grouped, "group shares an unexplained residual", "groups share an unexplained residual"),
        _count(len(found.failed), "recording could not be used", "recordings could not be used"),
    ]
    said = ", ".join(part for part in parts if part) or "no drive differs"
    return f"{_count(found.count, 'recording', 'recordings')} of {_count(found.drives, 'drive', 'drives')}: {said}."


def _count(n, one, many) -> str:
    return f"{n} {one if n == 1 else many}" if n else ""


def design_view(n: int, design: Design) -> dict:
    """What the template shows of a design."""
    outlying = {
        (f.effect, f.parameter): {s for s, fs in design.outliers.items() for f in fs if f.effect == g.effect}
        for gs in design.outliers.values() for g in gs for f in [g]
    }  # fmt: skip
    drawn = design.populations[:MOST_PICTURES]
    return {
        "design": design,
        "populations": [population_view(pop) for pop in design.populations],
        "pictures": [
            pictures.population(pop, f"p{n}_{k}", outlying.get((pop.effect, pop.parameter), set()))
            for k, pop in enumerate(drawn)
        ],
        "common": {words.effect_text(e).title: words.percent(r) for e, r in design.common().items()},
        "outliers": [outlier_view(serial, fs, design) for serial, fs in design.outliers.items()],
        "drifts": [drift_view(d) for d in design.drifts],
        "drift_pictures": [pictures.drift(d, f"d{n}_{k}") for k, d in enumerate(design.drifts[:MOST_PICTURES])],
        "groups": [{"group": g, "picture": pictures.signature(g, f"g{n}_{k}")} for k, g in enumerate(design.groups)],
        "rows": recordings(design),
        "all": len(design.rows) <= MOST_ROWS,
    }


def population_view(pop) -> dict:
    """A row of the table of parameters."""
    return {
        "title": words.effect_text(pop.effect).title,
        "parameter": pop.parameter,
        "drives": len(pop.x),
        "mean": measured(pop.mean, pop.mean_sigma, pop.unit),
        "spread": quantity(pop.spread, pop.unit, 3),
        "relative": words.percent(pop.spread / abs(pop.mean)) if pop.mean else "–",
        "recording": quantity(float(np.median(pop.s)), pop.unit, 2),
        "faulty": words.percent(float(np.mean(1.0 - pop.inlier))),
    }


def outlier_view(serial, found, design) -> dict:
    """A drive that differs: its causes in words, its recordings with links."""
    return {
        "serial": serial,
        "causes": [cause(f) for f in found],
        "links": [link(row) for row in design.rows if row["serial"] == serial][-3:],
    }


def cause(finding) -> dict:
    """A finding in words."""
    title = words.effect_text(finding.effect).title
    value = measured(finding.value, finding.sigma, finding.unit) if np.isfinite(finding.value) else ""
    if np.isfinite(finding.z):
        others = f"the others {quantity(finding.mean, finding.unit)} ± {quantity(finding.spread, finding.unit, 2)}"
        why = f"{finding.parameter} {value}, {others}: {abs(finding.z):.1f} predictive σ away"
    else:
        why = f"few drives have it{f'; {finding.parameter} {value}' if value else ''}"
    return {"title": title, "why": why, "doubt": f"{finding.doubt:.1g}"}


def drift_view(d) -> dict:
    """A drift in words."""
    day = lambda t: t.strftime("%Y-%m-%d") if t else ""  # noqa: E731
    year = 365.25
    relative = d.line.b * year / d.line.a if d.line.a else float("nan")
    between = f" ({day(d.earliest) or 'long ago'} to {day(d.latest) or 'never'})" if d.reaches else ""
    return {
        "serial": d.serial,
        "parameter": d.parameter,
        "rate": measured(d.line.b * year, d.line.sigma * year, f"{d.unit}"),
        "relative": f"{100 * relative:+.3g} %".replace("-", "−"),
        "noticed": day(d.times[d.noticed]) if d.noticed is not None else "not yet by the sequential test",
        "limit": quantity(d.limit, d.unit) if d.limit is not None else "none",
        "reaches": f"{day(d.reaches)}{between}" if d.reaches else "no",
    }


def link(row) -> dict:
    """The link to a recording's own report, which `fluxproof fleet --report NAME` or --serve makes."""
    return {"name": row["recording"], "href": f"{REPORTS}/{row['key']}/report.html"}


def recordings(design: Design) -> list[dict]:
    """Rows of the table of recordings, those worth a look first."""
    notable = set(design.outliers) | {d.serial for d in design.drifts}
    grouped = {name for g in design.groups for name in g.recordings}
    out = []
    for row, weighed in zip(design.rows, design.weighed, strict=True):
        present = {} if weighed is None else weighed.present
        extras = sorted((e for e, p in present.items() if p >= 0.5), key=lambda e: -present[e])
        worth = row["serial"] in notable or row["recording"] in grouped or bool(signature(weighed))
        view = {
            **link(row),
            "serial": row["serial"] if row["serial"] != row["recording"] else "",
            "verdict": row["verdict"].replace("_", " "),
            "names": ", ".join(n["effect"] for n in row["names"]),
            "extras": ", ".join(f"{e} {weighed.present[e]:.2f}" for e in extras),
            "time": row["time"].strftime("%Y-%m-%d %H:%M") if row["time"] else "",
            "worth": worth,
        } if weighed is not None else {**link(row), "serial": row["serial"], "verdict": row["verdict"],
                                      "names": "", "extras": "", "time": "", "worth": True}  # fmt: skip
        out.append(view)
    out.sort(key=lambda r: (not r["worth"], r["name"]))
    return out if len(out) <= MOST_ROWS else [r for r in out if r["worth"]][:MOST_ROWS]
