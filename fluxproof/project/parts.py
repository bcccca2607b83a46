# SPDX-License-Identifier: BSD-3-Clause
"""What the parts of Xilinx's families need: processor, largest clock, addresses, interrupts."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fluxproof.quote import shown
from golden_model.drive_keys import DriveError

# A part's name: family, device, package with speed grade: xc7z020clg484-1, xczu3eg-sbva484-1-e, xc7a35ticsg324-1L.
PART = re.compile(r"x[caq][a-z]*[0-9][a-z0-9]*(-[a-z0-9]+)+", re.IGNORECASE | re.ASCII)
MOST_LETTERS = 64


@dataclass(frozen=True)
class Processor:
    """The processor beside the fabric, as the device tree describes it.

    ``base``: default address of the registers; ``interrupt``: number of the first fabric interrupt, shared ones
    counted from 0; ``clock``: phandle and number of the fabric clock; ``cells``: 32-bit words of an address.
    """

    name: str
    base: int
    interrupt: int
    controller: str
    clock: str
    cells: int
    most_hz: float


ZYNQ = Processor("Zynq-7000", 0x43C00000, 29, "&intc", "&clkc 15", 1, 250e6)
ZYNQMP = Processor("Zynq UltraScale+", 0xA0000000, 89, "&gic", "&zynqmp_clk 71", 2, 500e6)
PROCESSORS = {"xc7z": ZYNQ, "xa7z": ZYNQ, "xq7z": ZYNQ, "xczu": ZYNQMP, "xazu": ZYNQMP, "xqzu": ZYNQMP}


def checked(part: str) -> str:
    """The part's name in lower case; DriveError if it is none."""
    if len(part) > MOST_LETTERS or not PART.fullmatch(part):
        expected = "a full name like xc7z020clg484-1"
        raise DriveError(f"--part '{shown(part)}' is not a part of Xilinx: expected is {expected}")
    return part.lower()


def processor_of(part: str) -> Processor | None:
    """The processor of a part, or None."""
    return PROCESSORS.get(part[:4])
