# SPDX-License-Identifier: BSD-3-Clause
"""The beat of an encoder's codes with the sampling, predicted and simulated."""

from types import SimpleNamespace

import numpy as np
import pytest

from fluxproof.diagnosis.balance.quantised_angle import angle_step, beat_spectrum, beat_variance
from fluxproof.diagnosis.balance.view import HALF_WIDTH, SLOPE_REACH

PERIOD, PSI, ROWS, INERTIA, PAIRS = 1e-4, 0.1, 200, 2e-3, 3
ORDERS = np.array([0.0, 1.0, -1.0, 2.0, 6.0])
STEP = PAIRS * 2 * np.pi / 2048  # electrical
MARGIN = HALF_WIDTH + 1


def view_of(turn, dq_voltage=False, free=True):
    """What is needed of a view of one block at ``turn`` rad per sample."""
    return SimpleNamespace(
        angle_step=STEP,
        dq_voltage=dq_voltage,
        sample_time_s=PERIOD,
        omega=np.full((1, 3), turn / PERIOD),
        nominal_psi=np.full((1, 3), PSI),
        u_dc=np.zeros((1, ROWS)),
        turns_freely=np.array([free]),
        machine=SimpleNamespace(inertia_kgm2=INERTIA, pole_pairs=PAIRS),
    )


def error_of(turn, phase, margin=MARGIN):
    """Error of the codes from ``margin`` samples before a block to as many after it."""
    true = phase + turn * np.arange(-margin, ROWS + margin + 1)
    return STEP * np.floor(true / STEP) - true + STEP / 2


def smoothed(error):
    """As the angle of a view is."""
    return np.convolve(error, np.full(2 * HALF_WIDTH + 1, 1 / (2 * HALF_WIDTH + 1)), "valid")[1:-1]


def left_in_voltage(turn, turned, smooth):
    """(ROWS,) [V] what an error of the angle leaves: ``turned`` of the voltage's, ``smooth`` of the flux's."""
    return PSI * (turn / PERIOD * 0.5 * (turned[1:] + turned[:-1]) - 1j * np.diff(smooth) / PERIOD)


def waves(turn):
    return np.exp(-1j * ORDERS[:, None] * turn * np.arange(ROWS))


def voltage(turn, phase, dq_voltage):
    """(h,) what the codes leave of the voltage balance."""
    error = error_of(turn, phase)
    smooth = smoothed(error)
    turned = error[MARGIN:-MARGIN] if dq_voltage else smooth
    return waves(turn) @ left_in_voltage(turn, turned, smooth) / ROWS


def torque(turn, phase):
    """(h,) what the codes leave of the torque balance."""
    e = error_of(turn, phase)[MARGIN - 1 : -MARGIN + 1]
    bend = (e[3:] - e[2:-1] - e[1:-2] + e[:-3]) / (2 * PERIOD**2)
    taper = 1.0 - np.cos(2 * np.pi * (np.arange(ROWS) + 0.5) / ROWS)
    return waves(turn) @ (INERTIA / PAIRS * bend * taper) / ROWS


def torque_imposed(turn, phase):
    """(h,) the same of a shaft with an imposed speed, whose acceleration is taken over many samples."""
    smooth = smoothed(error_of(turn, phase, MARGIN + SLOPE_REACH))
    bend = (smooth[2 * SLOPE_REACH :] - 2 * smooth[SLOPE_REACH:-SLOPE_REACH] + smooth[: -2 * SLOPE_REACH])[:ROWS]
    taper = 1.0 - np.cos(2 * np.pi * (np.arange(ROWS) + 0.5) / ROWS)
    return waves(turn) @ (INERTIA / PAIRS * bend / (SLOPE_REACH * PERIOD) ** 2 * taper) / ROWS


def variance(simulated):
    """Of one part of (n, h) values."""
    return 0.5 * np.mean(np.abs(np.array(simulated)) ** 2, axis=0)


@pytest.mark.parametrize("beat", [0.002, 0.01, 0.02])  # cycles per sample
@pytest.mark.parametrize("dq_voltage", [False, True])
def test_the_beat_in_the_voltage(dq_voltage, beat):
    turn = (11 + beat) * STEP
    phases = STEP * np.random.default_rng(5).random(2000)
    simulated = variance([voltage(turn, phase, dq_voltage) for phase in phases])
    predicted = beat_variance(view_of(turn, dq_voltage), "u", ORDERS)[0]
    assert np.allclose(predicted, simulated, rtol=0.15, atol=0.02 * simulated.max())


def test_the_beat_in_the_spectrum():
    """Half a code per sample more than a whole number: the second harmonic of the sawtooth beats slowly."""
    turn, taper = (1.5 + 0.0075) * STEP, 1.0 - np.cos(2 * np.pi * (np.arange(ROWS) + 0.5) / ROWS)
    bins = np.arange(6)
    wave = taper * np.exp(-2j * np.pi * bins[:, None] * np.arange(ROWS) / ROWS)
    errors = [smoothed(error_of(turn, phase)) for phase in STEP * np.random.default_rng(8).random(500)]
    simulated = variance([wave @ left_in_voltage(turn, e, e) / ROWS for e in errors])
    predicted = beat_spectrum(view_of(turn), bins)[0]
    assert np.argmax(predicted) == 3
    assert np.allclose(predicted, simulated, rtol=0.15, atol=0.02 * predicted.max())


@pytest.mark.parametrize("beat", [0.01, 0.11, 0.3])
def test_the_beat_in_the_torque(beat):
    turn = (11 + beat) * STEP
    phases = STEP * np.random.default_rng(7).random(2000)
    simulated = variance([torque(turn, phase) for phase in phases])
    predicted = beat_variance(view_of(turn), "torque", ORDERS)[0]
    assert np.allclose(predicted[1:], simulated[1:], rtol=0.15, atol=0.02 * simulated.max())


@pytest.mark.parametrize("beat", [0.01, 0.02])
def test_the_beat_in_the_torque_of_an_imposed_speed(beat):
    """It was told as a cogging of 1 % of the rated torque at order 188."""
    turn = (1 + beat) * STEP
    phases = STEP * np.random.default_rng(9).random(2000)
    simulated = variance([torque_imposed(turn, phase) for phase in phases])
    predicted = beat_variance(view_of(turn, free=False), "torque", ORDERS)[0]
    assert np.allclose(predicted, simulated, rtol=0.15, atol=0.02 * simulated.max())


def test_the_step_is_that_of_the_codes():
    rng, linked = np.random.default_rng(6), np.ones(4999, bool)
    true = np.cumsum(0.02 + 0.01 * np.sin(np.arange(5000) / 300))
    assert angle_step(STEP * np.floor(true / STEP), linked) == pytest.approx(STEP)
    assert angle_step(true, linked) == 0.0
    assert angle_step(true + 1e-4 * rng.normal(size=5000), linked) == 0.0
