# SPDX-License-Identifier: BSD-3-Clause
"""A generator for FuseSoC: converts the top of fluxproof.core to Verilog with GHDL 5 (fluxproof/cosim/verilog.py).

FuseSoC starts it in an empty folder with the name of a YAML file; it writes NAME.v and a core file for it.
"""

from __future__ import annotations

import sys
from pathlib import Path

CORE = """\
CAPI=2:
name: {vlnv}
filesets:
  verilog:
    file_type: verilogSource
    files: [{file}]
targets:
  default:
    filesets: [verilog]
"""


def main(configuration: Path) -> None:
    """``configuration``: FuseSoC's YAML with files_root, vlnv and parameters.top."""
    import yaml

    given = yaml.safe_load(configuration.read_text())
    sys.path.insert(0, given["files_root"])  # FuseSoC may start this file in any folder
    from fluxproof.cosim.sources import rtl_sources
    from fluxproof.cosim.verilog import NoUsableGhdl, synthesize

    top = given["parameters"]["top"]
    sources = rtl_sources(Path(given["files_root"]) / "rtl")
    try:
        Path(f"{top}.v").write_text(synthesize(sources, top, {}))
    except (NoUsableGhdl, RuntimeError) as reason:
        sys.exit(f"verilog_generator: {reason}")
    Path(f"{top}.core").write_text(CORE.format(vlnv=given["vlnv"], file=f"{top}.v"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
