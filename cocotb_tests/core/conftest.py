# SPDX-License-Identifier: BSD-3-Clause
"""What several tests of the core need."""

import pytest

from fluxproof.cosim import verilog


@pytest.fixture(scope="module")
def ghdl5():
    """Skip if no suitable converter is installed."""
    try:
        return verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
