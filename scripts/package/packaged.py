# SPDX-License-Identifier: BSD-3-Clause
"""Every committed packaging file as text; see scripts/generate.py."""

from __future__ import annotations

from pathlib import Path

from fluxproof.checkout import RTL
from scripts.package import axi_top, board_top, fusesoc_core, hil_top, ipxact, xgui


def files(rtl: Path = RTL) -> dict[Path, str]:
    """{path: text}: the tops and their descriptions for Vivado and FuseSoC.

    ``rtl`` contains the entities of the top.  The top itself need not exist yet.
    """
    top = axi_top.render(rtl)
    return {
        axi_top.PATH: top,
        board_top.BOARD.path: axi_top.render(rtl, board_top.BOARD),
        hil_top.HIL.path: axi_top.render(rtl, hil_top.HIL),
        ipxact.PATH: ipxact.render(top, rtl),
        xgui.PATH: xgui.render(top),
        fusesoc_core.PATH: fusesoc_core.render(rtl),
    }
