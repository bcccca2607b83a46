"""`make synth`: resources by group for three Xilinx families and routed timing on ECP5; see docs/synth.md.

    make synth                                          everything, into build/synth
    python -m scripts.synth --block current_pi speed_pi   a quick count of blocks, some seconds each
    python -m scripts.synth --family xc7 --update "svm shares its adder"    keep the new counts

Exit status: 0; 1 where a count is more than 3 % off the kept one; 2 for a tool or a name that is not there.
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
from scripts.synth import ecp5, kept, report, timing
from scripts.synth.count import Count
from scripts.synth.groups import BETWEEN, ROWS
from scripts.synth.yosys import FAMILIES, Design, SynthesisFailed, version

OUT = BUILD / "synth"
SMALL = ("clarke", "gate_generation", "sincos")  # counted by the tests too


def figures(groups: Mapping[str, Count | None], whole: Count) -> dict[str, dict | None]:
    """The rows of resources.json; null for a row whose blocks are not there."""
    rows = {name: groups[name].kept() if groups[name] else None for name in ROWS}
    return {**rows, "total": whole.kept()}


def count_blocks(design: Design, names: list[str], families: list[str]) -> None:
    for family in families:
        print(f"{family}, each alone\n{report.table(design.blocks(names, family))}", flush=True)


def route_blocks(design: Design, names: list[str]) -> None:
    """Fmax and slowest path of each block alone on ECP5, one seed: the list of what to shorten."""
    for name in names:
        verilog, modules = design.modules(name)
        for module in modules:
            routed = ecp5.Routing(verilog, module).route(1)
            print(f"{routed.fmax_mhz:6.1f} MHz  {module:26} {routed.path}", flush=True)


def count_all(design: Design, families: list[str]) -> tuple[dict[str, dict], dict[str, dict]]:
    """(the figures to keep, {family: logic-only delay}); prints each family as it is done."""
    counted, to_keep, details, delays = {}, {}, {}, {}
    for family in families:
        groups = design.groups(family)
        whole, delays[family] = design.whole(family)
        plain = design.plain_foc(family)
        total = report.sums(groups)
        rows = {
            **{name: row for name, row in groups.items() if name != BETWEEN or row != Count()},
            "sum": total["sum"],
            "total, in one piece": whole,
            "FOC, SVM, gates: sum": total["foc"],
            "the same in one piece": plain,
        }
        print(f"\n{family}\n{report.table(rows)}", flush=True)
        print(f"longest path, cells only: {delays[family]['logic_ns']:.2f} ns (a trend, no routing)")
        if family == "xc7":
            print("\n".join(report.against_targets(groups)), flush=True)
        latches = [name for name, row in rows.items() if row and row.latches]
        if latches:
            raise SynthesisFailed(f"{family}: latches in {', '.join(latches)}")
        counted[family], to_keep[family] = groups, figures(groups, whole)
        details[family] = {name: asdict(row) if row else None for name, row in rows.items()}
    write_json(OUT / "resources.json", to_keep)
    write_json(OUT / "details.json", {"top": design.top, "tool": version(), "families": details})
    print(f"\n{os.path.relpath(report.draw(counted, OUT / 'resources.svg'))}, resources.json, details.json")
    small = {name: row.kept() for name, row in design.blocks(SMALL, "xc7").items()}
    return {**to_keep, "xc7, block alone": small}, delays


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__.split("\n\n")[0],
        epilog=__doc__.split("\n\n", 1)[1],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--block", nargs="+", metavar="ENTITY", help="count these entities alone, and stop")
    parser.add_argument("--route", nargs="+", metavar="ENTITY", help="route these alone on ECP5, and stop")
    parser.add_argument(
        "--family", nargs="+", choices=FAMILIES, metavar="FAMILY", help=f"of {', '.join(FAMILIES)}"
    )
    parser.add_argument(
        "--seeds", type=int, default=timing.LEAST_SEEDS, help="how often to route on ECP5 (default 5, 0: not)"
    )
    parser.add_argument("--update", metavar="REASON", help="keep the new counts, with a reason")
    arguments = parser.parse_args()
    began = time.monotonic()
    try:
        design = Design()
        if arguments.block:
            count_blocks(design, arguments.block, arguments.family or ["xc7"])
            return 0
        if arguments.route:
            route_blocks(design, arguments.route)
            return 0
        to_keep, delays = count_all(design, arguments.family or list(FAMILIES))
        if arguments.seeds:
            ecp5_part = timing.routed(design, range(1, arguments.seeds + 1))
            write_json(OUT / "timing.json", {"ecp5": ecp5_part, **delays})
            print(timing.verdict(ecp5_part), flush=True)
        if arguments.update is not None:
            moved = kept.update(to_keep, arguments.update, version())
            print("\n".join([f"kept in {os.path.relpath(kept.KEPT)}; changed by more than 3 %:", *moved]))
            return 0
        off = kept.changes(kept.read()["counts"], to_keep)
    except (RuntimeError, ValueError) as reason:
        print(f"synth: {reason}", file=sys.stderr)
        return 2
    finally:
        print(f"{time.monotonic() - began:.0f} s", file=sys.stderr)
    if off:
        print(
            "synth: more than 3 % off the kept counts; `--update REASON` keeps the new ones", file=sys.stderr
        )
        print("\n".join(f"  {line}" for line in off), file=sys.stderr)
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main())
