# SPDX-License-Identifier: BSD-3-Clause
"""Phase and gain margins of the current and the speed loop, in the z domain with the core's own equations.

Current loop of an axis, sample time T, a = exp(-R*T/L):

    C(z) = kp + ki*T*z/(z - 1)         current_pi: the integral counts the present sample
    G(z) = (1 - a)/R / (z - a)         winding behind a voltage that is constant in a period
    L(z) = C(z) * G(z) / z             the duties of a sample act in the next period

Speed loop: L_s(z) = C_s(z) * L_q/(1 + L_q) * P(z) * M(z) * F(z), with C_s = kp + ki*T/(z - 1) (the present sample
counts in the next), P the shaft behind a torque that is constant in a period, M = (1 + 1/z)/2 the mean speed that two
positions show, F = k/(1 - (1 - k)/z) its filter.

The axes are taken as decoupled, the inductances as constant, quantisation and limits are left out: those are in the
simulation.  A sampling instant that is not the valley is a phase of omega*delay_s in both loops; the poles are those
without it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from golden_model.drive import Drive
from golden_model.registers import RegisterSet

POINTS = 20000


@dataclass(frozen=True)
class Margins:
    """Of one loop: crossover [Hz], phase margin [deg], gain margin [dB] and largest magnitude of a pole.

    None: the loop never crosses there.
    """

    crossover_hz: float | None
    phase_margin_deg: float | None
    gain_margin_db: float | None
    pole: float

    @property
    def stable(self) -> bool:
        """Whether every pole of the closed loop lies inside the unit circle."""
        return self.pole < 1.0

    def to_json(self) -> dict:
        """As JSON data."""
        return {**asdict(self), "stable": self.stable}


@dataclass(frozen=True)
class Loop:
    """An open loop: coefficients in z, sample time [s], phase lead of the sampling instant [s], response."""

    numerator: np.ndarray
    denominator: np.ndarray
    t_s: float
    lead_s: float = 0.0
    both: bool = False  # complex coefficients: negative frequencies differ

    def frequencies(self) -> np.ndarray:
        """From a hundred-thousandth of the Nyquist frequency up to it [Hz]."""
        nyquist = 0.5 / self.t_s
        return np.geomspace(1e-5 * nyquist, 0.9999 * nyquist, POINTS)

    def response(self, hz: np.ndarray) -> np.ndarray:
        """Complex gain at these frequencies."""
        z = np.exp(2j * np.pi * hz * self.t_s)
        lead = np.exp(2j * np.pi * hz * self.lead_s)
        return np.polyval(self.numerator, z) / np.polyval(self.denominator, z) * lead

    def pole(self) -> float:
        """The largest magnitude of a pole of the closed loop."""
        return float(np.abs(np.roots(np.polyadd(self.denominator, self.numerator))).max())


def current_loop(drive: Drive, register_set: RegisterSet, axis: str) -> Loop:
    """The open current loop of axis "d" or "q", gains as the registers represent them."""
    t_s, m = drive.sample_time_s, drive.machine
    gains = {row.name: row.represented for row in register_set.rows}
    kp, ki = gains[f"kp_{axis}"], gains[f"ki_{axis}"]
    decay = np.exp(-m.resistance_ohm * t_s / getattr(m, f"inductance_{axis}_h"))
    numerator = np.polymul([kp + ki * t_s, -kp], [(1.0 - decay) / m.resistance_ohm])
    denominator = np.polymul(np.polymul([1.0, -1.0], [1.0, -decay]), [1.0, 0.0])
    return Loop(numerator, denominator, t_s, drive.sampling.delay_s)


def turning_current_loop(drive: Drive, register_set: RegisterSet, omega_m: float) -> Loop:
    """The open current loop as a rotor that turns by phi = omega*T a sample sees it: complex, both axes at once.

        i[k+2] = a*exp(-j*phi)*i[k+1] + b*exp(-j*phi/2)*u[k],    b = (1 - a)/R
        u[k] = C*(ref - i[k]) + j*omega_chord*L*i[k]

    The voltage stands in the stator's frame for a period while the rotor turns on, and the decoupling acts one period
    late: at few samples a turn both take phase that the loops of the single axes do not show.  L and the gains are
    the means of both axes.  A complex loop has other margins at negative frequencies, which `margins` looks at.
    """
    t_s, m = drive.sample_time_s, drive.machine
    gains = {row.name: row.represented for row in register_set.rows}
    kp, ki = (0.5 * (gains[f"{name}_d"] + gains[f"{name}_q"]) for name in ("kp", "ki"))
    henry, ohm = 0.5 * (m.inductance_d_h + m.inductance_q_h), m.resistance_ohm
    phi = m.pole_pairs * omega_m * t_s
    decay = np.exp(-ohm * t_s / henry)
    b = (1.0 - decay) / ohm * np.exp(-0.5j * phi)
    chord = phi / t_s * (1.0 - phi * phi / 24.0)
    plant = np.polyadd([1.0, -decay * np.exp(-1j * phi), 0.0], [-1j * chord * henry * b])
    numerator = np.polymul([kp + ki * t_s, -kp], [b])
    return Loop(numerator, np.polymul([1.0, -1.0], plant), t_s, drive.sampling.delay_s, both=True)


def speed_loop(drive: Drive, register_set: RegisterSet) -> Loop | None:
    """The open speed loop, or None if its gain is zero."""
    t_s, m = drive.sample_time_s, drive.machine
    gains = {row.name: row.represented for row in register_set.rows}
    kp, ki, k = gains["speed_kp"], gains["speed_ki"], gains["k_filter"]
    if kp == 0.0 or m.inertia_kgm2 <= 0.0:
        return None
    inner = current_loop(drive, register_set, "q")
    torque = 1.5 * m.pole_pairs**2 * m.magnet_flux_wb  # on the electrical speed
    decay, gain = 1.0, torque * t_s / m.inertia_kgm2
    if m.viscous_friction_nms > 0.0:
        lost = m.viscous_friction_nms * t_s / m.inertia_kgm2
        decay = np.exp(-lost)
        gain *= -np.expm1(-lost) / lost if lost > 0.0 else 1.0
    numerator = np.polymul([kp, ki * t_s - kp], inner.numerator)
    numerator = np.polymul(np.polymul(numerator, [0.5, 0.5]), [gain * k, 0.0])
    denominator = np.polymul([1.0, -1.0], np.polyadd(inner.denominator, inner.numerator))
    denominator = np.polymul(np.polymul(denominator, [1.0, -decay]), np.polymul([1.0, 0.0], [1.0, k - 1.0]))
    return Loop(numerator, denominator, t_s, drive.sampling.delay_s)


def margins(loop: Loop) -> Margins:
    """Margins at all crossings: the smallest phase margin, the smallest gain margin above 0 dB."""
    hz = loop.frequencies()
    found = _margins(loop, hz, loop.response(hz))
    if not loop.both:
        return found
    other = _margins(loop, hz, np.conj(loop.response(-hz)))
    closest = min((found, other), key=lambda m: np.inf if m.phase_margin_deg is None else m.phase_margin_deg)
    gains = [m.gain_margin_db for m in (found, other) if m.gain_margin_db is not None]
    return replace(closest, gain_margin_db=min(gains, default=None))


def _margins(loop: Loop, hz: np.ndarray, gain: np.ndarray) -> Margins:
    size, phase = np.log(np.abs(gain)), np.unwrap(np.angle(gain))
    phase -= 2.0 * np.pi * np.round((phase[0] + np.pi / 2.0) / (2.0 * np.pi))  # an integrator starts at -90 or -180
    crossings = [(_at(hz, size, k), _at(phase, size, k)) for k in np.flatnonzero(np.diff(np.sign(size)))]
    turns = phase + np.pi
    edges = [_at(size, turns, k) for k in np.flatnonzero(np.diff(np.sign(turns)))]
    left = [-20.0 / np.log(10.0) * value for value in edges]
    closest = min(crossings, key=lambda pair: pair[1], default=None)
    return Margins(
        None if closest is None else float(closest[0]),
        None if closest is None else float(180.0 + np.degrees(closest[1])),
        float(min((value for value in left if value > 0.0), default=min(left, default=np.nan))) if left else None,
        loop.pole(),
    )


def _at(values: np.ndarray, crossing: np.ndarray, k: int) -> float:
    """``values`` where ``crossing`` is zero between points k and k + 1."""
    part = crossing[k] / (crossing[k] - crossing[k + 1])
    return values[k] + part * (values[k + 1] - values[k])
