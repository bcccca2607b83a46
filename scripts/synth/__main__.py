"""`make synth`: resources by group for three Xilinx families and routed timing on ECP5; see docs/synth.md.

    python -m scripts.synth --block current_pi speed_pi     a quick count of blocks, some seconds each
"""

from __future__ import annotations

import argparse
import os
import sys

from scripts.synth.yosys import FAMILIES, Design, SynthesisFailed

COLUMNS = ("lut", "ff", "dsp", "bram", "lut_memory", "muxf", "carry_bits", "latches")


def table(rows) -> str:
    """``rows`` = [(name, Count)]: a line each."""
    lines = [f"{'':34}" + "".join(f"{c:>11}" for c in COLUMNS)]
    for name, row in rows:
        lines.append(f"{name:34}" + "".join(f"{getattr(row, c):11g}" for c in COLUMNS))
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--block", nargs="+", metavar="ENTITY", help="count these entities alone, and stop")
    parser.add_argument("--family", nargs="+", choices=FAMILIES, default=list(FAMILIES), metavar="FAMILY")
    arguments = parser.parse_args()
    try:
        design = Design()
        if arguments.block:
            families = arguments.family if len(arguments.family) < len(FAMILIES) else ["xc7"]
            for family in families:
                counts = design.blocks(arguments.block, family)
                print(f"{family}\n{table(counts.items())}")
            return 0
        for family in arguments.family:
            groups = design.groups(family)
            whole = design.whole(family)
            print(f"{family}\n{table([*groups.items(), ('total', whole)])}")
            print(table([("plain foc", design.plain_foc(family))]))
        return 0
    except (SynthesisFailed, ValueError) as reason:
        print(f"synth: {reason}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
