# SPDX-License-Identifier: BSD-3-Clause
"""A plant of motulator's machine, inverter and shaft, and motulator's own controller."""

from __future__ import annotations

import numpy as np
from motulator.common.utils import abc2complex, complex2abc
from motulator.drive import model
from motulator.drive.control.sm import CurrentReferenceCfg, CurrentVectorControl
from motulator.drive.utils import SynchronousMachinePars

from studies.blind.strangers.plant import Plant


def saturated(truth, drive):
    """i_s(psi_s) of an algebraic saturation model (Awan, Hinkkanen and others, as in motulator's examples).

    i_d = (1 + a |psi_d - psi_f|^S + c/(V+2) |psi_q|^(V+2)) (psi_d - psi_f) / L_d, i_q accordingly: one co-energy.
    """
    rated_d, rated_q = truth.l_d * drive.current, truth.l_q * drive.current
    a_d, a_q = truth.knee_d / rated_d**2, truth.knee_q / rated_q**3
    c = truth.cross

    def i_s(psi):
        d, q = psi.real - truth.psi, psi.imag
        x, y = d / rated_d, q / rated_q
        i_d = (1.0 + a_d * d**2) * d / truth.l_d + c * drive.current * x * y**2 * 0.7 + 0.5 * c * drive.current * y**2
        # The same co-energy seen from the q axis.
        ratio = rated_d / rated_q
        i_q = (1.0 + a_q * abs(q) ** 3) * q / truth.l_q + c * drive.current * ratio * (0.7 * x**2 * y + x * y)
        return i_d + 1j * i_q

    return i_s


class Inverter(model.VoltageSourceConverter):
    """motulator's inverter with the losses that it lacks."""

    plant = None

    @property
    def u_cs(self):
        lost = abc2complex(self.plant.lost(complex2abc(self.inp.i_cs)))
        return self.inp.q_cs * self.plant.bus - lost


class Machine(model.SynchronousMachine):
    """motulator's machine with harmonics of the magnet flux, slotting and iron loss."""

    plant = None

    def harmonics(self):
        """Voltage of what turns with a multiple of the angle [V]."""
        t = self.plant.truth
        if not t.emf and not t.ripple_l:
            return 0.0
        turn, w = self.state.exp_j_theta_m, self.par.n_p * self.inp.w_M
        u = sum(1j * w * (h + 1) * self.par.psi_f * a * turn**h for h, a in t.emf.items())
        return u - 5j * w * t.ripple_l * t.l_q * np.conj(self.out.i_s) * np.conj(turn) ** 6

    @property
    def tau_M(self):
        """Air-gap torque [Nm] with that of the EMF's harmonics, by their power, and of the slots, by 3/4 Re(i* psi)."""
        t, p, i = self.plant.truth, self.par.n_p, self.i_s
        turn = self.state.exp_j_theta_m
        emf = sum(1j * (h + 1) * self.par.psi_f * a * turn**h for h, a in t.emf.items())
        slots = -4j * t.ripple_l * t.l_q * np.conj(i) ** 2 * np.conj(turn) ** 6
        return super().tau_M + 1.5 * p * np.real(emf * np.conj(i)) + 0.75 * p * np.real(slots)

    def lossy(self, w):
        """Current of the iron loss [A]."""
        t = self.plant.truth
        return 1j * w * self.state.psi_s / t.r_fe if t.r_fe else 0.0

    def rhs(self):
        slopes = super().rhs()
        w = self.par.n_p * self.inp.w_M
        slopes[0] -= self.harmonics() + self.par.R_s * self.lossy(w)
        return slopes


