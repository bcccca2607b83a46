# SPDX-License-Identifier: BSD-3-Clause
"""The flux map from a recording: the co-energy of a synthetic machine is identified within the recorded range only."""

from __future__ import annotations

import numpy as np
import pytest

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from studies.real.flux_splines import INTERVALS, gradients, knots_over, powers
from studies.real.flux_surface import earned, flux_map, ladder, names

NOMINAL = load_nominal(ROOT / "docs" / "drives" / "brusa_hsm1.toml")
MACHINE, T = NOMINAL.machine, NOMINAL.sample_time_s
ROWS = 260
SPREAD = np.arange(-120.0, 121.0, 30.0)


def saturating(i, cross=1.0):
    """A reciprocal flux [Wb] outside the catalogue's formulas: derivatives of sums of log cosh."""
    x, y = i.real + 40.0, i.imag
    mixed = cross * 0.008 * np.exp(-((x / 90.0) ** 2) - (y / 70.0) ** 2)  # mixed co-energy of 0.36 J
    psi_d = 0.0426 + 0.03 * (np.tanh(x / 110.0) - np.tanh(40.0 / 110.0)) - mixed * 2.0 * x / 90.0**2 * 50.0
    return psi_d + 1j * (0.085 * np.tanh(y / 90.0) - mixed * 2.0 * y / 70.0**2 * 50.0)


def straight(i):
    """The nominal machine's flux with both inductances wrong."""
    return MACHINE.magnet_flux_wb + 1.2 * MACHINE.inductance_d_h * i.real + 0.8j * MACHINE.inductance_q_h * i.imag


def record(flux, omega, levels=SPREAD, seed=0, delta_r=0.0, noise_a=0.02):
    """Dwells at every pair of the levels in a shuffled order: exact duties for the flux, noisy currents."""
    generator = np.random.default_rng(seed)
    i_d, i_q = (x.ravel() for x in np.meshgrid(levels, levels))
    order = generator.permutation(len(i_d))
    i = np.repeat((i_d + 1j * i_q)[order], ROWS)
    n = len(i)
    theta = omega * T * np.arange(n + 1)
    stator = flux(np.append(i, i[-1])) * np.exp(1j * theta)
    mean_i = i * np.exp(1j * (theta[:-1] + 0.5 * omega * T))
    u = np.diff(stator) / T + (MACHINE.resistance_ohm + delta_r) * mean_i
    u = np.append(u[1:], u[-1])  # the duties of a row act one period later
    phases = (u[:, None] * np.exp(-2j * np.pi / 3 * np.arange(3))).real
    columns = {
        "t": T * np.arange(n),
        "theta_e": theta[:-1],
        "omega_e": np.full(n, omega),
        "u_dc": np.full(n, 400.0),
    }
    noisy = i + noise_a * (generator.standard_normal(n) + 1j * generator.standard_normal(n))
    columns |= {"i_d": noisy.real, "i_q": noisy.imag}
    columns |= {f"d_{x}": phases[:, k] / 400.0 + 0.5 for k, x in enumerate("abc")}
    return from_columns(columns, T)


def view(flux, **more):
    return joined_views([view_of(record(flux, w, seed=k, **more), NOMINAL) for k, w in enumerate((500.0, -900.0))])


@pytest.fixture(scope="module")
def found():
    seen = view(saturating)
    return seen, flux_map(seen)


def test_map_within_two_percent_of_its_range(found):
    surface = found[1]
    i = np.linspace(-115, 115, 24)[:, None] + 1j * np.linspace(-115, 115, 24)
    error, truth = surface.psi(i) - saturating(i), saturating(i)
    assert surface.covered(i).all()
    assert np.abs(error.real).max() < 0.02 * np.ptp(truth.real)
    assert np.abs(error.imag).max() < 0.02 * np.ptp(truth.imag)


def test_estimated_error_is_realistic(found):
    surface = found[1]
    i = np.linspace(-115, 115, 24)[:, None] + 1j * np.linspace(-115, 115, 24)
    rms = np.sqrt(np.mean(np.abs(surface.psi(i) - saturating(i)) ** 2) / 2)
    assert 0.2 * surface.error_wb < rms < 3.0 * surface.error_wb


def test_surface_is_reciprocal(found):
    surface, h = found[1], 0.5
    i = np.linspace(-100, 100, 9)[:, None] + 1j * np.linspace(-100, 100, 9)
    d_by_q = (surface.psi(i + 1j * h).real - surface.psi(i - 1j * h).real) / (2 * h)
    q_by_d = (surface.psi(i + h).imag - surface.psi(i - h).imag) / (2 * h)
    assert np.abs(d_by_q - q_by_d).max() < 0.01 * np.abs(d_by_q).max()


def test_map_covers_only_the_recorded_points(found):
    surface = found[1]
    assert not surface.covered(np.array([135.0, -135.0, 135j, 200 + 200j])).any()
    chart, covered = surface.flux_map(10.0)
    assert covered.shape == chart.psi_d_wb.shape and abs(chart.i_q_a[-1]) < 121.0


def test_a_hole_in_the_recording_stays_a_hole():
    recording = record(saturating, 500.0)
    hole = (np.abs(recording["i_d"]) < 50) & (np.abs(recording["i_q"]) < 50)
    recording.usable[hole] = False
    surface = flux_map(view_of(recording, NOMINAL))
    assert not surface.covered(np.array([0.0, 15 + 15j])).any() and surface.covered(np.array([90.0 + 90j])).all()


def test_resistance_fitted_with_the_surface(found):
    seen = view(saturating, delta_r=3e-3)
    e = flux_map(seen).beside["resistance"]["delta_r"]
    assert abs(e.value - 3e-3) < max(4 * e.sigma, 3e-4)
    healthy = found[1].beside["resistance"]["delta_r"]
    assert abs(healthy.value) < max(4 * healthy.sigma, 3e-4)


def steps_of(seen):
    train = seen.run % 4 != 2
    return ladder(seen, train)


def test_names_follow_from_the_currents_the_flux_depends_on(found):
    assert names(steps_of(found[0]), 0.05) == ["saturation", "cross_saturation"]
    assert names(steps_of(view(lambda i: saturating(i, cross=0.0))), 0.05) == ["saturation"]
    assert names(steps_of(view(straight)), 0.05) == []


def test_name_for_the_residual_of_a_rigid_curve_is_rejected(found):
    assert max(earned(found[0], ["magnet_temperature", "iron_loss", "encoder_offset"]).values()) < 30.0


def test_true_effect_is_significant_with_the_free_surface():
    seen = view(saturating, delta_r=3e-3)
    assert earned(seen, ["resistance"], beside=())["resistance"] > 30.0


def test_map_needs_both_currents():
    line = record(saturating, 500.0)
    line.usable[np.abs(line["i_d"]) > 5.0] = False
    with pytest.raises(ValueError, match="both i_d and i_q"):
        flux_map(view_of(line, NOMINAL))


def test_spline_powers_and_slopes_are_exact():
    knots = knots_over(np.array([-90.0, 120.0]))
    assert len(knots) == INTERVALS + 7
    one, x, x2 = powers(knots)
    i = np.linspace(-80, 110, 7) + 1j * np.linspace(-85, 100, 7)
    slopes = gradients(i, knots, knots) @ np.outer(x2, x).ravel()  # W = i_d^2 i_q
    assert slopes == pytest.approx(2 * i.real * i.imag + 1j * i.real**2, abs=1e-7)
    assert gradients(i, knots, knots) @ np.outer(one, one).ravel() == pytest.approx(np.zeros(7), abs=1e-9)
