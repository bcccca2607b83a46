# SPDX-License-Identifier: BSD-3-Clause
"""`make papers`: the experiments of the papers on the golden model with the switching plant, the key ones on the RTL.

Writes build/papers/flux.json and vsi.json, a picture of every figure and report.html.  Exit status 1 where a finding is
not what it must be, or the RTL differs from the golden model in any bit, in Verilator or in GHDL.
"""

from __future__ import annotations

import argparse
import base64
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import jinja2
import matplotlib as mpl

from fluxproof.checkout import BUILD
from fluxproof.files import write_json, write_text
from studies.demo import plots
from studies.demo.report import TEMPLATES
from studies.papers import (
    flux_beyond,
    flux_figures,
    flux_plots,
    flux_rtl,
    flux_stability,
    vsi_beyond,
    vsi_figures,
    vsi_plots,
)
from studies.papers.flux_bench import DRIVE, Experiment, Finding

FOLDER = BUILD / "papers"
FLUX = (*flux_figures.EXPERIMENTS, *flux_beyond.EXPERIMENTS, flux_stability.stability)
VSI = (*vsi_figures.EXPERIMENTS, *vsi_beyond.EXPERIMENTS)
EXPERIMENTS = (*FLUX, *VSI)
PLOTS = {**flux_plots.FIGURES, **vsi_plots.FIGURES}


def draw(name: str, experiment: Experiment) -> dict:
    """The figures of one experiment by name, under the one style."""
    with mpl.rc_context(plots.STYLE):
        return {f"{name}_{key}": figure for key, figure in PLOTS[name](experiment).items()}


def report(sections: list[dict], findings: list[Finding], seconds: float) -> str:
    """The page: every experiment with its findings and figures."""
    loader = jinja2.FileSystemLoader(TEMPLATES)
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True)
    good = sum(f.passed for f in findings)
    return environment.get_template("papers.html").render(
        sections=sections, good=good, total=len(findings), seconds=seconds
    )


def section(name: str, experiment: Experiment, figures: dict) -> dict:
    """One experiment for the page, its figures written as PNG beside it."""
    images = []
    for key, figure in figures.items():
        plots.write_png(figure, FOLDER / f"{key}.png")
        svg = plots.image(figure, "svg", metadata={"Date": None})
        images.append((key, base64.b64encode(svg).decode()))
    return {
        "name": name,
        "title": experiment.title,
        "rows": [f.row() for f in experiment.findings],
        "images": images,
    }


def tell(experiment: Experiment, seconds: float | None = None) -> None:
    """An experiment on the terminal as soon as it is there."""
    print(experiment.title + ("" if seconds is None else f"  ({seconds:.1f} s)"), flush=True)
    for found in experiment.findings:
        row = found.row()
        paper = "" if row["paper"] is None else f"   paper: {row['paper']}"
        print(
            f"  {'ok  ' if found.passed else 'FAIL'} {row['experiment']}: {row['ours']} {row['unit']}{paper}",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--no-rtl", action="store_true", help="golden model only, without Verilator and GHDL")
    arguments = parser.parse_args()
    began, sections = time.monotonic(), []
    findings: dict[str, list[Finding]] = {"flux": [], "vsi": []}
    keys = [] if arguments.no_rtl else [flux_rtl.KeyExperiment(name) for name in flux_rtl.runs(DRIVE)]
    with ThreadPoolExecutor(1) as pool:  # the RTL, in processes of its own, on one core; the golden model on the other
        running = [pool.submit(key.carry_out, lambda line: print(line, flush=True)) for key in keys]
        for paper, functions in (("flux", FLUX), ("vsi", VSI)):
            for function in functions:
                start = time.monotonic()
                experiment = function()
                tell(experiment, time.monotonic() - start)
                findings[paper] += experiment.findings
                sections.append(section(function.__name__, experiment, draw(function.__name__, experiment)))
        for key, future in zip(keys, running, strict=True):
            future.result()
            experiment = key.found()
            tell(experiment)
            findings["vsi" if key.name in flux_rtl.OF_VSI else "flux"] += experiment.findings
            sections.append(section(f"rtl_{key.name}", experiment, flux_plots.rtl(key.name, experiment)))
    every = [*findings["flux"], *findings["vsi"]]
    for paper, rows in findings.items():
        write_json(FOLDER / f"{paper}.json", [f.row() for f in rows])
    write_text(FOLDER / "report.html", report(sections, every, time.monotonic() - began))
    good = sum(f.passed for f in every)
    written = "build/papers/flux.json, vsi.json, report.html"
    seconds = time.monotonic() - began
    print(f"{good} of {len(every)} findings as they must be; wrote {written} ({seconds:.0f} s)")
    return 0 if good == len(every) else 1


if __name__ == "__main__":
    sys.exit(main())
