# SPDX-License-Identifier: BSD-3-Clause
"""What a recording contains about its shaft: a torque transducer, a freely rotating shaft, or nothing.

Without a transducer, the mechanical balance J d omega_m / dt = T - B omega_m - T_load is valid only if the speed is not
imposed, which a recording does not state.  The shaft counts as free if changes of the air-gap torque within a few
milliseconds equal, in the median, those of J d omega_m / dt; occasional load steps do not matter.  It counts as
unloaded if the remaining torque is an odd function of speed alone, in both directions: friction is one, a load only
by chance.

A transducer on a free shaft measures what is behind it.  In front of the load alone it shows the load, and the ripple
of the air-gap torque appears in the acceleration; in front of the inertia too, it shows that ripple itself.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.machine import airgap_torque, flux_linkage

FREE_RATIO = (0.7, 1.35)  # median of torque change over inertial change
REACH, LAG = 80, 200  # samples: half window of the slope, and interval of a change
FREE = ("loaded", "unloaded", "free")  # kinds whose acceleration is computed from the codes of the angle
SHOWN = ("torque", "driving")  # kinds with a transducer that shows the ripple of the air-gap torque
MEASURED = (*SHOWN, "loaded")  # kinds with a transducer
DRIVES = 0.5  # least median of transducer change over air-gap change in front of the inertia; behind it there is none
ODD_SHARE = 0.96  # share of the remaining torque's variance that an odd function of speed must explain
ONE_SPEED = 0.8  # ratio of small and large drag above which the recording has only one speed
SMALL = 0.01  # of rated torque: a smaller torque is never a load


def shaft_kind(recording, nominal, i_s, theta, linked) -> str:
    """'torque' (imposed speed), 'loaded', 'driving', 'unloaded', 'free' (with a possible load) or ''.

    A shaft that is 'loaded' or 'driving' is free and has a transducer, in front of the load or of load and inertia.
    i_s, theta: smoothed dq current and angle (n,).
    """
    m = nominal.machine
    imposed = "torque" if recording.has("torque") else ""
    if not m.inertia_kgm2:
        return imposed
    period = nominal.sample_time_s
    torque = airgap(nominal, i_s)
    far = REACH * period
    omega_m, slope = np.full(len(theta), np.nan), np.full(len(theta), np.nan)
    ahead, here, behind = (theta[k : len(theta) - 2 * REACH + k] / m.pole_pairs for k in (2 * REACH, REACH, 0))
    omega_m[REACH:-REACH] = (ahead - behind) / (2 * far)
    slope[REACH:-REACH] = (ahead - 2 * here + behind) / far**2
    inert = m.inertia_kgm2 * slope
    rated = airgap(nominal, np.array(1j * m.rated_current_a))
    x, y = inert[LAG:] - inert[:-LAG], torque[LAG:] - torque[:-LAG]
    moving = np.isfinite(x) & np.isfinite(y) & (np.abs(x) > 0.05 * rated)
    if moving.sum() < 200 or not FREE_RATIO[0] < np.median(y[moving] / x[moving]) < FREE_RATIO[1]:
        return imposed
    if imposed:
        z = recording["torque"][LAG:] - recording["torque"][:-LAG]
        return "driving" if np.nanmedian(z[moving] / y[moving]) > DRIVES else "loaded"
    good = np.isfinite(inert) & np.isfinite(torque)
    good[:-1] &= linked
    left = (torque - inert - (m.viscous_friction_nms or 0.0) * omega_m)[good][::10]
    w = omega_m[good][::10]
    if np.sqrt(np.mean(left**2)) < SMALL * rated:
        return "unloaded"
    top = max(np.abs(w).max(), 1e-9)
    if (w > 0.1 * top).mean() < 0.1 or (w < -0.1 * top).mean() < 0.1:
        return "free"
    odd = np.stack([w, np.tanh(w / (0.03 * top)), w * np.abs(w), np.tanh(w / (0.2 * top))], axis=1)
    fitted = odd @ np.linalg.lstsq(odd, left, rcond=None)[0]
    return "unloaded" if np.sum((left - fitted) ** 2) < (1 - ODD_SHARE) * np.sum(left**2) else "free"


def measures_torque(view) -> bool:
    """Whether a transducer shows the torque of some block of a view."""
    return bool(np.isin(view.shaft, MEASURED).any())


def airgap(nominal, i):
    """Air-gap torque [Nm] of the nominal machine for dq currents, complex [A]."""
    return airgap_torque(nominal.machine, flux_linkage(nominal.machine, i), i)


def is_airgap(torque, nominal_airgap, drag) -> bool:
    """Whether a recorded torque is the air-gap torque, as a simulation may write it, instead of the shaft torque.

    torque, nominal_airgap, drag: (n,) [Nm]; drag is the nominal friction torque.  The inertial torque is neglected, as
    it is mostly noise at steady speed.  The air-gap torque is assumed only if it fits far better at several speeds: at
    one speed, any torque missing in the model may equal the drag.
    """
    low, high = np.nanquantile(drag, (0.05, 0.95))
    if min(abs(low), abs(high)) > ONE_SPEED * max(abs(low), abs(high)) and low * high > 0.0:
        return False
    good = np.isfinite(torque) & np.isfinite(nominal_airgap) & np.isfinite(drag)
    left = (torque - nominal_airgap)[good]
    as_airgap, as_shaft = np.median(np.abs(left)), np.median(np.abs(left + drag[good]))
    return bool(as_airgap < 0.4 * as_shaft)


def bend_gain(view, order) -> np.ndarray:
    """(b,) share of the largest gain with which an angle of this order enters a shaft's acceleration (blocks.py)."""
    x = order * np.abs(view.omega.mean(axis=1)) * view.sample_time_s
    return np.where(view.turns_freely, np.abs(np.sin(x) * np.sin(0.5 * x)), 0.0)
