# SPDX-License-Identifier: BSD-3-Clause
"""Model of the drive with all parameters that may be wrong, and its prediction of a recording.

    u_s = R_x i_s + d psi_s / dt + V_dead sgn(i_x),   psi = L i + psi_m + saturation + cross-saturation + harmonics
    i   = (i_measured - offset) / (1 + gain),  theta = theta_measured - offset - eccentricity

over one sample, exactly as the balance in data.py.  Parameters are dimensionless: zero is nominal, one is a
change that would interest an engineer (``PARAMETERS``).  One scale of all currents is the same as R, L_d and
L_q wrong by one factor, a gain of the bus the same as these and psi_m: neither can be a parameter beside them.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.machine import airgap_torque, flux_linkage, rated_torque, slope_in_zero_vector
from fluxproof.plant.transforms import PATTERNS, space_vector
from studies.compare.data import Data
from studies.compare.dictionary import SOFT, TORQUE_ORDERS

# parameter: (effect, size of one unit; relative, of rated values, or SI)
PARAMETERS = {
    "R": ("resistance", 0.1),  # of R
    "R_warm": ("resistance_temperature", 0.1),  # of R, over the recording
    "L_d": ("inductance_d", 0.05),  # of L_d
    "L_q": ("inductance_q", 0.05),  # of L_q
    "psi_m": ("magnet_flux", 0.02),  # of psi_m
    "psi_m_drift": ("magnet_temperature", 0.02),  # of psi_m, over the recording
    "v_dead": ("dead_time", 0.005),  # of the bus
    "sat_d": ("saturation", 0.05),  # of L_d i_rated, at rated current
    "sat_q": ("saturation", 0.05),
    "cross": ("cross_saturation", 0.02),  # of psi_m, at rated i_q
    "g_fe": ("iron_loss", 0.02),  # of the rated current, at the largest EMF
    **{f"h{h}{part}": ("emf_harmonics", 0.002) for h in (6, 12) for part in ("fc", "fs", "bc", "bs")},  # of psi_m
    "delay": ("delay", 0.05),  # of a sample time
    "skew": ("sampling_skew", 0.005),  # of a sample time
    "angle": ("encoder_offset", 0.02),  # rad
    "ecc_c": ("encoder_eccentricity", 0.01),  # rad
    "ecc_s": ("encoder_eccentricity", 0.01),
    "offset_a": ("current_offset", 0.005),  # of the rated current
    "offset_b": ("current_offset", 0.005),
    "offset_0": ("current_offset", 0.005),  # all phases; only with three sensors
    "gain_a": ("current_gain", 0.01),
    "gain_b": ("current_gain", 0.01),
    "asym_a": ("phase_resistance_asymmetry", 0.05),  # of R
    "asym_b": ("phase_resistance_asymmetry", 0.05),
    "k_t": ("", 0.01),  # of the torque: not an effect, but the trace of a wrong current scale or bus gain
    "viscous": ("friction", 0.02),  # of the rated torque, at the largest speed
    "coulomb": ("friction", 0.02),  # of the rated torque
    **{f"cog{h}{part}": ("cogging", 0.02) for h in TORQUE_ORDERS for part in "cs"},  # of the rated torque
}
ONLY = {"offset_0": "sum", "k_t": "torque", "viscous": "torque", "coulomb": "torque"}
# Two patterns over the phases whose sum is zero.
ALPHA, BETA = (np.array(weights) for weights in PATTERNS.values())


class Model:
    """Prediction of a case's misfit for parameters (k,).  ``names``: those that its channels determine."""

    def __init__(self, data: Data, blocks=slice(None)):
        self.v = data.view.take(np.arange(len(data.view))[blocks])
        v, m = self.v, data.view.machine
        self.channels = list(data.misfit)
        self.names = [
            name
            for name in PARAMETERS
            if ("torque" if name.startswith("cog") else ONLY.get(name, "u")) in self.channels
        ]
        self.top = max(float(np.abs(data.view.omega).max()), 1e-9)
        self.rated_torque = rated_torque(m)
        self.time = (v.t / max(v.span_s, 1e-9))[:, None]
        temp = data.view.temp
        known = np.isfinite(temp).all() and np.ptp(temp) > 3.0
        self.warm = (v.temp - m.temperature_ref_c)[:, None] / np.ptp(temp) if known else self.time
        self.phases = v.phases(v.i)
        self.i_rate = self._slope()
        self.du = data.voltage_change()[blocks]
        self.back = np.exp(-1j * v.theta_mid)
        self.nominal = None
        self.nominal = self._signals(dict.fromkeys(PARAMETERS, 0.0))

    def _slope(self):
        """Slope of the current within the zero vector, dq (b, m+1) [A/s]."""
        return slope_in_zero_vector(self.v.machine, self.v.i, self.v.omega, self.v.nominal_psi)

    def __call__(self, p: np.ndarray) -> dict[str, np.ndarray]:
        """Change of every channel (b, m) against the nominal drive, for parameters in the order of ``names``."""
        units = dict.fromkeys(PARAMETERS, 0.0)
        units.update((name, value * PARAMETERS[name][1]) for name, value in zip(self.names, p, strict=True))
        signals = self._signals(units)
        return {c: signals[c] - self.nominal[c] for c in self.channels}

    def _signals(self, p):
        v, m, i_r = self.v, self.v.machine, self.v.machine.rated_current_a
        theta_m = v.theta / m.pole_pairs
        turn = p["angle"] + p["ecc_c"] * np.cos(theta_m) + p["ecc_s"] * np.sin(theta_m)
        offset = (p["offset_a"] * ALPHA + p["offset_b"] * BETA + p["offset_0"]) * i_r
        gain = p["gain_a"] * ALPHA + p["gain_b"] * BETA
        phases = (self.phases - offset) / (1.0 + gain)
        theta = v.theta - turn
        rotor = np.exp(1j * theta)
        i = space_vector(phases) / rotor - p["skew"] * v.sample_time_s * self.i_rate
        psi, harmonics, reluctance = self._flux(p, i, theta)
        total = (psi + harmonics) * rotor
        x = 0.5 * (phases[:, 1:] + phases[:, :-1])
        asym = p["asym_a"] * ALPHA + p["asym_b"] * BETA
        legs = p["v_dead"] * v.nominal.inverter.dc_bus_v * np.clip(x / (SOFT * i_r), -1.0, 1.0)
        legs = legs + m.resistance_ohm * asym * x
        i_s = i * rotor
        r = m.resistance_ohm * (1.0 + p["R"] + p["R_warm"] * self.warm)
        u = r * 0.5 * (i_s[:, 1:] + i_s[:, :-1]) + (total[:, 1:] - total[:, :-1]) / v.sample_time_s
        u = u + space_vector(legs)
        out = {"u": u * self.back + p["delay"] * self.du}
        if "sum" in self.channels:
            wrong = (self.phases - phases).sum(axis=2)
            out["sum"] = 0.5 * (wrong[:, 1:] + wrong[:, :-1])
        if "torque" in self.channels:
            airgap = airgap_torque(m, psi + reluctance, i)
            out["torque"] = 0.5 * (1.0 + p["k_t"]) * (airgap[:, 1:] + airgap[:, :-1]) - self._shaft(p)
        return out

    def _flux(self, p, i, theta):
        """Flux linkage (b, m+1), that of the harmonics, and the harmonics as they count for the torque."""
        m, i_r = self.v.machine, self.v.machine.rated_current_a
        if p["g_fe"]:
            i = i - 1j * self.v.omega / self.top * flux_linkage(m, i) / m.magnet_flux_wb * p["g_fe"] * i_r
        d, q = i.real / i_r, i.imag / i_r
        l_d, l_q, psi_m = m.inductance_d_h * i_r, m.inductance_q_h * i_r, m.magnet_flux_wb
        psi_d = l_d * ((1.0 + p["L_d"]) * d - p["sat_d"] * d**3)
        psi_d = psi_d + psi_m * (1.0 + p["psi_m"] + p["psi_m_drift"] * self.time - p["cross"] * q**2)
        psi_q = l_q * ((1.0 + p["L_q"]) * q - p["sat_q"] * q**3) - 2.0 * p["cross"] * psi_m * d * q
        harmonics, reluctance = 0.0, 0.0
        for h in (6, 12):
            forward, backward = p[f"h{h}fc"] + 1j * p[f"h{h}fs"], p[f"h{h}bc"] + 1j * p[f"h{h}bs"]
            if forward or backward:
                wave = np.exp(1j * h * theta)
                f, b = psi_m * forward * wave, psi_m * backward * np.conj(wave)
                harmonics, reluctance = harmonics + f + b, reluctance + (1 - h) * f + (1 + h) * b
        return psi_d + 1j * psi_q, harmonics, reluctance

    def _shaft(self, p):
        """Torque lost on the way to the shaft, (b, m) [Nm]."""
        w, theta = self.v.omega_mid / self.top, self.v.theta_mid
        lost = p["viscous"] * w + p["coulomb"] * np.tanh(w / 0.01)
        for h in TORQUE_ORDERS:
            c, s = p[f"cog{h}c"], p[f"cog{h}s"]
            if c or s:
                lost = lost + c * np.cos(h * theta) + s * np.sin(h * theta)
        return lost * self.rated_torque