class MotulatorPlant(Plant):
    """State: psi_s, exp(j theta_m), then speed and exp(j theta_M) of the shaft (imposed: the latter only)."""

    def __init__(self, drive, truth, imposed=None, load=None):
        super().__init__(drive, truth)
        self.par = SynchronousMachinePars(
            n_p=drive.pole_pairs, R_s=truth.r, L_d=truth.l_d, L_q=truth.l_q, psi_f=truth.psi
        )
        knees = truth.knee_d or truth.knee_q or truth.cross
        machine = Machine(self.par, i_s=saturated(truth, drive) if knees else None)
        inverter = Inverter(drive.bus)
        inverter.inp.q_cs = 0j
        machine.plant = inverter.plant = self
        if imposed is not None:
            shaft = model.ExternalRotorSpeed(imposed)
        else:
            shaft = model.StiffMechanicalSystem(drive.inertia, 0.0, lambda t: self.load + self._drag())
        self.model = model.Drive(inverter, machine, shaft)
        self.y = np.array(self.model.get_initial_values(), complex)

    def _drag(self):
        state = self.model.mechanics.state
        return self.drag(float(np.angle(state.exp_j_theta_M)), float(np.real(state.w_M)))

    def age(self, share):
        super().age(share)
        self.par.R_s = self.truth.r * (1 + self.truth.warm_r * (1 - np.exp(-2.5 * share)))
        self.par.psi_f = self.truth.psi * (1 + self.truth.warm_psi * (1 - np.exp(-2.5 * share)))

    def rhs(self, t, y, legs):
        self.model.converter.inp.q_cs = abc2complex(legs)
        return np.array(self.model.rhs(t, list(y)))

    def _settle(self):
        self.model.set_states(list(self.y))
        self.model.set_outputs(self.t)
        self.model.interconnect(self.t)

    def currents(self):
        self._settle()
        machine = self.model.machine
        i = machine.out.i_s + machine.lossy(self.par.n_p * machine.inp.w_M)
        return complex2abc(i * machine.state.exp_j_theta_m)

    def shaft(self):
        self._settle()
        machine, shaft = self.model.machine, self.model.mechanics
        return float(np.angle(shaft.state.exp_j_theta_M)), float(np.real(shaft.out.w_M)), float(machine.tau_M)


class Planned:
    """motulator's place for current references, with planned ones."""

    def __init__(self):
        self.i = 0j

    def output(self, fbk, ref):
        ref.i_s = self.i
        return ref

    def update(self, fbk, ref):
        """Nothing to remember."""


class MotulatorControl:
    """motulator's current-vector control, given what the sensors said."""

    def __init__(self, drive, bandwidth, speed_loop, rng):
        self.drive = drive
        par = SynchronousMachinePars(n_p=drive.pole_pairs, R_s=drive.r, L_d=drive.l_d, L_q=drive.l_q, psi_f=drive.psi)
        cfg = CurrentReferenceCfg(par, max_i_s=0.95 * drive.current, nom_w_m=0.5 * drive.bus / drive.psi)
        self.ctrl = CurrentVectorControl(
            par, cfg, drive.period, J=drive.inertia if speed_loop else None, alpha_c=bandwidth, sensorless=False
        )
        self.goal, self.seen, self.speed_loop = 0.0, None, speed_loop
        self.ctrl.ref.w_m = lambda t: self.goal
        self.ctrl.ref.tau_M = lambda t: 0.0
        if not speed_loop:
            self.ctrl.current_reference = Planned()
        self.ctrl.save = lambda **_: None
        self.converter = self.machine = self.mechanics = self

    def meas_dc_voltage(self):
        return self.seen["u_dc"]

    def meas_currents(self):
        return self.seen["i_abc"]

    def meas_speed(self):
        return self.seen["omega_e"] / self.drive.pole_pairs

    def meas_position(self):
        return self.seen["theta_e"] / self.drive.pole_pairs

    def __call__(self, seen, omega_ref, i_ref):
        """(3,) duties, and the current reference, from the measured values."""
        self.seen, self.goal = seen, omega_ref
        if not self.speed_loop:
            self.ctrl.current_reference.i = i_ref
        _, duties = self.ctrl(self)
        ref = self.ctrl.current_reference
        return np.clip(np.asarray(duties), 0.02, 0.98), ref.i if not self.speed_loop else None
