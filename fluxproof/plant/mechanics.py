# SPDX-License-Identifier: BSD-3-Clause
"""Shaft: inertia, viscous and Coulomb friction with stiction, load or imposed speed.

J dw/dt = T_airgap - T_load - B w - T_c sign(w)          (free)
w follows the caller's profile, torque is ignored        (imposed)
"""

from typing import NamedTuple

import numpy as np

from fluxproof.plant.jit import njit

FREE = 0
IMPOSED_SPEED = 1


class MechanicsParams(NamedTuple):
    """Shaft parameters for the kernels (build with `mechanics_params`)."""

    mode: int  # FREE or IMPOSED_SPEED
    inverse_inertia: float  # [1/(kg m^2)]
    viscous: float  # [Nm s/rad]
    coulomb: float  # [Nm]


class Profile(NamedTuple):
    """Piecewise profile: times rising [s], values, linear (True) or held (False)."""

    times: np.ndarray
    values: np.ndarray
    linear: bool


def mechanics_params(machine, mode=FREE):
    """Build MechanicsParams from a Machine; mode FREE or IMPOSED_SPEED."""
    if mode not in (FREE, IMPOSED_SPEED):
        raise ValueError("mode must be FREE or IMPOSED_SPEED")
    if machine.inertia_kgm2 <= 0.0:
        raise ValueError("inertia_kgm2 must be positive")
    return MechanicsParams(
        mode,
        1.0 / machine.inertia_kgm2,
        float(machine.viscous_friction_nms),
        float(machine.coulomb_friction_nm),
    )


def profile(times, values, linear=False):
    """Build a Profile; held values change stepwise at their time, linear ones are interpolated."""
    times, values = np.asarray(times, float), np.asarray(values, float)
    if times.ndim != 1 or times.shape != values.shape or not len(times) or (np.diff(times) < 0).any():
        raise ValueError("profile: times must rise and match the values")
    return Profile(times, values, linear)


@njit
def profile_at(profile, t):
    """Value of a Profile at the time t [s]; constant before the first and after the last time."""
    times, values = profile.times, profile.values
    k = np.searchsorted(times, t, side="right") - 1
    if k < 0:
        return values[0]
    if k >= len(times) - 1:
        return values[-1]
    if not profile.linear:
        return values[k]
    return values[k] + (values[k + 1] - values[k]) * (t - times[k]) / (times[k + 1] - times[k])


@njit
def shaft_drive(mech, omega, torque, load):
    """State of the shaft in the coming sub-step: (free, Coulomb torque).

    free is 1.0 or 0.0 (held by stiction).  At rest, friction balances the applied
    torque up to its limit; beyond the limit it opposes the motion.
    """
    if mech.coulomb == 0.0:
        return 1.0, 0.0
    if omega > 0.0:
        return 1.0, mech.coulomb
    if omega < 0.0:
        return 1.0, -mech.coulomb
    applied = torque - load
    if abs(applied) <= mech.coulomb:
        return 0.0, 0.0
    return 1.0, mech.coulomb if applied > 0.0 else -mech.coulomb


@njit
def stop_at_zero(friction, omega_0, theta_0, omega, theta, step_s):
    """Set the speed to zero when friction has stopped the shaft within a sub-step: (omega, theta).

    Otherwise friction would accelerate the shaft backwards in a sub-step that
    crosses zero speed.  The angle is that of a uniform deceleration to zero.
    """
    if friction * omega >= 0.0:
        return omega, theta
    stopped_after = step_s * omega_0 / (omega_0 - omega) if omega_0 != omega else 0.0
    return 0.0, theta_0 + 0.5 * omega_0 * stopped_after
