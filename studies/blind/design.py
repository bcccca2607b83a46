# SPDX-License-Identifier: BSD-3-Clause
"""First-order signature of each effect in a recording of a given plan: rows of a linear design matrix.

Used only to decide which effects a recording can separate, independent of the estimator (identifiable.py).  At each
operating point of the plan, with z = d + jq in the measured frame and misfit = recorded voltage less
R i + j omega psi(i): its mean, its lines at electrical orders +-1/p, +-1, +-2, +-6, +-12, the shaft torque's
mean and cogging line, and mean and first order of the sum of three measured currents.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from studies.blind import params as P
from studies.blind import plans
from studies.blind.bridge import direction, drop
from studies.blind.magnetics import flux

LINES = ("mean", "+e", "-e", "+1", "-1", "+2", "-2", "+6", "-6", "+12", "-12", "torque", "cog", "sum", "sum1")
FLOOR = 2e-4  # of the largest phase voltage (or torque, current): smaller differences are not detectable


@dataclass
class Points:
    """Operating points of a plan, arrays (k,): omega [rad/s] electrical, i complex [A], x share of time."""

    omega: np.ndarray
    i: np.ndarray
    x: np.ndarray
    rows: np.ndarray
    at: np.ndarray  # middle row


def points(case) -> Points:
    """The plan's segments; with a speed loop, i_q follows from the load."""
    plan, n = case.build.plan, case.build.nominal
    s = np.array([segment[:3] for segment in plan.segments], float)
    rows = np.array([segment[3] for segment in plan.segments])
    i_q = s[:, 2]
    if plan.free:
        i_q = np.array(plan.load) / n.torque_rated * n.machine["rated_current_a"]
    at = np.cumsum(rows) - rows // 2
    return Points(s[:, 0], s[:, 1] + 1j * i_q, at / plan.rows, rows, at)


