# SPDX-License-Identifier: BSD-3-Clause
"""Folders of a checkout, for building, checking and studying the core; absent in an installed package."""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# The VHDL under test; the variable selects another tree, for example one with a planted defect.
RTL = Path(os.environ.get("FLUXPROOF_RTL") or ROOT / "rtl").resolve()
BUILD = ROOT / "build"
DRIVES = ROOT / "docs" / "drives"


def recordings() -> Path:
    """The folder of the real recordings ($FLUXPROOF_RECORDINGS, by default ../shared/recordings); it may be absent."""
    return (ROOT / os.environ.get("FLUXPROOF_RECORDINGS", "../shared/recordings")).resolve()
