# SPDX-License-Identifier: BSD-3-Clause
"""Permanent-magnet synchronous machine: description and magnetic model.

Flux linkage is the state; currents follow from it.  The functional magnetic
model is the derivative of a stored field energy W (the Legendre dual of the
co-energy), so it is reciprocal for any coefficients:

    x = (psi_d - psi_m) / L_d,   y = psi_q / L_q          "unsaturated currents" [A]
    W = L_d (x^2/2 + s_d x^4/4) + L_q (y^2/2 + s_q y^4/4) + c r(x) y^2
    i_d = (dW/dx) / L_d = x (1 + s_d x^2) + (c / L_d) r'(x) y^2
    i_q = (dW/dy) / L_q = y (1 + s_q y^2) + (2 c / L_q) r(x) y

with r(x) = x / sqrt(1 + (x/x_c)^2), x_c = L_q / (4 |c|), which equals x for
small x and keeps W bounded below.  To first order this is the usual picture
psi_q = L_q (i_q - s_q i_q^3) - 2 c i_d i_q,  psi_d = L_d i_d + psi_m - c i_q^2;
at larger currents it deviates from it, as real machines do.

Magnet harmonics in the rotor frame, angle n theta + phi, relative to psi_m:
    psi_hd = a_d psi_m cos(.),  psi_hq = a_q psi_m sin(.)
    T = 1.5 p (psi_d i_q - psi_q i_d + dpsi_hd/dtheta i_d + dpsi_hq/dtheta i_q) + cogging
which fulfils the power balance exactly (psi includes psi_h).

Iron loss is a conductance across the rotational EMF: the terminal current is
i + g w J psi.  The transformer EMF is neglected, so the current is a function
of the state and does not jump at the PWM edges.

A short over the share mu of a phase's turns, with the resistance R_f and the leakage l of those turns, carries i_f:
    l di_f/dt = mu u_phase - (R_f + mu (1 - mu) R_phase) i_f
    magnetising and dissipating in R: terminal current less (2/3) mu i_f along the phase's axis
All other flux of the turns is that of their phase, as L grows with the square of the turns in the models of Vaseghi
(ICEM 2008) and Romeral (IEEE TIE 2011); the zero sequence of the winding's voltage is neglected, mu R i_f / 3.
Power is exact: mu i_f u_phase heats the short and loads l.
"""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from fluxproof.plant.flux_map import FluxMap, map_currents, map_flux
from fluxproof.plant.jit import njit

LINEAR = 0
SATURATED = 1
MAPPED = 2


@dataclass(frozen=True)
class Harmonic:
    """One magnet-flux harmonic in the rotor frame (see the module's header).

    order: per electrical turn; order x pole_pairs must be whole, so 1/p (rotor
    eccentricity) is allowed.  amplitude_d, amplitude_q: relative to psi_m.
    """

    order: float
    amplitude_d: float = 0.0
    amplitude_q: float = 0.0
    phase_rad: float = 0.0


@dataclass(frozen=True)
class Machine:
    """Machine data in SI units; every zero or None means that the effect is absent."""

    pole_pairs: int
    resistance_ohm: float  # per phase at temperature_ref_c
    inductance_d_h: float
    inductance_q_h: float
    magnet_flux_wb: float  # at temperature_ref_c
    inertia_kgm2: float
    viscous_friction_nms: float = 0.0
    coulomb_friction_nm: float = 0.0
    resistance_temp_coeff_per_k: float = 0.0  # copper: 0.0039
    magnet_temp_coeff_per_k: float = 0.0  # NdFeB: about -0.001
    temperature_winding_c: float = 20.0  # initial value; then in the state
    temperature_magnet_c: float = 20.0
    temperature_ref_c: float = 20.0
    saturation_d_per_a2: float = 0.0  # s_d
    saturation_q_per_a2: float = 0.0  # s_q
    cross_saturation_wb_per_a2: float = 0.0  # c
    iron_conductance_s: float = 0.0  # 1 / R_fe
    emf_harmonics: tuple[Harmonic, ...] = ()
    phase_resistance_asymmetry: tuple[float, float, float] = (0.0, 0.0, 0.0)  # relative
    cogging_amplitude_nm: float = 0.0
    cogging_order: int = 0  # per mechanical turn
    cogging_phase_rad: float = 0.0
    shorted_share: float = 0.0  # of the turns of a phase, below 1
    shorted_phase: int = 0  # 0, 1, 2: a, b, c
    shorted_resistance_ohm: float = 0.0  # of the short itself
    shorted_leakage_h: float = 0.0  # of the shorted turns; l / (R_f + mu R) must exceed the plant's step
    # Replaces L_d, L_q and the saturation; magnet_flux_wb then only scales harmonics and drift.
    flux_map: FluxMap | None = None

    @classmethod
    def from_mapping(cls, mapping):
        """Build from a mapping such as a TOML table; unknown keys are ignored."""
        known = {f.name for f in fields(cls)}
        return cls(**{key: value for key, value in mapping.items() if key in known})


