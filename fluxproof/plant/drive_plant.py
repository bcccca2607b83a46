# SPDX-License-Identifier: BSD-3-Clause
"""Python side of the plant: functions that build parameters and states, and two convenience classes.

Loops that need speed call the kernels `advance_averaged` and `advance_switching`
from their own compiled code, with the parameters and the state built here.
"""

import math

import numpy as np

from fluxproof.plant import layout as L
from fluxproof.plant.averaged import advance_averaged, skewed_currents
from fluxproof.plant.inverter import Inverter, inverter_params
from fluxproof.plant.kernel import PlantParams, refresh
from fluxproof.plant.mechanics import FREE, mechanics_params
from fluxproof.plant.pmsm import flux_from_currents, harmonic_flux, machine_params, magnet_flux, short_time_constant
from fluxproof.plant.switching import advance_switching


def plant_params(machine, inverter=None, mode=FREE, substeps=2, max_step_s=10e-6):
    """Build PlantParams from a Machine and an Inverter (None: ideal).

    mode: FREE or IMPOSED_SPEED.  substeps: Runge-Kutta steps per period of the
    averaged plant.  max_step_s: longest step of the switching plant.
    """
    if substeps < 1 or max_step_s <= 0.0:
        raise ValueError("substeps and max_step_s must be positive")
    of_machine = machine_params(machine)
    if short_time_constant(of_machine) < max_step_s:
        raise ValueError(
            f"the time constant of the short, {short_time_constant(of_machine):.2g} s, is below max_step_s"
        )
    return PlantParams(
        of_machine,
        mechanics_params(machine, mode),
        inverter_params(inverter or Inverter()),
        int(substeps),
        float(max_step_s),
    )


def initial_state(machine, params, i_d=0.0, i_q=0.0, omega_m=0.0, theta_m=0.0, gates=0):
    """Build a state vector from terminal currents [A], speed [rad/s] and angle [rad]."""
    m = params.machine
    state = L.empty_state()
    state[L.OMEGA_M], state[L.THETA_M], state[L.GATES] = omega_m, theta_m, gates
    state[L.TEMP_WINDING], state[L.TEMP_MAGNET] = machine.temperature_winding_c, machine.temperature_magnet_c
    psi_m = magnet_flux(m, machine.temperature_magnet_c)
    h_d, h_q, _, _ = harmonic_flux(m, psi_m, theta_m)
    iron = m.iron_conductance * m.pole_pairs * omega_m
    x_d, x_q = i_d, i_q
    for _ in range(50):  # the iron-loss current is small: fixed-point iteration converges
        psi_d, psi_q = flux_from_currents(m, psi_m, x_d, x_q)
        psi_d, psi_q = psi_d + h_d, psi_q + h_q
        if iron == 0.0:
            break
        x_d, x_q = i_d + iron * psi_q, i_q - iron * psi_d
    cosine, sine = math.cos(m.pole_pairs * theta_m), math.sin(m.pole_pairs * theta_m)
    state[L.LAMBDA_ALPHA] = cosine * psi_d - sine * psi_q
    state[L.LAMBDA_BETA] = sine * psi_d + cosine * psi_q
    state[L.I_D], state[L.I_Q] = x_d, x_q
    refresh(state, params)
    return state


class _Plant:
    """State and parameters of one drive, with properties for the outputs."""

    def __init__(self, machine, inverter=None, mode=FREE, substeps=2, max_step_s=10e-6, **start):
        self.params = plant_params(machine, inverter, mode, substeps, max_step_s)
        self.state = initial_state(machine, self.params, **start)

    @property
    def i_abc(self):
        """Terminal currents [A], shape (3,)."""
        return self.state[L.I_A : L.I_C + 1].copy()

    @property
    def i_dq(self):
        """Terminal currents in the rotor frame [A], shape (2,)."""
        return self.state[L.I_D : L.I_Q + 1].copy()

    @property
    def lambda_dq(self):
        """Flux linkage in the rotor frame [Wb], shape (2,)."""
        return self.state[L.LAMBDA_D : L.LAMBDA_Q + 1].copy()

    @property
    def u_alpha_beta(self):
        """Mean terminal voltage over the last period [V], shape (2,)."""
        return self.state[L.U_ALPHA : L.U_BETA + 1].copy()

    @property
    def omega_m(self):
        """Mechanical speed [rad/s]."""
        return self.state[L.OMEGA_M]

    @property
    def theta_m(self):
        """Mechanical angle, not wrapped [rad]."""
        return self.state[L.THETA_M]

    @property
    def theta_e(self):
        """Electrical angle of the d axis, 0..2 pi [rad]."""
        return self.state[L.THETA_E]

    @property
    def torque(self):
        """Air-gap torque [Nm]."""
        return self.state[L.TORQUE]

    @property
    def time(self):
        """Time since the start [s]."""
        return self.state[L.TIME]


class AveragedPlant(_Plant):
    """Drive with the averaged plant: duties once per period."""

    def advance(self, duties, u_dc, load, period_s, half=0):
        """One period (see `advance_averaged`); returns the state vector."""
        duties = np.asarray(duties, float)
        advance_averaged(self.state, self.params, duties, float(u_dc), float(load), period_s, half)
        return self.state

    def skewed_currents(self, skew_s):
        """Phase currents [A], (3,), skew_s after the PWM centre (see `skewed_currents`)."""
        return np.array(skewed_currents(self.state, self.params, float(skew_s)))


class SwitchingPlant(_Plant):
    """Drive with the switching plant: gate edges once per period."""

    def advance(self, edge_times, gate_words, u_dc, load, period_s, probe_s=-1.0):
        """One period (see `advance_switching`); returns the state vector."""
        advance_switching(
            self.state,
            self.params,
            np.asarray(edge_times, float),
            np.asarray(gate_words, np.int64),
            float(u_dc),
            float(load),
            period_s,
            float(probe_s),
        )
        return self.state
