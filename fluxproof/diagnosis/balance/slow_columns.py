# SPDX-License-Identifier: BSD-3-Clause
"""The columns of a slow log that a voltage balance uses: dq current and voltage, speed, bus, angle, torque."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.shaft import airgap, is_airgap
from fluxproof.diagnosis.ground.recording import Recording, RecordingError
from fluxproof.plant.transforms import space_vector

COMPUTED = 5e-4  # of the torque: what a measured one differs from the formula at least


def operating_columns(recording: Recording, nominal):
    """(i, u, omega, u_dc): dq current [A] and voltage [V] complex, speed [rad/s], bus [V], all (n,)."""
    r = recording
    if not r.has("omega_e"):
        raise RecordingError(f"{r.source}: a slow recording needs the speed omega_e: its angle is sampled too rarely")
    omega = r["omega_e"]
    u_dc = r["u_dc"] if r.has("u_dc") else np.full(len(r), float(nominal.inverter.dc_bus_v))
    if r.has("i_d", "i_q"):
        i = r["i_d"] + 1j * r["i_q"]
    elif r.has("i_a", "i_b", "theta_e"):
        third = r["i_c"] if r.has("i_c") else -r["i_a"] - r["i_b"]
        i = space_vector(np.stack([r["i_a"], r["i_b"], third], axis=1)) * np.exp(-1j * r["theta_e"])
    else:
        raise RecordingError(f"{r.source}: i_d, i_q or i_a, i_b with theta_e are needed")
    if r.has("u_q_ref") and not r.has("d_a", "d_b", "d_c", "theta_e"):
        u_d = r["u_d_ref"] if r.has("u_d_ref") else np.full(len(r), np.nan)
        return i, u_d + 1j * r["u_q_ref"], omega, u_dc
    if r.has("u_d_ref", "u_q_ref"):
        return i, r["u_d_ref"] + 1j * r["u_q_ref"], omega, u_dc
    if not r.has("d_a", "d_b", "d_c", "theta_e"):
        raise RecordingError(f"{r.source}: u_d_ref, u_q_ref or d_a, d_b, d_c with theta_e are needed")
    ahead = (nominal.control.duty_applied_after_samples + 0.5) * nominal.sample_time_s * omega
    duties = np.stack([r["d_a"], r["d_b"], r["d_c"]], axis=1)
    return i, space_vector(duties) * u_dc * np.exp(-1j * (r["theta_e"] + ahead)), omega, u_dc


def known_voltage(u, nominal_u):
    """(voltage (n,) complex [V], whether u_d is known); an unknown u_d is set to the nominal one and not used."""
    if np.isfinite(u.real).any():
        return u, True
    return nominal_u.real + 1j * u.imag, False


def known_angle(recording) -> np.ndarray:
    """(n,) recorded angle [rad], nan if it was integrated from the speed or is missing."""
    if not recording.has("theta_e") or recording.meta.get("angle") == "integrated":
        return np.full(len(recording), np.nan)
    return recording["theta_e"]


def torque_at_shaft(recording, nominal, i, omega) -> np.ndarray:
    """(n,) measured torque of a steady drive [Nm], less the drag if the air-gap torque was recorded.

    nan without one, and of one that a drive computed from the currents: no transducer agrees with a formula as closely.
    """
    if not recording.has("torque"):
        return np.full(len(recording), np.nan)
    torque, nominal_airgap = recording["torque"], airgap(nominal, i)
    if np.nanmedian(np.abs(torque - nominal_airgap)) <= COMPUTED * np.nanmedian(np.abs(torque)):
        return np.full(len(recording), np.nan)
    drag = (nominal.machine.viscous_friction_nms or 0.0) * omega / nominal.machine.pole_pairs
    return torque - drag if is_airgap(torque, nominal_airgap, drag) else torque
