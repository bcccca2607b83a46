# SPDX-License-Identifier: BSD-3-Clause
"""The bus behind a diode and a capacitor, with its brake resistor."""

import numpy as np
import pytest

from fluxproof.plant import Bus, advance_bus


def charged(bus, volts, power, brake=0, periods=200, period_s=1e-5, source=100.0):
    """Bus voltage after each period at a constant power into the motor."""
    seen = []
    for _ in range(periods):
        volts = advance_bus(volts, bus, source, power, brake, period_s)
        seen.append(volts)
    return np.array(seen)


def test_what_is_fed_back_charges_the_capacitor_behind_a_diode():
    bus = Bus(1e-3, 0.1, True)
    volts = charged(bus, 100.0, -500.0)  # 1 J in 2 ms
    assert volts[-1] == pytest.approx(np.sqrt(100.0**2 + 2.0 * 1.0 / 1e-3), rel=1e-3)
    assert charged(bus, volts[-1], 0.0)[-1] == volts[-1], "a diode takes nothing back"


def test_a_loaded_bus_settles_at_the_drop_of_its_source():
    for farad in (1e-3, 1e-6):  # R*C far above a period, and far below
        volts = charged(Bus(farad, 0.5, True), 100.0, 1000.0, periods=2000)[-1]
        assert (100.0 - volts) / 0.5 == pytest.approx(1000.0 / volts, rel=1e-3)
    back = charged(Bus(1e-3, 0.5, False), 100.0, -1000.0, periods=2000)[-1]
    assert (back - 100.0) / 0.5 == pytest.approx(1000.0 / back, rel=1e-3), "a battery takes it back"


def test_a_brake_resistor_discharges_the_bus():
    volts = charged(Bus(1e-3, 0.1, True, 10.0), 150.0, 0.0, brake=1)  # 2 ms of 10 ms
    assert volts[-1] == pytest.approx(150.0 * np.exp(-0.2), rel=2e-3)
    held = charged(Bus(1e-3, 0.1, True, 10.0), 150.0, -(150.0**2) / 10.0, brake=1)
    assert held[-1] == pytest.approx(150.0, rel=1e-6)
    assert (charged(Bus(), 77.0, -1e6) == 100.0).all(), "an ideal source"
