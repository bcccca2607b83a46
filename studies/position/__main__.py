# SPDX-License-Identifier: BSD-3-Clause
"""``make position``: every figure of the position loop as build/studies/position.json, and in the terminal.

``make position ARGS=gears``: those of a part alone, in the terminal.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from fluxproof.checkout import BUILD
from fluxproof.cosim.runs import InVerilator, Named
from fluxproof.files import write_json
from studies.position import figures, gears, modes

PERIODS, CARRIER_HALF = 3000, 128  # of the comparison with the RTL


def rtl() -> Iterator[dict]:
    """The RTL against the golden core in all modes, through every change of a core with voltage mode, and in gear."""
    scenes = {"all modes": "drives:all_modes", "every change": "modes:every_change", "in gear": "gears:every_clutch"}
    for name, scene in scenes.items():
        run = Named(f"studies.position.{scene}", (CARRIER_HALF, PERIODS))
        job = InVerilator(f"position_{scene.partition(':')[2]}", run)
        job.carry_out()
        said = job.summary()
        different = said.get("differences", PERIODS) if job.problem else 0
        clocks = said.get("sample_to_duty_clocks", 99)
        yield figures.row(f"RTL, {name}", f"differences in {PERIODS} periods", different, 0, "1")
        yield figures.row(f"RTL, {name}", "clocks from sample to duties", clocks, 39, "1")


def parts() -> dict[str, Iterator[dict]]:
    """What is measured, by the names that the command takes."""
    return {
        "loop": figures.all_figures(),
        "modes": (one for built in (True, False) for name in figures.CASES for one in modes.rows_of(name, built)),
        "gears": (one for name in figures.CASES for one in gears.rows_of(name)),
        "rtl": rtl(),
    }


def main(arguments: list[str]) -> int:
    """All figures, or those of the parts named; exit status 1 where one misses its target."""
    rows, found = [], parts()
    if unknown := set(arguments) - set(found):
        print(f"{', '.join(sorted(unknown))} is no part: expected some of {', '.join(found)}", file=sys.stderr)
        return 2
    for part in arguments or found:
        for one in found[part]:
            rows.append(one)
            mark = "ok  " if one["pass"] else "MISS"
            target = "" if one["target"] == float("inf") else f" (target {one['target']:g})"
            print(f"{mark} {one['experiment']}: {one['figure']}: {one['ours']:.4g} {one['unit']}{target}", flush=True)
    if not arguments:
        listed = [{**one, "target": None if one["target"] == float("inf") else one["target"]} for one in rows]
        write_json(BUILD / "studies" / "position.json", listed)
    missed = sum(not one["pass"] for one in rows)
    print(f"{len(rows) - missed} of {len(rows)} figures reached")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
