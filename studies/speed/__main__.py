# SPDX-License-Identifier: BSD-3-Clause
"""``make speed``: every figure of the speed range as build/studies/speed_range.json, and a page with pictures.

The Brusa map is not part of the project; its figures come where FLUXPROOF_RECORDINGS names the folder that has it.
"""

from __future__ import annotations

import base64
import io
import sys
from html import escape

import numpy as np
from matplotlib.figure import Figure

from fluxproof.checkout import BUILD
from fluxproof.cosim.runs import InVerilator, Named
from fluxproof.files import write_json, write_text
from golden_model.torque_table import Plane
from studies.speed import figures, overmodulation

OUT = BUILD / "studies"
PERIODS, CARRIER_HALF = 3000, 128  # of the comparison with the RTL


def rtl() -> list[dict]:
    """The RTL against the golden core over the border and in the speed loop."""
    rows = []
    for name in ("over_the_border", "over_the_hexagon", "speed_loop"):
        job = InVerilator(f"speed_{name}", Named(f"studies.speed.drives:{name}", (CARRIER_HALF, PERIODS)))
        job.carry_out()
        counts = job.summary()
        different = counts.get("differences", PERIODS) if job.problem else 0
        rows.append(figures.row(f"RTL, {name}", f"differences in {PERIODS} periods", different, 0, "1"))
        clocks = counts.get("sample_to_duty_clocks", 0)
        rows.append(figures.row(f"RTL, {name}", "clocks from sample to duties", clocks, 39, "1"))
    return rows


def picture(curves: dict, sags: dict) -> str:
    """Torque against speed and the sag, as an image of the page."""
    figure = Figure(figsize=(10, 3.6 * len(curves)), layout="constrained")
    axes = figure.subplots(len(curves), 2, squeeze=False)
    for line, (name, data) in zip(axes, curves.items(), strict=True):
        line[0].plot(data["speed"], data["most"], "k-", linewidth=1, label="allowed by both circles")
        line[0].plot(data["speed"], data["torque"], "o", label="delivered")
        line[0].set(xlabel="speed [rad/s]", ylabel="torque [Nm]", title=name, ylim=(0, None))
        line[0].legend()
        line[1].plot(sags[name]["t"], sags[name]["current"], label="current / limit")
        line[1].plot(sags[name]["t"], sags[name]["torque"], label="torque / largest")
        line[1].set(xlabel="ms after the bus begins to sag by 20 %", xlim=(-10, 30), ylim=(-0.5, 1.6))
        line[1].legend()
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return base64.b64encode(stream.getvalue()).decode()


def page(rows: list[dict], image: str) -> str:
    """The page with the table of all figures."""
    cells = "".join(
        "<tr>"
        + "".join(f"<td>{escape(str(v))}</td>" for v in (*list(r.values())[:-1], "yes" if r["pass"] else "NO"))
        + "</tr>"
        for r in rows
    )
    head = "".join(f"<th>{name}</th>" for name in rows[0])
    return (
        "<!doctype html><meta charset=utf-8><title>Speed range</title><style>body{font:14px sans-serif;margin:2em}"
        "td,th{padding:2px 10px;text-align:left;border-bottom:1px solid #ddd}</style><h1>Speed range</h1>"
        f'<img src="data:image/png;base64,{image}" style="max-width:100%"><table><tr>{head}</tr>{cells}</table>'
    )


def main() -> int:
    """Measure, write list and page, print the list; 1 if a figure misses its target."""
    rows, curves, sags = [], {}, {}
    for case in figures.cases(figures.brusa()):
        plane = Plane(case.truth, case.drive.machine.pole_pairs, case.drive.current_limit_a)
        rows += [*figures.loss(case, plane), *figures.wrong_maps(case, plane), *figures.start(case, plane)]
        more, curves[case.name] = figures.curve(case, plane)
        rows += [*more, *figures.hostile(case, plane, 0.0), *figures.hostile(case, plane, 1e-3)]
        more, sags[case.name] = figures.sag(case, plane)
        rows += [*more, *overmodulation.gained(case, plane), *overmodulation.to_the_end(case, plane)]
    if "--no-rtl" not in sys.argv[1:]:
        rows += rtl()
    OUT.mkdir(parents=True, exist_ok=True)
    write_json(OUT / "speed_range.json", rows)
    write_text(OUT / "speed_range.html", page(rows, picture(curves, sags)))
    for r in rows:
        told = f"{'' if r['pass'] else 'MISS':5}{r['experiment']:42} {r['figure']:52}"
        print(f"{told} {r['ours']:>9g} {r['target']:>7g} {r['unit']}")
    missed = sum(not r["pass"] for r in rows)
    print(f"{len(rows) - missed} of {len(rows)} figures reach their target; {OUT / 'speed_range.html'}")
    return int(missed > 0)


if __name__ == "__main__":
    np.seterr(invalid="ignore")
    sys.exit(main())
