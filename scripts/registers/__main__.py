# SPDX-License-Identifier: BSD-3-Clause
"""`make registers`: HTML pages and the IP-XACT memory map from rtl/generated/fluxproof.rdl, into build/registers."""

from __future__ import annotations

import argparse
import os

from fluxproof.checkout import BUILD
from scripts.registers import export
from scripts.registers.compiled import compile_file, words
from scripts.registers.generated import RDL


def main() -> None:
    argparse.ArgumentParser(prog="python -m scripts.registers", description=__doc__).parse_args()
    top = compile_file(RDL)
    page = export.html(top, BUILD / "registers" / "html")
    xml = export.ipxact(top, BUILD / "registers" / "fluxproof.xml")
    print(f"{len(words(top))} registers: {os.path.relpath(page)}, {os.path.relpath(xml)}")


if __name__ == "__main__":
    main()
