# SPDX-License-Identifier: BSD-3-Clause
"""Assumptions of a block on its inputs, checked against the blocks before it for every relevant value."""

from __future__ import annotations

from golden_model.fixed import round_half_up
from golden_model.formats import INTEGRAL, PU, PU_TO_INTEGRAL, U_DC, U_MAX
from golden_model.io import speed, u_dc_conditioning, u_dc_processing
from golden_model.modulation import svm

ROUNDING = 2  # LSB that the rotation back may add to what the circle grants


def test_modulator_input_is_below_two_bus_voltages():
    """At every bus voltage, with the widest circle that k_u_max allows."""
    widest = u_dc_conditioning.K_U_MAX.hi
    largest = 0
    for u_dc in range(U_DC.hi + 1):
        u_max = min(u_dc * widest >> u_dc_conditioning.DROP_U_MAX, U_MAX.hi)
        inverse, inverse_beta, _ = u_dc_processing.step(u_dc)
        largest = max(largest, (u_max + ROUNDING) * max(inverse, inverse_beta))
    one_bus = 1 << (PU.frac_bits + u_dc_processing.INVERSE.frac_bits)
    assert 0.99 * one_bus < largest < 1.01 * one_bus
    assert largest >> svm.DROP_SCALED <= svm.SCALED.hi


def test_speed_needs_no_limit():
    """From the ends of each upper part, towards every kind of raw, with every weight: a move never passes raw, and what
    is below the upper part stays."""
    ends = sorted({PU.lo, PU.lo + 1, -1, 0, 1, PU.hi - 1, PU.hi})
    below = (1 << PU_TO_INTEGRAL) - 1
    (weight,) = (port for port in speed.BLOCK.registers if port.name == "k_filter")
    for k_filter in range(weight.high + 1):
        for raw in (PU.lo, PU.hi):
            for upper in ends:
                move = round_half_up((raw - upper) * k_filter, speed.DROP_STATE)
                lowest, highest = ((upper << PU_TO_INTEGRAL) + low + move for low in (0, below))
                assert INTEGRAL.lo <= lowest and highest <= INTEGRAL.hi, (k_filter, raw, upper)