class Design:
    """Rows of one case's plan: ``variants`` of an effect's columns, ``truth`` of the hidden drive."""

    def __init__(self, case):
        self.case, self.p = case, points(case)
        n = case.build.nominal
        m = n.machine
        self.r, self.l_d, self.l_q = m["resistance_ohm"], m["inductance_d_h"], m["inductance_q_h"]
        self.psi_m, self.pairs = m["magnet_flux_wb"], m["pole_pairs"]
        self.i_r, self.bus, self.T = m["rated_current_a"], n.inverter["dc_bus_v"], n.period_s
        self.psi = self.psi_m + self._l(self.p.i)
        self.u = self.r * self.p.i + 1j * self.p.omega * self.psi
        self.unit = self.p.i / (np.abs(self.p.i) + 0.03 * self.i_r)
        self.weight = self._weights()

    def _l(self, z):
        return self.l_d * np.real(z) + 1j * self.l_q * np.imag(z)

    def _rows(self, **lines):
        """One column: given lines (complex arrays (k,)), whitened and stacked as real numbers."""
        names = {
            "mean": "mean",
            "p6": "+6",
            "m6": "-6",
            "p12": "+12",
            "m12": "-12",
            "p1": "+1",
            "m1": "-1",
            "p2": "+2",
            "m2": "-2",
            "pe": "+e",
            "me": "-e",
        }
        full = np.zeros((len(LINES), len(self.p.i)), complex)
        for name, value in lines.items():
            full[LINES.index(names.get(name, name))] = value
        full *= self.weight
        return np.concatenate([full.real.ravel(), full.imag.ravel()])

    def _weights(self):
        """1 / standard deviation of each line at each point, including the floor; 0 where not recorded."""
        s, p, b = self.case.build.drive.sensor, self.p, self.case.build
        psi_noise = math.hypot(
            self.l_q * math.hypot(s.noise_a, s.lsb_a / 3.5),
            self.psi_m * math.hypot(s.theta_noise, s.theta_lsb / 3.5),
        )
        length = self.bus / math.sqrt(3.0)
        held = np.array([p.rows[p.omega == omega].sum() for omega in p.omega])
        white = np.hypot(self.r * s.noise_a, 0.5 * s.u_noise) / np.sqrt(p.rows)
        weight = np.zeros((len(LINES), len(p.i)))
        for k, line in enumerate(LINES[:11]):
            order = 0.0 if line == "mean" else 1.0 / self.pairs if line[1] == "e" else float(line[1:])
            turn = np.minimum(2.0, np.abs(order * p.omega) * self.T + 2.0 / p.rows)
            sigma = np.hypot(turn * psi_noise / self.T * np.sqrt(2.0 / p.rows), white)
            weight[k] = 1.0 / np.hypot(sigma, FLOOR * length)
            seen = np.abs(order * p.omega) * held * self.T > 2.0 * math.pi  # a period at this speed at least
            if order:
                weight[k] *= seen & (np.abs(order * p.omega) * self.T < 2.5)
        rated = b.nominal.torque_rated
        if b.with_torque:
            weight[11] = 1.0 / np.hypot(s.torque_noise / np.sqrt(p.rows), 1e-3 * rated)
            weight[12] = weight[11] / 2.0
        elif b.plan.free:
            weight[12] = 1.0 / (5e-3 * rated)
        if len(b.drive.shaft.cogging):  # above the Nyquist frequency it is aliased to other orders
            weight[12] *= np.abs(b.drive.shaft.cogging[0, 0] * p.omega / self.pairs) * self.T < 2.5
        if not s.two_sensors:
            weight[13] = 1.0 / np.hypot(s.noise_a / np.sqrt(p.rows), 3e-4 * self.i_r)
            weight[14] = weight[13]
        return weight

    # -- effects ------------------------------------------------------------------------------------------

    def _flux(self, d_psi_d, d_psi_q):
        """Additional flux d_psi at the same current: voltage and torque."""
        z = d_psi_d + 1j * d_psi_q
        return self._rows(mean=1j * self.p.omega * z, torque=self._torque(z, self.p.i))

    def _torque(self, psi, i):
        return 1.5 * self.pairs * np.imag(np.conj(psi) * i)

    def _iron(self, g):
        lost = -1j * self.p.omega * self.psi * g  # core current less terminal current
        moved = self._l(lost)
        return self._rows(
            mean=1j * self.p.omega * moved,
            torque=self._torque(moved, self.p.i) + self._torque(self.psi, lost),
        )

    def _skew(self, tau):
        moved = -1j * self.p.omega * tau * self.psi + self.p.omega * tau * self._l(1j * self.p.i)
        turned = -1j * self.p.omega * tau * self.psi_m / self.l_q  # ripple current that is measured in addition
        return self._rows(mean=-1j * self.p.omega * moved, torque=-self._torque(self.psi, turned))

    def _turn(self, delta, line="mean"):
        z = -1j * delta * self.psi_m + self._l(1j * delta * self.p.i) - 1j * delta * self._l(self.p.i)
        if line != "mean":
            return self._rows(**{line: 1j * self.p.omega * z})
        torque = self._torque(self._l(1j * delta * self.p.i), self.p.i) + self._torque(self.psi, 1j * delta * self.p.i)
        return self._rows(mean=1j * self.p.omega * z, torque=torque)

    def _offset(self, o, common):
        return self._rows(m1=-self.r * o, p1=-1j * self.p.omega * (self.l_d - self.l_q) * np.conj(o), sum=3.0 * common)

    def _gain(self, g):
        z = g * np.conj(self.p.i)
        mean_l, half = 0.5 * (self.l_d + self.l_q), 0.5 * (self.l_d - self.l_q)
        return self._rows(
            m2=-(self.r - 1j * self.p.omega * mean_l) * z,
            p2=-3j * self.p.omega * half * np.conj(z),
            sum1=1.5 * np.conj(g) * self.p.i,
        )

    def _scale(self, s):
        less = -s * self.p.i
        return self._rows(
            mean=self.r * less + 1j * self.p.omega * self._l(less),
            torque=self._torque(self._l(less), self.p.i) + self._torque(self.psi, less),
        )

    def _dead(self, v):
        along = np.angle(self.p.i)
        size = 4.0 / math.pi * v * np.abs(self.unit)
        return self._rows(
            mean=size * np.exp(1j * along),
            m6=size / 5.0 * np.exp(-5j * along),
            p6=-size / 7.0 * np.exp(7j * along),
        )

    def variants(self, name) -> list[list[np.ndarray]]:
        """Columns of an effect at a typical size; several sets if its time course may vary."""
        p, i_d, i_q, one = self.p, self.p.i.real, self.p.i.imag, np.ones(len(self.p.i))
        ir, psi, l_d, l_q, rated = self.i_r, self.psi_m, self.l_d, self.l_q, self.rated
        share, both = 1.0 - np.exp(-3.5 * p.x), (1.0, 1j)
        d, q, level = i_d / ir, i_q / ir, np.abs(p.omega).max()
        iron = 0.03 * ir / (self.case.build.nominal.omega_rated * psi)
        give = {
            "dead_time": lambda: [[self._dead(0.02 * self.bus * one)]],
            "resistance": lambda: [[self._rows(mean=0.2 * self.r * p.i)]],
            "resistance_temperature": lambda: [[self._rows(mean=0.2 * self.r * p.i * self.rise)]],
            "magnet_flux": lambda: [[self._flux(0.05 * psi * one, 0.0)]],
            "magnet_temperature": lambda: [[self._flux(0.05 * psi * x, 0.0)] for x in (p.x, share)],
            "inductance_d": lambda: [[self._flux(0.15 * l_d * i_d, 0.0)]],
            "inductance_q": lambda: [[self._flux(0.0, 0.15 * l_q * i_q)]],
            "saturation": lambda: [
                [self._flux(0.0, 0.15 * l_q * i_q * q**2), self._flux(0.1 * l_d * i_d * d**2, 0.0)],
                [self._flux(0.0, 0.15 * l_q * i_q * np.abs(q)), self._flux(0.1 * l_d * i_d * np.abs(d), 0.0)],
            ],
            "cross_saturation": lambda: [
                [self._flux(0.04 * psi * q**2, 0.08 * psi * d * q)],
                [self._flux(0.04 * psi * np.abs(q), 0.04 * psi * d * np.sign(q))],
            ],
            "iron_loss": lambda: [[self._iron(iron)]],
            "emf_harmonics": lambda: [
                [self._rows(**{k: w * 0.015 * psi * p.omega}) for k in ("p6", "m6", "p12", "m12") for w in both]
            ],
            "delay": lambda: [[self._rows(mean=1j * p.omega * 10e-6 * self.u)]],
            "sampling_skew": lambda: [[self._skew(1e-6)]],
            "encoder_offset": lambda: [[self._turn(0.035)]],
            "encoder_eccentricity": lambda: [[self._turn(0.026 * w, k) for k in ("pe", "me") for w in both]],
            "current_offset": lambda: [
                [self._offset(0.01 * ir * w * one, 0.0) for w in both] + [self._offset(0.0 * one, 0.01 * ir)]
            ],
            "current_gain": lambda: [[self._gain(0.02 * w) for w in both]],
            "current_scale": lambda: [[self._scale(0.03)]],
            "udc_gain": lambda: [[self._rows(mean=0.02 * self.u)]],
            "phase_resistance_asymmetry": lambda: [[self._rows(m2=0.1 * self.r * w * np.conj(p.i)) for w in both]],
            "cogging": lambda: [[self._rows(cog=0.05 * rated * w) for w in both]],
            "friction": lambda: [[self._rows(torque=-0.05 * rated * w) for w in (np.sign(p.omega), p.omega / level)]],
        }
        return give[name]()

    @property
    def rated(self):
        return self.case.build.nominal.torque_rated

    def truth(self) -> np.ndarray:
        """The rows of the hidden drive with all effects."""
        b, p, drive = self.case.build, self.p, self.case.build.drive
        m, s, br, h = drive.motor, drive.sensor, drive.bridge, drive.shaft
        course = plans.course(b.plan, b.nominal)
        x = np.linspace(0.0, 1.0, b.plan.rows + 1)
        for change in b.on_course:
            change(course, x)
        at = p.at
        reference = b.nominal.machine["temperature_ref_c"]
        self.rise = (b.temperature(x)[at] - reference) / 50.0 if b.temperature else np.zeros(len(at))
        phases = np.array((m.r_a, m.r_b, m.r_c))[:, None] * course.r_scale[:, at] + br.r_drop
        spin = np.exp(2j * np.pi / 3.0 * np.arange(3))[:, None]
        y = self._rows(
            mean=(phases.mean(0) - self.r) * p.i,
            m2=2.0 / 3.0 * 0.5 * (phases * spin**2).sum(0) * np.conj(p.i),
        )
        more = [flux(m, z.real, z.imag)[:2] for z in p.i]
        more = np.array([f[0] + 1j * f[1] for f in more]) - self._l(p.i)
        more = more + self.psi_m * (course.psi_scale[at] - 1.0)
        y = y + self._flux(more.real, more.imag)
        g = m.g_eddy + m.g_hyst * m.w_hyst / np.sqrt(p.omega**2 + 1e-4 * m.w_hyst**2)
        y = y + self._iron(g) + self._skew(s.skew_s - s.theta_late_s)
        for order, a_d, ph_d, a_q, ph_q in m.psi_h:
            if order in (6.0, 12.0):
                d, q = a_d * np.exp(1j * ph_d), 1j * a_q * np.exp(1j * ph_q)
                plus, minus = 0.5 * (d + q), 0.5 * np.conj(d - q)
                y = y + self._rows(
                    **{
                        f"p{int(order)}": 1j * (1 + order) * p.omega * plus,
                        f"m{int(order)}": 1j * (1 - order) * p.omega * minus,
                    }
                )
        lost = [br.dead_s / self.T * self.bus * direction(br.direction, br.i_zone, abs(z)) for z in p.i]
        lost = np.array(lost) + [drop(br, abs(z)) - br.r_drop * abs(z) for z in p.i]
        y = y + self._dead(lost / np.maximum(np.abs(self.unit), 1e-9))
        share = {P.DELAY_MIX: br.delay, P.DELAY_HALF: 0.5, P.DELAY_SHIFT: 0.1}[br.delay_kind]
        y = y + self._rows(mean=1j * p.omega * share * self.T * self.u)
        y = y + self._turn(course.theta_offset[at]) + self._turn(0.5 * s.ecc_1, "pe") + self._turn(0.5 * s.ecc_1, "me")
        o = 2.0 / 3.0 * (course.offsets[:, at] * spin).sum(0)
        y = y + self._offset(o, course.offsets[:, at].mean(0))
        gains = np.array((s.gain_a, s.gain_b, s.gain_c))
        y = y + self._gain((gains * spin[:, 0] ** 2).sum() / 3.0) + self._scale(s.scale + gains.mean())
        y = y + self._rows(mean=(s.u_gain + s.u_offset / self.bus) * self.u)
        if len(h.cogging):
            y = y + self._rows(cog=h.cogging[0, 1] * np.exp(1j * h.cogging[0, 2]))
        omega_m = p.omega / self.pairs
        extra = (h.viscous - b.nominal.machine["viscous_friction_nms"]) * omega_m + h.coulomb * np.sign(omega_m)
        return y + self._rows(torque=-extra)