class MachineParams(NamedTuple):
    """Machine parameters for the kernels (build with `machine_params`)."""

    model: int  # LINEAR, SATURATED or MAPPED
    pole_pairs: float
    inductance_d: float
    inductance_q: float
    magnet_flux: float
    saturation_d: float
    saturation_q: float
    cross: float
    cross_limit: float  # x_c [A]
    iron_conductance: float
    resistance: np.ndarray  # phases a, b, c at the reference temperature, (3,)
    resistance_temp_coeff: float
    magnet_temp_coeff: float
    temperature_ref: float
    harmonics: np.ndarray  # rows: order per mechanical turn, a_d, a_q, phase; (n, 4)
    cogging_amplitude: float
    cogging_order: float
    cogging_phase: float
    map_table: np.ndarray  # (2, n+2, m+2)
    map_axes: np.ndarray  # (4,)
    shorted_phase: int
    shorted_share: float  # mu
    shorted_resistance: float  # R_f [ohm]
    shorted_slope: float  # 1/l, 0.0 without a short [1/H]
    shorted_alpha: float  # (2/3) mu along the phase's axis
    shorted_beta: float


def machine_params(machine):
    """Build MachineParams from a Machine; ValueError for values without physical meaning."""
    m = machine
    for name in ("pole_pairs", "inductance_d_h", "inductance_q_h"):
        if getattr(m, name) <= 0:
            raise ValueError(f"{name} must be positive")
    if min(m.saturation_d_per_a2, m.saturation_q_per_a2, m.iron_conductance_s) < 0.0:
        raise ValueError("saturation and iron conductance must not be negative")
    mu = float(m.shorted_share)
    if not 0.0 <= mu < 1.0 or m.shorted_phase not in (0, 1, 2) or m.shorted_resistance_ohm < 0.0:
        raise ValueError("a short has a share of 0 to below 1, a phase of 0, 1, 2, and no negative resistance")
    if mu and m.shorted_leakage_h <= 0.0:
        raise ValueError("shorted_leakage_h must be positive where shorted_share is")
    rows = []
    for h in m.emf_harmonics:
        per_turn = round(h.order * m.pole_pairs)
        if abs(per_turn - h.order * m.pole_pairs) > 1e-9:
            raise ValueError(f"harmonic order {h.order}: order x pole_pairs must be whole")
        rows.append((per_turn, h.amplitude_d, h.amplitude_q, h.phase_rad))
    cross = float(m.cross_saturation_wb_per_a2)
    if m.flux_map is not None:
        if folds := m.flux_map.folds():
            raise ValueError(f"flux map: no unique current at {folds} points; see FluxMap.mended")
        model, table, axes = MAPPED, m.flux_map.table(), m.flux_map.axes()
    else:
        saturated = m.saturation_d_per_a2 or m.saturation_q_per_a2 or cross
        model, table, axes = (SATURATED if saturated else LINEAR), np.zeros((2, 1, 1)), np.zeros(4)
    return MachineParams(
        model=model,
        pole_pairs=float(m.pole_pairs),
        inductance_d=float(m.inductance_d_h),
        inductance_q=float(m.inductance_q_h),
        magnet_flux=float(m.magnet_flux_wb),
        saturation_d=float(m.saturation_d_per_a2),
        saturation_q=float(m.saturation_q_per_a2),
        cross=cross,
        cross_limit=m.inductance_q_h / (4.0 * abs(cross)) if cross else math.inf,
        iron_conductance=float(m.iron_conductance_s),
        resistance=m.resistance_ohm * (1.0 + np.asarray(m.phase_resistance_asymmetry, float)),
        resistance_temp_coeff=float(m.resistance_temp_coeff_per_k),
        magnet_temp_coeff=float(m.magnet_temp_coeff_per_k),
        temperature_ref=float(m.temperature_ref_c),
        harmonics=np.array(rows, dtype=float).reshape(-1, 4),
        cogging_amplitude=float(m.cogging_amplitude_nm),
        cogging_order=float(m.cogging_order),
        cogging_phase=float(m.cogging_phase_rad),
        map_table=table,
        map_axes=axes,
        shorted_phase=m.shorted_phase,
        shorted_share=mu,
        shorted_resistance=float(m.shorted_resistance_ohm),
        shorted_slope=1.0 / m.shorted_leakage_h if mu else 0.0,
        shorted_alpha=2.0 / 3.0 * mu * math.cos(2.0 * math.pi / 3.0 * m.shorted_phase),
        shorted_beta=2.0 / 3.0 * mu * math.sin(2.0 * math.pi / 3.0 * m.shorted_phase),
    )


