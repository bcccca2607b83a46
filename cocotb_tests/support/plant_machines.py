# SPDX-License-Identifier: BSD-3-Clause
"""The machine of the flux-estimator paper as a plant, also saturated and with harmonics, and duties for a voltage."""

from dataclasses import replace

import numpy as np

from cocotb_tests.support.drives import BUS, L_D, L_Q, PAIRS, PSI, R
from fluxproof.plant import FluxMap, Harmonic, Machine

PERIOD = 1e-4
U_DC = BUS
# Table 2 of the flux-estimator paper; rated current 3.7 A rms.
MACHINE = Machine(
    pole_pairs=PAIRS,
    resistance_ohm=R,
    inductance_d_h=L_D,
    inductance_q_h=L_Q,
    magnet_flux_wb=PSI,
    inertia_kgm2=1.6e-3,
    viscous_friction_nms=7.48e-4,
)
SATURATED = replace(MACHINE, saturation_d_per_a2=0.003, saturation_q_per_a2=0.006, cross_saturation_wb_per_a2=1.5e-4)
HARMONIC = replace(MACHINE, emf_harmonics=(Harmonic(6, 0.02, 0.03, 0.4), Harmonic(12, 0.005, -0.01, 1.0)))


def duties_for(theta, u_d, u_q, u_dc=U_DC):
    """Duties that apply a dq voltage at the angle theta, star point centred."""
    u = (u_d + 1j * u_q) * np.exp(1j * theta)
    legs = np.array([(u * np.exp(-2j * np.pi * k / 3)).real for k in range(3)])
    return 0.5 + (legs - 0.5 * (legs.max() + legs.min())) / u_dc


def clarke(legs):
    """Amplitude-invariant Clarke transform to a complex number."""
    return 2.0 / 3.0 * sum(v * np.exp(2j * np.pi * k / 3) for k, v in enumerate(legs))


def linear_map(machine=MACHINE, limit=12.0, count=25):
    """Flux map of the linear machine."""
    axis = np.linspace(-limit, limit, count)
    i_d, i_q = np.meshgrid(axis, axis, indexing="ij")
    psi_d = machine.magnet_flux_wb + machine.inductance_d_h * i_d
    return FluxMap(axis, axis, psi_d, machine.inductance_q_h * i_q)
