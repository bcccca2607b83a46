# SPDX-License-Identifier: BSD-3-Clause
"""The misfit of the nominal drive: the sampled flux balance, the current sum and the torque balance.

    u:      u_mean - R mean(i) - [psi_s(i+, theta+) - psi_s(i, theta)] / T, in dq at the middle angle
    sum:    i_a + i_b + i_c
    torque: T_shaft - (T_airgap - B omega_m - J d omega_m / dt)

each less what the drive file describes beyond a linear machine (described.py).

The difference of flux linkages over a period is exact; nothing is differentiated.  The mean current is the mean of
both samples minus a parabola: within a period the mean voltage is constant while the magnets rotate.  The total flux is
linear in time, the magnet flux is not, and the current carries the difference, (omega T)^2 psi_m / (12 L_d) on the
d axis.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.described import described
from fluxproof.diagnosis.effects import torque_of


def misfit(view) -> dict[str, np.ndarray]:
    """Recorded minus nominal values, {channel: array} (see effects/columns.py)."""
    m = view.machine
    exact = view.with_raw_current()
    r = np.full(len(view), m.resistance_ohm)
    if m.resistance_temp_coeff_per_k:
        hot = np.where(np.isfinite(view.temp), view.temp, m.temperature_winding_c) - m.temperature_ref_c
        r = r * (1.0 + m.resistance_temp_coeff_per_k * hot)
    needed = r[:, None] * (exact.i_mid - bulge(view)) + view.flux(exact.nominal_psi)
    out = {"u": view.to_dq(view.u[:, 1:-1]) - needed}
    if view.has_sum:
        total = view.i_abc.sum(axis=2)
        out["sum"] = 0.5 * (total[:, 1:] + total[:, :-1])
    if np.isfinite(view.torque).any():
        out["torque"] = view.torque - shaft_torque(view, exact)
    for channel, values in described(view).items():
        if channel in out:
            out[channel] = out[channel] - values
    return out


def bulge(view):
    """Mean of both samples minus the mean current of the interval, (b, m) on the d axis [A]."""
    m = view.machine
    return (view.omega_mid * view.sample_time_s) ** 2 * m.magnet_flux_wb / (12.0 * m.inductance_d_h)


def shaft_torque(view, exact):
    """Shaft torque of the nominal drive, (b, m) [Nm]."""
    m = view.machine
    omega_m = view.omega_mid / m.pole_pairs
    coulomb = (m.coulomb_friction_nm or 0.0) * np.sign(omega_m)
    airgap = torque_of(view, exact.nominal_psi, exact.i)
    return airgap - (m.viscous_friction_nms or 0.0) * omega_m - coulomb - (m.inertia_kgm2 or 0.0) * view.slope_m
