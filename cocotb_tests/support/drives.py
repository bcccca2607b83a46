# SPDX-License-Identifier: BSD-3-Clause
"""The drives of the tests: files in docs/drives, changed ones, and the numbers of the machine of most tests.

PAPER is the drive of Zanuso, Peretti, Zigliotto (IET EPA 2015); R to PAIRS are its machine and bus, PLAIN a file with
no more than these.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fluxproof.checkout import DRIVES
from fluxproof.command import main
from golden_model.drive import load
from golden_model.registers import registers

PAPER = DRIVES / "paper001.toml"
DRIVE_FILES = sorted(DRIVES.glob("*.toml"))
each_drive = pytest.mark.parametrize("path", DRIVE_FILES, ids=lambda p: p.stem)

R, L_D, L_Q, PSI, RATED, BUS, PAIRS = 1.53, 0.01607, 0.01581, 0.165, 5.23, 563.0, 4  # ohm, H, H, Wb, A, V
PLAIN = f"""[machine]
pole_pairs = {PAIRS}
resistance_ohm = {R}
inductance_d_h = {L_D}
inductance_q_h = {L_Q}
magnet_flux_wb = {PSI}
rated_current_a = {RATED}
[inverter]
dc_bus_v = {BUS}
pwm_frequency_hz = 10000.0
"""


def edited(tmp_path: Path, section: str | None, line: str | None = None, text: str | None = None) -> Path:
    """The paper's drive with ``line`` (key = value) set in a section, or ``text`` as the whole file."""
    if text is None:
        head, body, tail = re.split(rf"(?m)^\[{section}\]\n((?:(?!\[).*\n)*)", PAPER.read_text(), maxsplit=1)
        key = line.split("=")[0].strip()
        body = re.sub(rf"(?m)^{re.escape(key)} *=.*\n", "", body) + line + "\n"
        text = f"{head}[{section}]\n{body}{tail}"
    path = tmp_path / "drive.toml"
    path.write_text(text)
    return path


def row_of(path: Path, name: str):
    """The row of a register in the table of a drive file."""
    return next(r for r in registers(load(path)).rows if r.name == name)


def check_message(capsys, path: Path, words) -> None:
    """Exit status 2, nothing on stdout, one line on stderr with the file's name and the words."""
    assert main(["registers", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    for word in (str(path), *words):
        assert word in err