def short_time_constant(m):
    """l / (R_f + mu (1 - mu) R) [s] of the short in MachineParams; infinite without one."""
    if m.shorted_share == 0.0:
        return math.inf
    winding = m.resistance[m.shorted_phase] * m.shorted_share * (1.0 - m.shorted_share)
    return 1.0 / (m.shorted_slope * (m.shorted_resistance + winding))


@njit
def _saturated_currents(m, x, y):
    """Currents and their slopes: (i_d, i_q, di_d/dx, di_d/dy, di_q/dx, di_q/dy)."""
    u = x / m.cross_limit
    root = math.sqrt(1.0 + u * u)
    r, r1 = x / root, 1.0 / (root * root * root)
    r2 = -3.0 * u / (m.cross_limit * root**5)
    c_d, c_q = m.cross / m.inductance_d, m.cross / m.inductance_q
    x2, y2 = x * x, y * y
    return (
        x * (1.0 + m.saturation_d * x2) + c_d * r1 * y2,
        y * (1.0 + m.saturation_q * y2) + 2.0 * c_q * r * y,
        1.0 + 3.0 * m.saturation_d * x2 + c_d * r2 * y2,
        2.0 * c_d * r1 * y,
        2.0 * c_q * r1 * y,
        1.0 + 3.0 * m.saturation_q * y2 + 2.0 * c_q * r,
    )


@njit
def magnet_flux(m, temperature_c):
    """Magnet flux linkage [Wb] at the magnet's temperature [deg C]."""
    return m.magnet_flux * (1.0 + m.magnet_temp_coeff * (temperature_c - m.temperature_ref))


@njit
def currents_from_flux(m, psi_m, psi_d, psi_q, guess_d, guess_q):
    """Magnetising currents (i_d, i_q) [A] of the flux without its harmonics [Wb].

    psi_m: magnet flux at temperature.  A flux map contains the flux of the magnet at
    reference temperature, so only its drift is subtracted.  The guess is used for
    the inversion of a map only.
    """
    if m.model == MAPPED:
        drift = psi_m - m.magnet_flux
        return map_currents(m.map_table, m.map_axes, psi_d - drift, psi_q, guess_d, guess_q)
    x, y = (psi_d - psi_m) / m.inductance_d, psi_q / m.inductance_q
    if m.model == LINEAR:
        return x, y
    i_d, i_q, _, _, _, _ = _saturated_currents(m, x, y)
    return i_d, i_q


@njit
def flux_from_currents(m, psi_m, i_d, i_q):
    """Flux linkage (psi_d, psi_q) [Wb], without harmonics, of magnetising currents [A]."""
    if m.model == MAPPED:
        psi_d, psi_q, _, _, _, _ = map_flux(m.map_table, m.map_axes, i_d, i_q)
        return psi_d + (psi_m - m.magnet_flux), psi_q
    x, y = i_d, i_q
    if m.model == SATURATED:
        for _ in range(60):
            f_d, f_q, dx, dy, qx, qy = _saturated_currents(m, x, y)
            e_d, e_q = i_d - f_d, i_q - f_q
            det = dx * qy - dy * qx
            x += (qy * e_d - dy * e_q) / det
            y += (dx * e_q - qx * e_d) / det
            if abs(e_d) + abs(e_q) < 1e-13 * (1.0 + abs(i_d) + abs(i_q)):
                break
    return psi_m + m.inductance_d * x, m.inductance_q * y


@njit
def harmonic_flux(m, psi_m, theta_m):
    """Harmonic magnet flux and its slope per electrical radian: (h_d, h_q, h_d', h_q') [Wb]."""
    h_d = h_q = g_d = g_q = 0.0
    for k in range(m.harmonics.shape[0]):
        angle = m.harmonics[k, 0] * theta_m + m.harmonics[k, 3]
        order = m.harmonics[k, 0] / m.pole_pairs
        sine, cosine = math.sin(angle), math.cos(angle)
        a_d, a_q = psi_m * m.harmonics[k, 1], psi_m * m.harmonics[k, 2]
        h_d += a_d * cosine
        h_q += a_q * sine
        g_d -= order * a_d * sine
        g_q += order * a_q * cosine
    return h_d, h_q, g_d, g_q
