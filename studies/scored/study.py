# SPDX-License-Identifier: BSD-3-Clause
"""Run the cases of a study, judge them, print the table, write result.json's part and the page."""

from __future__ import annotations

import sys
from pathlib import Path

from jinja2 import Environment

from fluxproof.files import write_text
from golden_model.drive_file import read_tables
from golden_model.drive_keys import DriveError
from studies.scored.answers import Job, answers, job_of, kept_answers
from studies.scored.judge import headline_of, judge
from studies.scored.truth import JUDGES, USEFUL, Case

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>{{ title }}</title>
<style>body{font:15px/1.45 sans-serif;max-width:1200px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse}td,th{border-bottom:1px solid #ddd;padding:.3em .6em;text-align:left;vertical-align:top}
.wrong{color:#b00020;font-weight:bold}.right,.covering{color:#0a7a2f}small{color:#555}</style>
<h1>{{ title }}</h1>
<p>{{ cases | length }} cases: {% for name, n in counts.items() %}{{ n }} {{ name }}{{ ', ' if not loop.last }}
{%- endfor %}. Useful: {{ '%.0f' % (100 * useful) }} %.</p>
<table><tr><th>case<th>judge<th>true<th>answered</tr>
{% for c in cases %}<tr><td>{{ c.name }}<td class="{{ c.judge }}">{{ c.judge }}<br><small>{{ c.why }}</small>
<td>{{ c.truth }}<td>{{ c.answer.says }}<br><small>{{ c.answer.verdict }}; {{ c.answer.seconds }} s</small></tr>
{% endfor %}</table></html>
"""


def scored(cases: list[Case], out: Path, workers: int, whole: bool, again=False) -> dict:
    """{"cases": [{name, truth, answer, judge, why}], "counts", "useful"}, in the order of the cases.

    whole: each answer with its report, in out/NAME.  again: judge the newest answers that are kept, also of other code,
    and diagnose nothing.  A case without its recording, or then without its answer, is left out.
    """
    jobs: list[Job] = []
    for case in cases:
        try:
            recordings, drive = case.files(out / "files" / case.name)
        except FileNotFoundError as error:
            print(f"{case.name}: skipped, {error.filename} is missing", file=sys.stderr)
            continue
        jobs.append(job_of(case.name, recordings, drive, out / case.name if whole else None, out / "kept"))
    truths, found = {case.name: case.truth for case in cases}, {}
    for job, answer in kept_answers(jobs) if again else answers(jobs, workers):
        found[job.name] = entry = judged(job, answer, truths[job.name])
        print(f"{entry['judge']:13s} {job.name}: {entry['why']}", flush=True)
    return summary([found[job.name] for job in jobs if job.name in found])


def judged(job: Job, answer: dict, truth) -> dict:
    """The entry of one case."""
    try:
        machine = read_tables(job.drive).get("machine", {})
    except DriveError:  # no TOML, which the answer says too
        machine = {}
    word, why = judge(answer, truth, machine)
    says = answer.get("refused") or answer.get("crash") or headline_of(answer)
    verdict = answer.get("verdict") or ("refused" if "refused" in answer else "crash")
    short = {"verdict": verdict, "says": says, "seconds": answer["seconds"]}
    short |= {key: answer[key] for key in ("effects", "ambiguity", "conventions") if answer.get(key)}
    return {"name": job.name, "truth": truth.told(), "answer": short, "judge": word, "why": why}


def summary(entries: list[dict]) -> dict:
    """Entries with their counts and the share of useful ones."""
    counts = {name: sum(e["judge"] == name for e in entries) for name in JUDGES}
    useful = sum(counts[name] for name in USEFUL) / max(len(entries), 1)
    return {"cases": entries, "counts": counts, "useful": round(useful, 4)}


def print_counts(result: dict) -> None:
    """The counts in one line."""
    counts = ", ".join(f"{n} {name}" for name, n in result["counts"].items())
    print(f"{len(result['cases'])} cases: {counts}; useful {100 * result['useful']:.0f} %")


def write_page(result: dict, path: Path, title: str) -> Path:
    """The table as a page."""
    return write_text(path, Environment(autoescape=True).from_string(PAGE).render(title=title, **result))
