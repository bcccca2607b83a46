# SPDX-License-Identifier: BSD-3-Clause
"""Checks without the core's state: blocks whose inputs are all in the recording.

A recording that begins while the drive runs does not contain the integrators of the regulators, so that the whole core
cannot be replayed.  Conditioning, transforms, decoupling, modulation and the applied voltage have no state, or only one
that the previous row contains; with recorded inputs they must give the recorded outputs in every bit.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.replay.chain import FIELDS, Run
from golden_model.control import chord_speed, decoupling
from golden_model.estimators import (
    applied_voltage,
    flux_estimate,
    flux_models,
    torque,
    winding_resistance,
)
from golden_model.io import current_conditioning, position, u_dc_conditioning, u_dc_processing
from golden_model.kernel import kernel
from golden_model.modulation import pwm_compare, svm, svm_delay_compensation
from golden_model.transforms import clarke, flux_park, inverse_park, park, sincos

AT_ONCE = 1 << 16
# Signal -> recorded signals that it depends on, besides the raw sample; the second tuple from the previous row.
NEEDS = {
    **dict.fromkeys(
        "i_a i_b i_c current_at_rail u_dc u_max u_dc_at_rail u_dc_low theta_me i_d i_q temp_lost".split(), ()
    ),
    "omega_chord": ("omega_me",),
    "u_dec_d": ("omega_chord", "lambda_d", "lambda_q"),
    "u_dec_q": ("omega_chord", "lambda_d", "lambda_q"),
    **dict.fromkeys(
        "u_alpha u_beta duty_a duty_b duty_c compare_a compare_b compare_c".split(),
        ("omega_me", "u_d", "u_q"),
    ),
    "torque": ("lambda_d", "lambda_q"),
}
AFTER_GAIN = ("duty_a", "duty_b", "duty_c", "compare_a", "compare_b", "compare_c")
BEFORE = {
    **dict.fromkeys(("u_applied_alpha", "u_applied_beta"), ("compare_a", "compare_b", "compare_c")),
    **dict.fromkeys(
        ("lambda_d", "lambda_q"),
        ("lambda_m_alpha", "lambda_m_beta", "lambda_pi_d", "lambda_pi_q", "merge_known"),
    ),
}


def checkable(names) -> dict[str, bool]:
    """{signal that can be checked: whether the previous row is needed} if ``names`` are recorded."""
    found = {s: False for s, needs in NEEDS.items() if s in names and set(needs) <= set(names)}
    return found | {s: True for s, needs in BEFORE.items() if s in names and set(needs) <= set(names)}


def check_rows(run: Run, start: int, stop: int) -> tuple[int, list[str], dict[str, int]]:
    """(first row in start..stop-1 with a difference or ``stop``, signals that differ there, their golden values)."""
    for begin in range(start, stop, AT_ONCE):
        end = min(begin + AT_ONCE, stop)
        # One more row at the start, for signals of the previous row; it has already been checked.
        row, names, golden = _check(run, max(start, begin - 1), end)
        if row < end:
            return row, names, golden
    return stop, [], {}


def _check(run: Run, start, stop):
    """check_rows for a number of rows that fits the memory."""
    signals = checkable(run.names)
    if run.config.overmodulation:  # the gain of the modulator depends on the voltages before their limit
        signals = {name: later for name, later in signals.items() if name not in AFTER_GAIN}
    wanted = np.array([signals.get(name) is not None for name in FIELDS])
    later = np.array([signals.get(name, False) for name in FIELDS])
    full = np.zeros((stop - start, len(FIELDS)), np.int64)
    for n, name in enumerate(FIELDS):
        if name in run.names:
            full[:, n] = run.recorded[start:stop, run.names.index(name)]
    before = np.vstack([full[:1], full[:-1]])
    made = full.copy()
    made[:, _MADE_AT] = _make(
        run.samples[start:stop], run.registers, run.config,
        np.ascontiguousarray(full[:, _NOW_AT]), np.ascontiguousarray(before[:, _BEFORE_AT]),
    )  # fmt: skip
    wrong = (made != full) & wanted
    wrong[0] &= ~later
    rows = np.flatnonzero(wrong.any(axis=1))
    if not len(rows):
        return stop, [], {}
    row = int(rows[0])
    names = [FIELDS[n] for n in np.flatnonzero(wrong[row])]
    return start + row, names, {name: int(made[row, FIELDS.index(name)]) for name in names}


NOW = ("omega_me", "lambda_d", "lambda_q", "omega_chord", "u_d", "u_q")
EARLIER = (
    "compare_a", "compare_b", "compare_c", "lambda_m_alpha", "lambda_m_beta", "lambda_pi_d", "lambda_pi_q",
    "merge_known",
)  # fmt: skip
MADE = (
    "i_a", "i_b", "i_c", "current_at_rail", "u_dc", "u_max", "u_dc_at_rail", "u_dc_low", "theta_me", "i_d", "i_q",
    "temp_lost", "lambda_d", "lambda_q", "omega_chord", "u_dec_d", "u_dec_q", "u_alpha", "u_beta", "duty_a", "duty_b",
    "duty_c", "compare_a", "compare_b", "compare_c", "u_applied_alpha", "u_applied_beta", "torque",
)  # fmt: skip
_NOW_AT, _BEFORE_AT, _MADE_AT = ([FIELDS.index(name) for name in names] for names in (NOW, EARLIER, MADE))
_COUNT = len(MADE)


@kernel
def _make(samples, registers, config, now, before):
    """Signals of MADE, (n, len(MADE)), from raw samples, recorded signals NOW, and EARLIER of the previous row."""
    made = np.empty((samples.shape[0], _COUNT), np.int64)
    for k in range(samples.shape[0]):
        seen = _one(samples[k], registers, config, now[k], before[k])
        for n, value in enumerate(seen):
            made[k, n] = value
    return made


@kernel
def _one(x, r, c, now, before):
    """One row, x as fluxproof.Sample."""
    omega_me, lambda_d, lambda_q, omega_chord, u_d, u_q = now[0], now[1], now[2], now[3], now[4], now[5]
    compare_a, compare_b, compare_c = before[0], before[1], before[2]
    lambda_m_alpha, lambda_m_beta, lambda_pi_d, lambda_pi_q = before[3], before[4], before[5], before[6]
    i_a, i_b, i_c, rail = current_conditioning.step(
        x[0], x[1], x[2], r.offset_a, r.offset_b, r.offset_c, r.gain_a, r.gain_b, r.gain_c, r.two_sensors, c.adc_bits
    )
    (theta_me,) = position.step(x[4], r.reverse, r.pole_pairs, r.theta_offset, c.position_bits)
    u_dc, u_max, u_rail = u_dc_conditioning.step(x[3], r.u_dc_offset, r.u_dc_gain, r.k_u_max, c.adc_bits)
    inverse, inverse_beta, u_low = u_dc_processing.step(u_dc)
    i_alpha, i_beta = clarke.step(i_a, i_b, i_c)
    (theta_out,) = svm_delay_compensation.step(theta_me, omega_me, r.k_delay)
    cos_theta, sin_theta, cos_out, sin_out = sincos.step(theta_me, theta_out)
    i_d, i_q = park.step(i_alpha, i_beta, cos_theta, sin_theta)
    _, _, minus_rho, lost = winding_resistance.step(x[9], x[10], r.r_s, r.tcr, r.t_0, r.t_min, r.t_max, r.t_s)
    flux_d, flux_q = flux_park.step(lambda_m_alpha, lambda_m_beta, cos_theta, sin_theta)
    model_d, model_q, merged_d, merged_q, merged, ended = flux_models.step(
        i_d, i_q, flux_d, flux_q, before[7], x[12], minus_rho, r.flux_mode * c.estimators, r.l_d, r.l_q, r.lambda_mg
    )  # fmt: skip
    own_d, own_q, _ = flux_estimate.step(model_d, model_q, merged_d, merged_q, merged, ended, lambda_pi_d, lambda_pi_q)
    (chord,) = chord_speed.step(omega_me, r.k_chord)
    dec_d, dec_q = decoupling.step(omega_chord, lambda_d, lambda_q)
    u_alpha, u_beta = inverse_park.step(u_d, u_q, cos_out, sin_out)
    duty_a, duty_b, duty_c = svm.step(u_alpha, u_beta, inverse, inverse_beta)
    new_a, new_b, new_c = pwm_compare.step(duty_a, duty_b, duty_c, r.min_pulse, r.double_update, c.carrier_half)
    on_alpha, on_beta, _ = applied_voltage.step(compare_a, compare_b, compare_c, u_dc, u_rail, x[12], c.carrier_half)
    (torque_me,) = torque.step(lambda_d, lambda_q, i_d, i_q)
    if not c.estimators:
        lost = on_alpha = on_beta = torque_me = 0
    return (
        i_a, i_b, i_c, rail, u_dc, u_max, u_rail, u_low, theta_me, i_d, i_q, lost, own_d, own_q, chord, dec_d, dec_q,
        u_alpha, u_beta, duty_a, duty_b, duty_c, new_a, new_b, new_c, on_alpha, on_beta, torque_me,
    )  # fmt: skip
