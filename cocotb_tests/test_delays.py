"""The rough sum of delays: where the registers of a multiplier begin and end a path, and where not."""

from __future__ import annotations

import pytest

from cocotb_tests.test_multiplier_registers import design
from scripts.synth.delays import MULTIPLIER, NET, TO_Q, Delays
from scripts.synth.netlist import Control, Nets, set_register

ENABLE = 9000
OPEN = MULTIPLIER + 2 * NET + TO_Q  # operand's flip-flop to product's flip-flop


@pytest.mark.parametrize(
    ("sides", "arrival", "rest"),
    [
        ("", OPEN - NET, MULTIPLIER + 2 * NET),
        ("P", TO_Q, MULTIPLIER + NET),
        ("AB", MULTIPLIER, NET),
        ("ABP", TO_Q, NET),
    ],
)
def test_registers_of_a_multiplier_cut_the_path(sides, arrival, rest):
    module = design()["modules"]["t"]
    cell = module["cells"]["m"]
    for side in sides:
        set_register(cell, side, Control(2, ENABLE), {})
    delays = Delays(module["cells"], Nets(module))
    assert delays.arrival(cell["connections"]["P0"][0]) == pytest.approx(arrival)
    assert delays.rest(cell["connections"]["A0"][0]) == pytest.approx(rest)
    assert delays.rest(ENABLE) == pytest.approx(NET if sides else 0.0)
