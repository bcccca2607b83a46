# SPDX-License-Identifier: BSD-3-Clause
"""The equations of the machine, each written once; dq values are complex, x = x_d + j x_q, in SI units and peak values.

    psi   = L_d i_d + j L_q i_q + psi_m                              flux_linkage
    u     = R i + j omega psi                                        steady_voltage
    u     = R i + [e^(j theta+) psi+ - e^(j theta) psi] / T          mean_emf, the second term over a period T
    di/dt = (u - R i - j omega psi) / L + j omega i                  slope_in_zero_vector, u = 0, seen from the stator
    T_e   = 3/2 p Im(conj(psi) i)                                    airgap_torque

``machine`` is [machine] of a drive file or anything with its keys.  Clarke and Park: fluxproof/plant/transforms.py.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.arrays import Complex


def flux_of_current(i, l_d, l_q):
    """L_d i_d + j L_q i_q [Wb] of dq currents [A]."""
    return l_d * i.real + 1j * l_q * i.imag


def current_of_flux(psi, l_d, l_q):
    """The inverse: dq currents [A] of flux linkages without that of the magnets [Wb]."""
    return psi.real / l_d + 1j * psi.imag / l_q


def flux_linkage(machine, i):
    """Flux linkage of dq currents [A], complex [Wb]."""
    return flux_of_current(i, machine.inductance_d_h, machine.inductance_q_h) + machine.magnet_flux_wb


def flux_terms(machine, i: Complex) -> tuple[Complex, Complex, Complex]:
    """The three terms of the flux linkage [Wb], of L_d, L_q and psi_m."""
    d, q = machine.inductance_d_h * i.real + 0j, 1j * machine.inductance_q_h * i.imag
    return d, q, machine.magnet_flux_wb + 0.0 * i


def steady_voltage(machine, i, omega, psi=None):
    """Voltage [V] of constant dq currents [A] at electrical speeds [rad/s]; psi: flux linkage, by default nominal."""
    return machine.resistance_ohm * i + 1j * omega * (flux_linkage(machine, i) if psi is None else psi)


def mean_emf(psi, turn, period):
    """Mean EMF [V] over intervals of length ``period`` [s].

    psi, turn: at begin and end of the intervals, flux linkages in dq [Wb] and factors from dq to the frame of the EMF.
    """
    return (turn[1] * psi[1] - turn[0] * psi[0]) / period


def slope_in_zero_vector(machine, i, omega, psi):
    """Slope [A/s] of the stator current while all phases are shorted, in dq."""
    emf = -steady_voltage(machine, i, omega, psi)
    return current_of_flux(emf, machine.inductance_d_h, machine.inductance_q_h) + 1j * omega * i


def airgap_torque(machine, psi, i):
    """Air-gap torque [Nm] of flux linkages [Wb] and currents [A] in dq."""
    return 1.5 * machine.pole_pairs * (np.conj(psi) * i).imag


def rated_torque(machine) -> float:
    """Torque of the magnets at rated current [Nm]."""
    return 1.5 * machine.pole_pairs * machine.magnet_flux_wb * machine.rated_current_a
