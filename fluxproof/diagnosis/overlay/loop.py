# SPDX-License-Identifier: BSD-3-Clause
"""A float field-oriented controller in closed loop with the averaged plant, one row per control sample.

    u = kp (i_ref - i) + int,  int += ki T (i_ref - i)          held while the voltage is at its limit
    u_d -= w L_q i_q,  u_q += w (L_d i_d + psi_m)               decoupling with the controller's own parameters
    duties by centred zero vectors for the angle theta + delay_samples w T, in force a whole number of periods later

The controller's measurements contain the sensor errors; the plant rotates as in the recording.

It is a controller of its own, since the recorded drive may have any: the golden core needs the registers of a core, its
reference models are one call of Python a block and sample, and `fluxproof simulate` drives a switching plant.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fluxproof.plant import advance_averaged, skewed_currents
from fluxproof.plant import layout as L
from fluxproof.plant.jit import njit
from fluxproof.plant.transforms import clarke, inverse_clarke


class Controller(NamedTuple):
    """Gains and parameters of the controller."""

    kp_d: float  # V/A
    kp_q: float
    ki_d: float  # V/(A s)
    ki_q: float
    inductance_d: float  # H
    inductance_q: float
    magnet_flux: float  # Wb
    delay_samples: float  # by which the angle of the output is advanced
    period_s: float


class Errors(NamedTuple):
    """Sensor errors and delay; without errors gain (1, 1, 1), offset (0, 0, 0), 1, 0, n."""

    current_gain: np.ndarray  # (3,)
    current_offset: np.ndarray  # (3,) [A]
    u_dc_gain: float
    skew_s: float
    delay_periods: float  # from a sample to the period in which its duties act


class Inputs(NamedTuple):
    """What n rows impose."""

    theta_read: np.ndarray  # (n + 1,) angle that the sensor reads, electrical, unwrapped [rad]
    theta_true: np.ndarray  # (n + 1,) [rad]
    omega: np.ndarray  # (n,) electrical [rad/s]
    i_ref: np.ndarray  # (n, 2) dq [A]
    u_dc: np.ndarray  # (n,) measured [V]
    temperature: np.ndarray  # (n,) of the winding [deg C]


@njit
def run_loop(state, params, c, e, rows, integral, out):
    """Simulate n rows; ``out`` (n, 4) receives measured i_d, i_q [A] and commanded u_d, u_q [V].

    c: Controller; e: Errors; rows: Inputs; integral: (2,) [V] of the regulators at the start.
    """
    theta_read, theta_true, omega, i_ref, u_dc, temperature = rows
    period_s, poles = c.period_s, params.machine.pole_pairs
    whole = int(math.floor(e.delay_periods))
    part = e.delay_periods - whole
    queue = np.full((whole + 2, 3), 0.5)  # row j: duties of j samples ago
    for k in range(len(omega)):
        state[L.TEMP_WINDING] = temperature[k]
        if e.skew_s != 0.0:
            i_a, i_b, i_c = skewed_currents(state, params, e.skew_s)
        else:
            i_a, i_b, i_c = state[L.I_A], state[L.I_B], state[L.I_C]
        alpha, beta = clarke(
            i_a * e.current_gain[0] + e.current_offset[0],
            i_b * e.current_gain[1] + e.current_offset[1],
            i_c * e.current_gain[2] + e.current_offset[2],
        )
        cosine, sine = math.cos(theta_read[k]), math.sin(theta_read[k])
        i_d, i_q = cosine * alpha + sine * beta, cosine * beta - sine * alpha
        err_d, err_q = i_ref[k, 0] - i_d, i_ref[k, 1] - i_q
        u_d = c.kp_d * err_d + integral[0] - omega[k] * c.inductance_q * i_q
        u_q = c.kp_q * err_q + integral[1] + omega[k] * (c.inductance_d * i_d + c.magnet_flux)
        length, limit = math.hypot(u_d, u_q), u_dc[k] / math.sqrt(3.0)
        if length > limit:
            u_d, u_q = u_d * limit / length, u_q * limit / length
        else:
            integral[0] += c.ki_d * period_s * err_d
            integral[1] += c.ki_q * period_s * err_q
        for j in range(whole + 1, 0, -1):
            queue[j] = queue[j - 1]
        _duties(u_d, u_q, theta_read[k] + c.delay_samples * omega[k] * period_s, u_dc[k], queue[0])
        if k == 0:
            for j in range(1, whole + 2):  # before the first row the same voltage vector is assumed, rotated back
                back = (c.delay_samples - j) * omega[k] * period_s
                _duties(u_d, u_q, theta_read[k] + back, u_dc[k], queue[j])
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = i_d, i_q, u_d, u_q
        turning = (theta_true[k + 1] - theta_true[k]) / (poles * period_s)
        state[L.OMEGA_M] = turning
        duties = (1.0 - part) * queue[whole] + part * queue[whole + 1]
        advance_averaged(state, params, duties, u_dc[k] / e.u_dc_gain, turning, period_s)


@njit
def _duties(u_d, u_q, theta, u_dc, duties):
    """Duties (3,) of a voltage at an angle, with equal zero vectors."""
    cosine, sine = math.cos(theta), math.sin(theta)
    a, b, c = inverse_clarke(cosine * u_d - sine * u_q, sine * u_d + cosine * u_q)
    middle = 0.5 * (max(a, b, c) + min(a, b, c))
    bus = max(u_dc, 1e-9)
    duties[0] = min(max(0.5 + (a - middle) / bus, 0.0), 1.0)
    duties[1] = min(max(0.5 + (b - middle) / bus, 0.0), 1.0)
    duties[2] = min(max(0.5 + (c - middle) / bus, 0.0), 1.0)
