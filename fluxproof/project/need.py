# SPDX-License-Identifier: BSD-3-Clause
"""Whether a part has the LUT and DSP48 that a drive needs, counted by Yosys for 7 series: docs/synth.md, board.md."""

from __future__ import annotations

import re
from typing import NamedTuple

from golden_model.board_registers import has_board
from golden_model.drive import Drive


class Cells(NamedTuple):
    """Cells of a design or of a device."""

    lut: int
    dsp: int

    def __add__(self, other: tuple) -> Cells:  # pyright: ignore[reportIncompatibleMethodOverride]
        return Cells(self.lut + other[0], self.dsp + other[1])

    def fit(self, device: Cells) -> bool:
        """Whether the device has as many."""
        return self.lut <= device.lut and self.dsp <= device.dsp

    def __str__(self) -> str:
        return f"{self.dsp} DSP48 and {self.lut:,} LUT"


WHOLE = Cells(9073, 77)  # with estimators, registers, telemetry; a test compares these with docs/synth/counts.json
PLAIN, REGISTERS = Cells(4359, 29), Cells(1462, 0)  # the core alone without estimators; registers and telemetry
ENCODERS = {
    "code": Cells(0, 0), "abz": Cells(1515, 0), "hall": Cells(896, 0), "ssi": Cells(269, 1), "biss": Cells(320, 1),
    "endat": Cells(316, 1),
}  # fmt: skip
CONVERTERS = {"codes": Cells(0, 0), "spi": Cells(442, 0), "xadc": Cells(156, 0), "delta_sigma": Cells(1133, 4)}
MASTER = Cells(338, 0)  # pins of a second encoder
BOARD = Cells(114 + 3 + 42 + 3 + 1510, 0)  # what else a board has, its registers for the core's
OPTIONS = {  # keys of [core] that build a block in, counted on the page of each
    "position_loop": Cells(816 + 269, 2), "gearing": Cells(801, 1), "references": Cells(1084, 6),
    "residual": Cells(2059, 1),
    "ring_rows": Cells(97, 0), "modes": Cells(5 + 353, 0), "overmodulation": Cells(327 + 76 + 552, 11),
}  # fmt: skip
MOTOR = Cells(4461, 32)  # motor_bench without its registers: docs/hil.md

# Device of the vendor's tables: LUT, DSP48
DEVICES = {
    "xc7z007s": Cells(14400, 66), "xc7z010": Cells(17600, 80), "xc7z012s": Cells(34400, 120),
    "xc7z014s": Cells(40600, 170), "xc7z015": Cells(46200, 160), "xc7z020": Cells(53200, 220),
    "xc7z030": Cells(78600, 400), "xc7z035": Cells(171900, 900), "xc7z045": Cells(218600, 900),
    "xc7z100": Cells(277400, 2020),
    "xc7s6": Cells(3750, 10), "xc7s15": Cells(8000, 20), "xc7s25": Cells(14600, 80), "xc7s50": Cells(32600, 120),
    "xc7s75": Cells(48000, 140), "xc7s100": Cells(64000, 160),
    "xc7a12t": Cells(8000, 40), "xc7a15t": Cells(10400, 45), "xc7a25t": Cells(14600, 80), "xc7a35t": Cells(20800, 90),
    "xc7a50t": Cells(32600, 120), "xc7a75t": Cells(47200, 180), "xc7a100t": Cells(63400, 240),
    "xc7a200t": Cells(134600, 740),
    "xc7k70t": Cells(41000, 240), "xc7k160t": Cells(101400, 600), "xc7k325t": Cells(203800, 840),
    "xczu1eg": Cells(37440, 216), "xczu2eg": Cells(47232, 240), "xczu2cg": Cells(47232, 240),
    "xczu3eg": Cells(70560, 360), "xczu3cg": Cells(70560, 360), "xczu4ev": Cells(87840, 728),
    "xczu5ev": Cells(117120, 1248),
}  # fmt: skip
DEVICE = re.compile(r"(x[caq]7[zsak]\d+[st]?|x[caq]zu\d+[a-z]{2})")


def device_of(part: str) -> str | None:
    """The device of a part's name in the table, grades of the car and defence industry included; None: not there."""
    found = DEVICE.match(part)
    if found is None:
        return None
    name = "xc" + found[1][2:]
    return name if name in DEVICES else None


def need(drive: Drive, estimators: bool, hil: bool = False) -> Cells:
    """What the drive takes of a 7 series device, about; hil: with a motor in the FPGA."""
    cells = WHOLE if estimators else PLAIN + REGISTERS
    for key, block in OPTIONS.items():
        if getattr(drive.core, key):
            cells = cells + block
    if hil:
        cells = cells + MOTOR
    if has_board(drive) or hil:
        cells = cells + ENCODERS[drive.encoder.kind] + CONVERTERS[drive.converters.kind] + BOARD
    if drive.position.gear_master_counts is not None:
        cells = cells + MASTER
    return cells


def judged(drive: Drive, part: str, hil: bool = False) -> tuple[bool, str]:
    """(whether it fits, in words): True where the part is not in the table."""
    needed, device = need(drive, drive.core.estimators, hil), device_of(part)
    if device is None:
        return True, f"needs about {needed}; what {part} has is not known here"
    has = DEVICES[device]
    if needed.fit(has):
        return True, f"needs about {needed}; {device} has {has}"
    said = f"needs about {needed}, {device} has {has}: it does not fit"
    without = need(drive, False, hil)
    if drive.core.estimators and without.fit(has):
        return False, f"{said}; [core] estimators = false needs {without}"
    larger = next(name for name in DEVICES if name[:4] == device[:4] and needed.fit(DEVICES[name]))
    return False, f"{said}; {larger} is large enough"
