# SPDX-License-Identifier: BSD-3-Clause
"""What a test needs beyond the Python packages; it is skipped, with the reason, where that is absent."""

from __future__ import annotations

import shutil

import pytest

from fluxproof.cosim import verilog


def ghdl5_missing() -> str | None:
    """Why the VHDL cannot be converted and compiled here, or None."""
    try:
        verilog.find_ghdl()
    except RuntimeError as error:
        return str(error)
    return None if shutil.which("g++") else "g++ is not installed"


def skip_without_ghdl5() -> None:
    """Skips the test where the VHDL cannot be converted to Verilog and compiled."""
    reason = ghdl5_missing()
    if reason:
        pytest.skip(reason)
