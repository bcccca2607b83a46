# SPDX-License-Identifier: BSD-3-Clause
"""docs/software/homing.c on an axis in C: the home from every side, and each refusal by its name."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from cocotb_tests.support.host.bring_up import SOFTWARE, STRICT
from fluxproof.checkout import ROOT

TURN = 1 << 18
SLOW = (1 << 18) * 10 >> 16  # of the bench's plan: way between two looks


@pytest.fixture(scope="module")
def axis(tmp_path_factory):
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler here")
    program = tmp_path_factory.mktemp("homing") / "homing_bus"
    source = ROOT / "cocotb_tests" / "support" / "host" / "homing_bus.c"
    done = subprocess.run(
        [compiler, *STRICT, f"-I{SOFTWARE}", str(source), "-o", str(program)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr

    def home(start, place, direction, at_index, fault="none"):
        told = [str(x) for x in (start, place, direction, int(at_index), fault)]
        words = subprocess.run([program, *told], capture_output=True, text=True, timeout=20).stdout
        numbers, _, name = words.partition(": ")
        return (*map(int, numbers.split()), name.strip())

    return home


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("start", [-3.3, 0.0, 3.3])
def test_the_home_is_the_edge_or_the_zero_before_it(axis, direction, start):
    """Started before the switch, at it and beyond it; the speed of moves is afterwards as before."""
    place = round(direction * 2.4 * TURN)
    result, home, speed, on, _ = axis(round(start * TURN), place, direction, False)
    assert result == 0 and 0 <= direction * (home - place) <= SLOW and (speed, on) == (12345, 1)
    result, home, *_ = axis(round(start * TURN), place, direction, True)
    assert (result, home) == (0, direction * 2 * TURN)


@pytest.mark.parametrize(
    ("fault", "place", "says"),
    [
        ("bus", 2.4, "an access to the core failed"),
        ("lost", 2.4, "an access to the core failed"),
        ("built", 2.4, "the core was built without a position loop"),
        ("trip", 2.4, "the gates are off, or a trip came"),
        ("index", 2.4, "the encoder has not found its index"),
        ("stuck", 2.4, "the switch stays closed"),
        ("never", 2.4, "the switch does not close"),
        ("blocked", 2.4, "the shaft does not follow"),
        ("none", 2.05, "the switch is too near the index"),
        ("none", 1.95, "the switch is too near the index"),
    ],
)
def test_what_prevents_it_is_told_by_name(axis, fault, place, says):
    """Where the core cannot be read any more the shaft must not run on to the end of its search: the gates go off."""
    _, _, _, on, said = axis(0, round(place * TURN), 1, True, fault)
    assert said == says and on == (fault not in ("bus", "lost"))
