# SPDX-License-Identifier: BSD-3-Clause
"""The equations of the machine agree with each other, with the plant's, and stand in one place."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import ROOT
from fluxproof.diagnosis.ground.machine import (
    airgap_torque,
    current_of_flux,
    flux_linkage,
    flux_of_current,
    flux_terms,
    mean_emf,
    rated_torque,
    slope_in_zero_vector,
    steady_voltage,
)
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.plant.transforms import AXES, PATTERNS, clarke, linear_limit, phase_values, space_vector

M = load_nominal(PAPER).machine
RNG = np.random.default_rng(47)
I = 5.0 * (RNG.standard_normal(50) + 1j * RNG.standard_normal(50))  # noqa: E741
HOME = ROOT / "fluxproof" / "diagnosis" / "ground" / "machine.py"  # that of the phases is the plant's
EQUATIONS = (
    r"inductance_[dq]_h\)? \* [\w.]+\.(real|imag)",  # a flux linkage
    r"1\.5 \* [\w.]*pole_pairs",  # a torque
    r"2j? \* (np\.|math\.)?pi / 3",  # directions of the phases
    r"\(2 / 3\) \* \(?\w+ @",  # Clarke
    r"dc_bus_v / (np|math)\.sqrt\(3",  # the linear limit
)


def test_flux_and_current_are_inverse():
    psi = flux_of_current(I, M.inductance_d_h, M.inductance_q_h)
    assert current_of_flux(psi, M.inductance_d_h, M.inductance_q_h) == pytest.approx(I)
    assert sum(flux_terms(M, I)) == pytest.approx(flux_linkage(M, I))
    assert flux_linkage(M, 0j) == M.magnet_flux_wb


def test_the_mean_emf_of_a_short_period_is_that_of_the_steady_state():
    omega, period = 700.0, 1e-8
    half = np.exp(0.5j * omega * period)
    psi = flux_linkage(M, I)
    mean = M.resistance_ohm * I + mean_emf((psi, psi), (np.conj(half), half), period)
    assert mean == pytest.approx(steady_voltage(M, I, omega), rel=1e-6)


def test_air_gap_power_is_torque_times_speed():
    omega = 700.0
    power = 1.5 * (np.conj(I) * (steady_voltage(M, I, omega) - M.resistance_ohm * I)).real
    assert airgap_torque(M, flux_linkage(M, I), I) * omega / M.pole_pairs == pytest.approx(power)
    assert rated_torque(M) == pytest.approx(airgap_torque(M, M.magnet_flux_wb, 1j * M.rated_current_a))


def test_a_shorted_machine_changes_its_flux_by_its_resistance_alone():
    """In the stator frame d psi / dt = -R i; the magnets turn, so that the current's share is what is left."""
    omega, step = 700.0, 1e-7
    psi = flux_linkage(M, I)
    turn = np.exp(1j * omega * step)
    later = (psi - M.resistance_ohm * I * step) * np.conj(turn) - M.magnet_flux_wb
    moved = current_of_flux(later, M.inductance_d_h, M.inductance_q_h) * turn - I
    assert slope_in_zero_vector(M, I, omega, psi) == pytest.approx(moved / step, rel=1e-3)


def test_space_vectors_are_clarkes_transform_of_the_plant():
    abc = RNG.standard_normal((20, 3)) + 0.3
    alpha, beta = clarke.py_func(*abc.T)
    assert space_vector(abc) == pytest.approx(alpha + 1j * beta)
    assert phase_values(space_vector(abc)) == pytest.approx(abc - abc.mean(axis=1, keepdims=True))
    for name, unit in (("alpha", 1.0), ("beta", 1j)):
        assert space_vector(np.array(PATTERNS[name])) == pytest.approx(unit * 2 / 3)
    duties = np.array([1.0, 0.5, 0.0])  # the shortest vector at the limit of the bus has all of its length in one line
    assert linear_limit(100.0) == pytest.approx(abs(space_vector(100.0 * duties)))
    assert abs(AXES) == pytest.approx(1.0) and AXES.sum() == pytest.approx(0.0)


def test_no_equation_has_a_second_home():
    found = []
    for path in sorted((ROOT / "fluxproof" / "diagnosis").rglob("*.py")):
        for number, line in enumerate(path.read_text().splitlines() if path != HOME else (), 1):
            found += [f"{path}:{number}: {line.strip()}" for pattern in EQUATIONS if re.search(pattern, line)]
    assert not found, "\n".join(found)
