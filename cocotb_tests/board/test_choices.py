# SPDX-License-Identifier: BSD-3-Clause
"""Every choice of front ends elaborates; each kind of encoder and converter brings samples to the core."""

from __future__ import annotations

import subprocess

import pytest

from fluxproof.cosim import ghdl
from golden_model.converters import current_front
from golden_model.encoders import position_front

CHOICES = [(encoder, encoder % len(current_front.KINDS)) for encoder in range(len(position_front.KINDS))]
CHOICES += [(1, currents) for currents in (0, 2, 3)]


@pytest.mark.parametrize(("encoder", "currents"), CHOICES)
def test_every_choice_elaborates(encoder, currents):
    """With other widths than the defaults, and without estimators; every second one with the gear and its master."""
    folder = ghdl.build("fluxproof_board")
    generics = {"ENCODER": encoder, "CURRENTS": currents, "ADC_BITS": 12, "POSITION_BITS": 18, "SPI_LINES": 2}
    generics |= dict.fromkeys(("POSITION_LOOP", "GEARING", "MASTER"), encoder % 2)
    given = [f"-g{name}={value}" for name, value in (generics | {"ESTIMATORS": 0}).items()]
    command = [str(folder / "fluxproof_board"), *given, "--stop-time=20ns", "--ieee-asserts=disable"]
    if not (folder / "fluxproof_board").exists():  # the mcode back end makes no program
        command = ["ghdl", "-r", "--std=08", "--work=top", f"--workdir={folder}", "fluxproof_board", *command[1:]]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_an_impossible_choice_is_refused():
    folder = ghdl.build("fluxproof_board")
    program = folder / "fluxproof_board"
    if not program.exists():
        pytest.skip("needs the program that GHDL's LLVM or GCC back end makes")
    done = subprocess.run([str(program), "-gENCODER=7", "--stop-time=20ns"], cwd=folder, capture_output=True, text=True)
    assert done.returncode != 0
