# SPDX-License-Identifier: BSD-3-Clause
"""Diagnose every case of a sealed benchmark, then open the truth and score it: `python -m studies.blind.score`.

Writes result.json (every figure with its Wilson interval) and report.html into the folder above the cases.
The truth is read only after the last diagnosis; its hash must be the sealed one.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import traceback
from pathlib import Path

from fluxproof.checkout import BUILD
from fluxproof.files import write_json, write_text
from fluxproof.fleet.engine import in_parallel
from fluxproof.fleet.work import key_of
from studies.blind import figures, tables
from studies.blind.again import resolve
from studies.blind.page import page
from studies.blind.reliability import reliability
from studies.blind.seal import SealError, truth_path, unseal


def answer_of(folder: Path) -> tuple[str, dict]:
    """(case, answer) of one case folder; a crash of the tool is an answer too, {"error": ...}."""
    from fluxproof.diagnosis import diagnose

    recording = recording_of(folder)
    began = time.perf_counter()
    try:
        answer = diagnose(recording, folder / "drive.toml").to_json()
        answer["seconds"] = time.perf_counter() - began
    except Exception as error:  # the benchmark counts exceptions and continues
        answer = {"error": f"{type(error).__name__}: {error}", "trace": traceback.format_exc(limit=-4)}
    return folder.name, json.loads(json.dumps(answer, default=float))


def _second_look(job):
    from fluxproof.diagnosis import diagnose

    try:
        return resolve(*job, diagnose)
    except Exception as error:
        return {
            "case": job[0]["case"],
            "asked": True,
            "resolved": False,
            "verdict": None,
            "effects": [],
            "error": f"{type(error).__name__}: {error}",
        }


def _answers(work: list[Path], jobs: int, kept: Path) -> dict[str, dict]:
    """{case: answer}; each is written as it comes, so that a run that was stopped goes on from there.

    kept: folder of the answers, each under a hash of the case and of the code that judges it.
    """
    keys = {case: key_of(str(recording_of(case)), str(case / "drive.toml")) for case in work}
    done = {case: path for case in work if (path := kept / f"{keys[case]}.json").exists()}
    for case, (_, answer) in in_parallel(answer_of, [c for c in work if c not in done], jobs, "diagnosed"):
        done[case] = write_json(kept / f"{keys[case]}.json", answer)
    return {case.name: json.loads(done[case].read_text()) for case in work}


def recording_of(folder: Path) -> Path:
    """The recording of a case folder."""
    return next(p for p in sorted(folder.iterdir()) if p.stem == "recording")


def score(folder: Path, jobs: int = 2, reuse: bool = False) -> dict:
    """Diagnose and score the benchmark in ``folder``; returns what it writes to result.json."""
    folder = Path(folder).resolve()
    if not (folder / "sealed.sha256").exists():
        raise SealError(f"{folder}/sealed.sha256: cannot be read; run python -m studies.blind.generate")
    kept = folder.parent / f"answers_{folder.name}.json"
    if reuse and kept.exists():
        answers = json.loads(kept.read_text())
    else:
        work = sorted(p for p in folder.iterdir() if p.name.startswith("case_"))
        answers = _answers(work, jobs, kept.with_suffix(""))
        write_json(kept, answers)
    truth = unseal(folder)
    cases = [(entry, answers[entry["case"]]) for entry in truth["cases"]]
    scratch = folder.parent / f"again_{folder.name}"
    ties = [
        (t, a, truth["seed"], folder, scratch)
        for t, a in cases
        if a.get("verdict") == "ambiguous" and t["effects"] and t.get("generator", "own") == "own"
    ]
    looks = [result for _, result in in_parallel(_second_look, ties, jobs, "recorded again")]
    resolved = sorted(looks, key=lambda r: r["case"])
    result = summary(cases, resolved)
    result.update(
        generator=truth.get("generator", "own"),
        seed=truth["seed"],
        cases_total=len(cases),
        sealed=truth_path(folder).name,
        sha256=(folder / "sealed.sha256").read_text().strip(),
    )
    write_json(folder.parent / "result.json", result)
    write_text(folder.parent / "report.html", page(result))
    return result


def summary(cases, resolved) -> dict:
    """The contents of result.json for (truth, answer) pairs."""
    return {
        "schema": 1,
        "figures": figures.figures(cases, resolved),
        "reliability": reliability(cases),
        "by_form": tables.by_form(cases, resolved),
        "by_stratum": tables.by_stratum(cases),
        "by_effect": tables.by_effect(cases),
        "confusion": tables.confusion(cases),
        "parameters": [e for t, a in cases for e in figures.parameter_errors(t, a)],
        "second_looks": list(resolved),
        "times": tables.times(cases),
        "cases": [_line(t, a) for t, a in cases],
    }


def _line(t, a):
    """Short record of one case, for the analysis of errors."""
    return {
        "case": t["case"],
        "stratum": t["stratum"],
        "kind": t["kind"],
        "identifiable": figures.identifiable(t),
        "truth": [{k: e[k] for k in ("name", "form", "size")} for e in t["effects"]],
        "verdict": a.get("verdict", "error"),
        "asserted": sorted(figures.asserted(a)),
        "ambiguity": a.get("ambiguity", []),
        "error": a.get("error"),
        "right": figures.named_right(t, a),
        "wrong": figures.confidently_wrong(t, a),
    }


def print_figures(result: dict):
    """Print the figures, one per line."""
    for name, f in result["figures"].items():
        if f.get("value") is None:
            print(f"{name:28s} no case")
            continue
        interval = f" [{f['low']:.3f}, {f['high']:.3f}] {f['k']} of {f['n']}" if "low" in f else f" n = {f['n']}"
        verdict = "" if "met" not in f else f"   target {f['target']}: {'met' if f['met'] else 'MISSED'}"
        print(f"{name:28s} {f['value']:.4g}{interval}{verdict}")


def main(arguments=None) -> int:
    """The command line; returns 0 when scored, 2 if the truth is missing or was changed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=BUILD / "blind" / "seed1")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--reuse", action="store_true", help="score the answers of the previous run again")
    options = parser.parse_args(arguments)
    try:
        print_figures(score(options.folder, options.jobs, options.reuse))
    except SealError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
