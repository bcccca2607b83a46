"""The folders of a checkout, for what builds, checks and studies the core; an installed package has none of them."""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# The VHDL under test.  Another tree, such as one with a planted defect, is named by the variable.
RTL = Path(os.environ.get("FLUXPROOF_RTL") or ROOT / "rtl").resolve()
BUILD = ROOT / "build"
DRIVES = ROOT / "docs" / "drives"


def recordings() -> Path:
    """The folder of the real recordings ($FLUXPROOF_RECORDINGS, by default ../shared/recordings); it may be absent."""
    return (ROOT / os.environ.get("FLUXPROOF_RECORDINGS", "../shared/recordings")).resolve()
