# SPDX-License-Identifier: BSD-3-Clause
"""`make synth`: cells of three Xilinx families by group, longest paths, ECP5 by stock tools; see docs/synth.md.

    make synth                                            counts, structure and netlist, into build/synth
    make ecp5                                             the routed clock rate on ECP5, some minutes a seed
    python -m scripts.synth --block current_pi speed_pi   count these blocks alone, some seconds each
    python -m scripts.synth --board                       count each choice of a board's front ends
    python -m scripts.synth --only counts --update "svm shares its adder"    keep the new counts

Exit status: 0; 1 where a count is more than 3 % off the kept one; 2 where a tool fails or a name does not exist.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict

from fluxproof.checkout import BUILD
from fluxproof.files import write_json
from scripts.synth import board, ecp5, kept, levels, multipliers, report
from scripts.synth.count import Count
from scripts.synth.groups import BETWEEN, ROWS
from scripts.synth.parts import PARTS, STRUCTURE_FAMILY, Work, started
from scripts.synth.yosys import FAMILIES, Design, SynthesisFailed, version

OUT = BUILD / "synth"


def figures(groups: Mapping[str, Count | None], whole: Count) -> dict[str, dict | None]:
    """The rows of resources.json; null for a row whose blocks are not there, none where ``groups`` is empty."""
    rows = {name: groups[name].kept() if groups[name] else None for name in ROWS if groups}
    return {**rows, "total": whole.kept()}


def count_blocks(design: Design, names: list[str], families: list[str]) -> None:
    for family in families:
        print(f"{family}, each alone\n{report.table(design.blocks(names, family))}", flush=True)


def rows_of(groups: Mapping[str, Count | None], whole: Count) -> dict[str, Count | None]:
    """The lines of a family's table: groups and their sums where they were counted, the whole."""
    rows = {name: row for name, row in groups.items() if name != BETWEEN or row != Count()}
    if groups:
        total = report.sums(groups)
        rows |= {"sum": total["sum"], "FOC, SVM, gates": total["foc"]}
    return {**rows, "total, in one piece": whole}


def report_counts(design: Design, work: Work, families: list[str]) -> dict[str, dict]:
    """Prints each family's table, writes resources.json and its like; the figures to keep."""
    counted, to_keep, details = {}, {}, {}
    for family in families:
        groups = work.groups[family].result() if family in work.groups else {}
        whole = work.count_of(family)
        rows = rows_of(groups, whole)
        print(f"\n{family}\n{report.table(rows)}", flush=True)
        if family == STRUCTURE_FAMILY:
            print("\n".join(report.against_targets(groups)), flush=True)
        latches = [name for name, row in rows.items() if row and row.latches]
        if latches:
            raise SynthesisFailed(f"{family}: latches in {', '.join(latches)}")
        to_keep[family] = figures(groups, whole)
        if groups:
            counted[family] = groups
        details[family] = {name: asdict(row) if row else None for name, row in rows.items()}
    write_json(OUT / "resources.json", to_keep)
    write_json(OUT / "details.json", {"top": design.top, "tool": version(), "families": details})
    if counted:
        report.draw(counted, OUT / "resources.svg")
    print(f"\nwritten to {os.path.relpath(OUT)}: resources.json, details.json{', resources.svg' if counted else ''}")
    small = {name: row.kept() for name, row in work.small.result().items()}
    plain = work.plain.result()
    print(f"\n{STRUCTURE_FAMILY}, ESTIMATORS = 0\n{report.table({'the core, in one piece': plain})}", flush=True)
    return {
        **to_keep,
        f"{STRUCTURE_FAMILY}, block alone": small,
        f"{STRUCTURE_FAMILY}, ESTIMATORS = 0": {"total": plain.kept()},
    }


def report_structure(work: Work) -> None:
    """Prints the longest path of each block and the DSP48E1 without registers; writes paths.json."""
    _, netlist = work.structure.result()
    found, paths = multipliers.multipliers(netlist), levels.longest(netlist)
    print(f"\n{STRUCTURE_FAMILY}: {multipliers.table(found)}")
    print("\nlongest path to a register of each block, cells by kind")
    print(levels.table(paths), flush=True)
    by_block = {block or "top": asdict(path) for block, path in paths.items()}
    write_json(OUT / "paths.json", {"tool": version(), "dsp": multipliers.summary(found), "paths": by_block})


def report_ecp5(work: Work) -> None:
    seeds = [future.result() for future in work.seeds]
    summary = ecp5.summary(seeds)
    write_json(OUT / "timing.json", {"ecp5": summary})
    print("\n" + "\n".join([*map(str, seeds), ecp5.verdict(summary)]), flush=True)


def arguments_of() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__.split("\n\n")[0],
        epilog=__doc__.split("\n\n", 1)[1],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--block", nargs="+", metavar="ENTITY", help="count these entities alone, and stop; ENTITY:GENERIC=N"
    )
    parser.add_argument("--board", action="store_true", help="count each choice of a board's front ends, and stop")
    parser.add_argument("--family", nargs="+", choices=FAMILIES, metavar="FAMILY", help=f"of {', '.join(FAMILIES)}")
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, metavar="PART", help=f"of {', '.join(PARTS)}; default: all but ecp5"
    )
    parser.add_argument("--seeds", type=int, default=len(ecp5.SEEDS), help="how often to route on ECP5")
    parser.add_argument("--update", metavar="REASON", help="keep the new counts, with a reason")
    arguments = parser.parse_args()
    if arguments.seeds < 1:
        parser.error("--seeds needs at least 1; `--only` leaves the routing out")
    if arguments.update is not None and arguments.only and "counts" not in arguments.only:
        parser.error("--update needs the counts: `--only counts`")
    return arguments


def check_counts(counted: dict[str, dict], reason: str | None) -> int:
    """Keeps the counts where there is a ``reason``; else the exit status that tells whether they are as kept."""
    if reason is not None:
        moved = kept.update(counted, reason, version())
        print("\n".join([f"kept in {os.path.relpath(kept.KEPT)}; changed by more than 3 %:", *moved]))
        return 0
    off = kept.changes(kept.read()["counts"], counted)
    if off:
        said = "synth: more than 3 % off the kept counts; `--update REASON` keeps the new ones"
        print("\n".join([said, *(f"  {line}" for line in off)]), file=sys.stderr)
    return 1 if off else 0


def main() -> int:
    arguments = arguments_of()
    began = time.monotonic()
    parts = arguments.only or [part for part in PARTS if part != "ecp5"]
    status = 0
    try:
        if arguments.board:
            for family in arguments.family or ["xc7"]:
                print(f"{family}, each alone\n{report.table(board.counts(family))}", flush=True)
            return 0
        design = Design()
        if arguments.block:
            count_blocks(design, arguments.block, arguments.family or ["xc7"])
            return 0
        families = arguments.family or list(FAMILIES)
        with started(design, families, parts, range(1, arguments.seeds + 1)) as work:
            if "counts" in parts:
                status = check_counts(report_counts(design, work, families), arguments.update)
            if "structure" in parts:
                report_structure(work)
            if "ecp5" in parts:
                report_ecp5(work)
            if "netlist" in parts:
                print(f"\n{work.netlist.result()}", flush=True)
    except (RuntimeError, ValueError) as reason:
        print(f"synth: {reason}", file=sys.stderr)
        return 2
    finally:
        print(f"{time.monotonic() - began:.0f} s", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
