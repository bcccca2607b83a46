"""``make package``: what a Xilinx project takes the core by; ``--check`` only compares with what is committed.

component.xml and xgui/ make the repository's root an IP repository of Vivado, fluxproof.core makes it one of FuseSoC,
rtl/fluxproof_axi.vhd is the top of both.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from scripts.files import write_text
from scripts.package import axi_top, fusesoc_core, ipxact, xgui
from scripts.sources import ROOT

# In this order: the others read the top's entity.
FILES: dict[Path, Callable[[], str]] = {
    axi_top.PATH: axi_top.render,
    ipxact.PATH: ipxact.render,
    xgui.PATH: xgui.render,
    fusesoc_core.PATH: fusesoc_core.render,
}


def stale() -> list[Path]:
    """The committed files that differ from what would be written now."""
    return [path for path, render in FILES.items() if not path.exists() or path.read_text() != render()]


def write() -> None:
    """Write them all, each in one step."""
    for path, render in FILES.items():
        text = render()
        write_text(path, text)
        print(f"wrote {path.relative_to(ROOT)}, {len(text.splitlines())} lines")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m scripts.package", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--check", action="store_true", help="fail if a committed file is stale, write nothing"
    )
    if not parser.parse_args().check:
        write()
        return 0
    old = stale()
    for path in old:
        print(f"{path.relative_to(ROOT)} is stale: run `make package` and commit it", file=sys.stderr)
    return 1 if old else 0


if __name__ == "__main__":
    sys.exit(main())
