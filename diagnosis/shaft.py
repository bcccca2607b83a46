"""What a recording knows of its shaft: a transducer, a shaft that turns freely without load, or nothing.

Without a transducer the mechanical balance J d omega_m / dt = T - B omega_m holds only where nobody else
turns the shaft, which a recording does not say.  It is taken as free when the airgap torque goes with
J d omega_m / dt through the transients, and as unloaded when what remains is an odd function of the speed
alone, in both directions: a load follows the speed only by chance, friction always does.
"""

from __future__ import annotations

import numpy as np

FREE_CORRELATION = 0.9
ODD_SHARE = 0.96  # of the remaining torque's variance that an odd function of speed must explain
SMALL = 0.01  # of rated torque: so little torque is no load in any case


def shaft_kind(recording, nominal, i_s, omega, linked) -> str:
    """'torque', 'unloaded', 'free' (a load may be there) or ''; i_s: smoothed dq current (n,), omega: (n,)."""
    if recording.has("torque"):
        return "torque"
    m = nominal.machine
    if not m.inertia_kgm2:
        return ""
    period = nominal.sample_time_s
    torque = airgap(nominal, i_s)
    omega_m = omega / m.pole_pairs
    reach = 8
    slope = np.full(len(omega), np.nan)
    slope[reach:-reach] = (omega_m[2 * reach :] - omega_m[: -2 * reach]) / (2 * reach * period)
    inert = m.inertia_kgm2 * slope
    good = np.isfinite(inert) & np.isfinite(torque)
    good[:-1] &= linked
    rated = airgap(nominal, np.array(1j * m.rated_current_a))
    moving = good & (np.abs(inert) > 0.05 * rated)
    if moving.sum() < 200:
        return ""
    x, y = inert[moving], torque[moving]
    if np.corrcoef(x, y)[0, 1] < FREE_CORRELATION or not 0.7 < (x @ y) / (x @ x) < 1.4:
        return ""
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


def airgap(nominal, i):
    """Air-gap torque [Nm] of the nominal machine for dq currents, complex [A]."""
    m = nominal.machine
    psi = m.inductance_d_h * i.real + m.magnet_flux_wb + 1j * m.inductance_q_h * i.imag
    return 1.5 * m.pole_pairs * (np.conj(psi) * i).imag
