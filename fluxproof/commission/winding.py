# SPDX-License-Identifier: BSD-3-Clause
"""R, L_d, L_q and the dead-time voltage from a current vector that rotates too fast for the rotor.

The regulators hold a vector in the frame of the forced angle.  A snapshot k has the current i(k) at the angle phi of
that frame against the rotor, and the voltage u(k), which acts as a constant vector in the stator's frame during the
period after the next valley: in the rotating frame it is that of the angle phi + 1.5*w*T, and

    w -> w_e = 2/T*sin(w*T/2),    R -> R*cos(w*T/2)            (a frame that turns during a held vector)

With currents and voltages as sums of c_n*exp(j*n*phi) in the rotor's frame, n = 1, -1 (a salient rotor) and those of
the dead time, the rotor's axes obey, with I_d = c_1 + conj(c_-1), I_q = -j*(c_1 - conj(c_-1)) and U, S likewise:

    U_d = (R + j*w_e*L_d)*I_d + V_dead*S_d;    U_q = (R + j*w_e*L_q + K/(j*w))*I_q + V_dead*S_q;    K = 1.5*p^2*psi^2/J

S is the vector of the signs of the three phase currents, which follow from the c_n: harmonics and a salient rotor move
the instants at which a current changes its sign.  Within +-i_0 of zero, what a dead time moves the current by (about
V_dead*T/L), the current stops before its fundamental does: the loss leads S by i_0/|I|, to first order

    V_dead*S -> V_dead*S + j*sign(w)*V_dead*i_0*S/|I|

The second term is across the current as w*L*I is; without it L is too large by V_dead*i_0/(w*I^2), 1 % at worst, and no
residual tells.  Three amplitudes separate them.  K is the EMF of the rotor that the torque swings.
Several amplitudes separate R from V_dead, both senses cancel what a slow turn of the rotor adds, two frequencies
separate L_q from K.  A second regression has L_d and L_q of each amplitude: the mean over a turn of a current of that
size, for a winding that saturates.  Each equation is turned into the direction of its current: the part along it has R
and V_dead, the part across it L and K; each kind counts by the rms of its own residuals.  The frequency is high: at a
low one the current stays at zero for a while whenever it changes sign, and its sign is no longer all that counts.
"""

from __future__ import annotations

import math

import numpy as np

from fluxproof.commission.session import Refusal, Seen, Session, Step, Value, solve
from fluxproof.plant.transforms import AXES
from golden_model.encoders.forced_position import RATE
from golden_model.units import TURN_RAD

PARTS = (0.3, 0.5, 0.7)  # of the current limit; a salient rotor and the dead time add a third to the last
HIGHEST_HZ, OF_RATE, OF_BASE = 240.0, 0.95, 1.7  # frequencies: largest, of the ranges
LOWER = 0.6  # second frequency over the first
OF_VOLTAGE = 0.8  # of the voltage circle, with twice the inductances of the file and what alignment took
SMALLER = (1.0, 0.7, 0.5)  # of the amplitudes, where the voltage does not suffice
LEAST_HZ = 15.0
BANDWIDTH = 1.0 / 150.0  # of the sampling frequency, current regulators
RAMP_S, SETTLE_S, SAMPLES = 0.1, 0.15, 250
PARKED_S = 0.5  # each of raising, holding and lowering the field that moves the rotor to the middle of a sector
STOOD_DEG = 25.0  # electrical, largest turn of the rotor in a run
UNKNOWN_SWING = 60.0  # rad/s, without an inertia in the file
MISFIT = 0.03  # of the voltages, rms; of an inductance, from which on its change with the current is told
SURE, LEADS = 3.0, 2.0  # sigma, of that change; of what the dead time's lead takes
LARGEST_SIGMA = 0.03  # of R and L
ORDERS = (1, -1, -5, 7, 5, -7, -11, 13)
REPEATED = 2.0  # what the equation leaves is its own error rather than noise, and the run of the other sense repeats it
GRID = TURN_RAD / 720 * np.arange(720)  # phi, to find the harmonics of the signs


class TurnedTooFar(Refusal):
    """The rotor did not stand in the rotating field."""


class Point:
    """The harmonics of one run: current and voltage at the frequency w [rad/s]."""

    def __init__(self, seen: Seen, rotor: np.ndarray, w: float, t_s: float, current: float):
        phi = seen.theta_me - rotor
        orders = np.array(ORDERS) - 1
        self.w, self.current = w, current  # the amplitude that was asked for
        self.i = np.linalg.lstsq(np.exp(1j * np.outer(phi, orders)), seen.current, rcond=None)[0]
        ahead = phi + 1.5 * w * t_s
        basis = np.exp(1j * np.outer(ahead, orders))
        self.u, *_ = np.linalg.lstsq(basis, seen.voltage, rcond=None)
        self.axes_i, self.axes_u = _axes(self.i), _axes(self.u)
        self.axes_s = _axes(self._signs(float(np.mean(rotor))))

    def _signs(self, rotor: float) -> np.ndarray:
        """c_1, c_-1 of the vector of the phase currents' signs."""
        current = np.exp(1j * np.outer(GRID, ORDERS)) @ self.i
        axes = AXES * np.exp(-1j * rotor)
        vector = 2.0 / 3.0 * np.sign(np.real(np.outer(current, np.conj(axes)))) @ axes
        return np.array([np.mean(vector * np.exp(-1j * n * GRID)) for n in (1, -1)])


def _axes(c: np.ndarray) -> tuple[complex, complex]:
    """Phasors of the rotor's axes."""
    return c[0] + np.conj(c[1]), -1j * (c[0] - np.conj(c[1]))


def swing(session: Session, current: float) -> float:
    """Frequency of the rotor in a standing field [rad/s], with the start values."""
    m = session.drive.machine
    if m.inertia_kgm2 <= 0.0:
        return UNKNOWN_SWING
    return math.sqrt(1.5 * m.pole_pairs**2 * m.magnet_flux_wb * current / m.inertia_kgm2)


def frequency(session: Session, current: float, volts_per_a: float) -> float:
    """The field's frequency [electrical Hz]: within rate, speed range and voltage; 0 where that is not enough.

    ``volts_per_a``: of a standing or slow field, so R and the dead time's voltage together.
    """
    m, t_s = session.drive.machine, session.t_s
    hertz = [HIGHEST_HZ, OF_RATE * RATE.hi * RATE.lsb * session.code_pairs / t_s, 0.05 / t_s]
    hertz.append(OF_BASE * session.drive.bases.omega_me_rad_s / TURN_RAD)
    room, resistive = OF_VOLTAGE * session.voltage(), volts_per_a * current
    if room <= resistive:
        return 0.0
    henry = 2.0 * max(m.inductance_d_h, m.inductance_q_h)
    return min(*hertz, math.sqrt(room**2 - resistive**2) / (TURN_RAD * henry * current))


def measure(session: Session, volts_per_a: float) -> Step:
    """R, L_d, L_q, V_dead; the drive then has the first three.

    With smaller amplitudes where the voltage does not suffice for the largest, or where the rotor follows them too far.
    """
    s, refused = session, None
    for size in SMALLER:
        largest = size * PARTS[-1] * s.limit
        high = frequency(s, largest, volts_per_a)
        if high < LEAST_HZ:
            continue
        try:
            return judge(s, _points(s, size, high))
        except TurnedTooFar as turned:
            refused = turned
    raise refused or Refusal(
        f"too little voltage: {s.voltage():.3g} V do not drive {largest:.3g} A at {LEAST_HZ:.0f} Hz, the winding "
        f"took {volts_per_a:.3g} V/A at standstill; check bus, [machine] inductance_d_h, [control] current_limit_a"
    )


def _points(s: Session, size: float, high: float) -> list[Point]:
    """All amplitudes, times ``size``, in both senses at the higher frequency [Hz], the largest at the lower one too."""
    plan = [(size * part, sign * high) for part in PARTS for sign in (1.0, -1.0)]
    plan += [(size * PARTS[-1], sign * LOWER * high) for sign in (1.0, -1.0)]
    points = []
    for k, (part, hertz) in enumerate(plan):
        s.progress(f"winding, {part * s.limit:.3g} A at {hertz:.0f} Hz ({k + 1} of {len(plan)})")
        points.append(_run(s, part * s.limit, TURN_RAD * hertz))
    return points


def _run(s: Session, current: float, w: float) -> Point:
    """One amplitude at one frequency; the current rises slowly, so that the rotor gets no push."""
    m = s.drive.machine
    w_c = TURN_RAD * BANDWIDTH / s.t_s
    kp = w_c * min(m.inductance_d_h, m.inductance_q_h)
    if s.coarse:
        _to_the_middle(s)
    s.gates_off()
    s.load(kp, max(w_c * m.resistance_ohm, kp * w_c / 4.0), reverse=0, theta_offset=0)
    s.force(0.0, w)
    s.settle(0.02)
    s.gates_on()
    s.ramp(RAMP_S, i_d_ref=(0.0, current))
    s.settle(SETTLE_S)
    seen = s.look(SAMPLES)
    s.ramp(RAMP_S / 4, 5, i_d_ref=(current, 0.0))
    s.gates_off()
    if abs(float(seen.i_d.mean()) / current - 1.0) > 0.2:
        raise Refusal(
            f"the current reaches {seen.i_d.mean():.3g} A at {w / TURN_RAD:.0f} Hz, expected {current:.3g} A: too "
            "little voltage for the inductance, or it does not settle; check the start values of R and L"
        )
    sensors, pairs = s.drive.sensors, s.code_pairs
    rotor = (-1.0 if sensors.position_reverse else 1.0) * pairs * TURN_RAD * seen.code + sensors.theta_offset_rad
    line = np.polyval(np.polyfit(seen.t, rotor, 1), seen.t)
    if math.degrees(np.ptp(line)) > STOOD_DEG:
        raise TurnedTooFar(
            f"the rotor turned by {math.degrees(np.ptp(line)):.0f} degrees in a field of {w / TURN_RAD:.0f} Hz, "
            f"expected {STOOD_DEG:.0f} at most: something drives the shaft, or the inertia is too small: "
            "hold or load it, or commission with a smaller [control] current_limit_a"
        )
    return Point(seen, line, w, s.t_s, current)


def _to_the_middle(s: Session) -> None:
    """The field turns the rotor to the middle of a Hall sector, which then tells its place best."""
    sensors, kp = s.drive.sensors, TURN_RAD * BANDWIDTH / s.t_s * s.drive.machine.inductance_d_h
    sign = -1.0 if sensors.position_reverse else 1.0
    s.gates_off()
    s.load(kp, kp * TURN_RAD * LEAST_HZ, reverse=0, theta_offset=0)
    s.force(sign * TURN_RAD * s.code_step / 2.0 + sensors.theta_offset_rad)
    s.gates_on()
    s.ramp(PARKED_S, i_d_ref=(0.0, PARTS[-1] * s.limit))
    s.settle(PARKED_S)
    s.ramp(PARKED_S, i_d_ref=(PARTS[-1] * s.limit, 0.0))


def held(flux: float, henry: float) -> float:
    """L [H] of the regression's, of a voltage that stands still for a period T; ``flux`` is R*T.

    The current follows i(k+1) = a*i(k) + (1 - a)/R*u with a = exp(-R*T/L).  Turned by half a step, u/i is
    R*cos(w*T/2) + j*R*coth(R*T/(2*L))*sin(w*T/2), of which the regression takes R*coth(x) as 2*L/T.
    """
    x = flux / (2.0 * henry) if henry else 1.0
    return flux / (2.0 * math.atanh(x)) if 0.0 < x < 1.0 else henry


class Fit:
    """A regression over all runs: R, V_dead, K, V_dead*i_0 common, L_d and L_q of each group of runs, with sigmas."""

    def __init__(self, s: Session, points: list[Point], groups: list[int]):
        count = max(groups) + 1
        rows, values, sizes = [], [], []
        for p, group in zip(points, groups, strict=True):
            w_e, cosine = 2.0 / s.t_s * math.sin(p.w * s.t_s / 2.0), math.cos(p.w * s.t_s / 2.0)
            (i_d, i_q), (u_d, u_q), (s_d, s_q) = p.axes_i, p.axes_u, p.axes_s
            for axis, i, swings, sign, value in ((0, i_d, 0.0, s_d, u_d), (1, i_q, i_q / (1j * p.w), s_q, u_q)):
                inductive = np.zeros(2 * count, complex)
                inductive[axis * count + group] = 1j * w_e * i
                lead = 1j * math.copysign(1.0, p.w) * sign / abs(i)
                row = np.array([cosine * i, sign, swings, lead, *inductive])
                turned, along = row * np.conj(i) / abs(i), value * np.conj(i) / abs(i)
                rows += [np.real(turned), np.imag(turned)]
                values += [along.real, along.imag]
                sizes.append(abs(value))
        matrix, values = np.array(rows, float), np.array(values)
        weights = np.ones(len(values))
        for _ in range(3):  # each kind of equation by its own residuals
            weighted = matrix * weights[:, None]
            scale = np.linalg.norm(weighted, axis=0)
            found, sigma, _ = solve(weighted / scale, values * weights)
            found, sigma = found / scale, sigma / scale
            rest = values - matrix @ found
            for kind in (0, 1):
                weights[kind::2] = 1.0 / max(math.sqrt(float(np.mean(rest[kind::2] ** 2))), 1e-9)
        sigma = np.multiply(sigma, math.sqrt(REPEATED))
        self.misfit = math.sqrt(float(np.mean(rest**2)) * 2.0 / float(np.mean(np.square(sizes))))
        self.r, self.v_dead, self.k, self.lead = map(float, found[:4])
        self.s_r, self.s_v, self.s_k = map(float, sigma[:3])
        self.l_d, self.l_q = ([held(self.r * s.t_s, float(x)) for x in part] for part in np.split(found[4:], 2))
        self.s_l_d, self.s_l_q = (list(map(float, part)) for part in np.split(sigma[4:], 2))


def judge(s: Session, points: list[Point]) -> Step:
    """One regression over all runs; where the inductances depend on the current, those of the largest one."""
    amplitudes = sorted({p.current for p in points})
    one = Fit(s, points, [0] * len(points))
    each = Fit(s, points, [amplitudes.index(p.current) for p in points])
    fit = each if one.misfit > MISFIT >= each.misfit else one
    if fit.misfit > MISFIT:
        raise Refusal(
            f"R and L explain the voltages within {100 * fit.misfit:.1f} % only, expected {100 * MISFIT:.0f} %: "
            "saturation at this current, a blocked phase or a poor current sensor"
        )
    r, l_d, l_q, v_dead = fit.r, fit.l_d[-1], fit.l_q[-1], fit.v_dead
    s_r, s_l_d, s_l_q, s_v = fit.s_r, fit.s_l_d[-1], fit.s_l_q[-1], fit.s_v
    for name, value, error in (("R", r, s_r), ("L_d", l_d, s_l_d), ("L_q", l_q, s_l_q)):
        if not value > 0.0 or error > LARGEST_SIGMA * value:
            raise Refusal(
                f"{name} = {value:.4g} +-{error:.2g}: expected an uncertainty below {100 * LARGEST_SIGMA:.0f} %; raise "
                "the current limit or check the noise of the current sensors"
            )
    s.know("machine", resistance_ohm=r, inductance_d_h=l_d, inductance_q_h=l_q)
    quantities = {
        "resistance": Value(r, s_r, "ohm"),
        "inductance_d": Value(l_d, s_l_d, "H"),
        "inductance_q": Value(l_q, s_l_q, "H"),
        "v_dead": Value(v_dead, s_v, "V"),
    }
    depends = _over_current(s, amplitudes, each, max(p.w for p in points))
    said = (
        f"R {r:.4g} +-{s_r:.1g} ohm, L_d {1e3 * l_d:.4g} +-{1e3 * s_l_d:.1g} mH, "
        f"L_q {1e3 * l_q:.4g} +-{1e3 * s_l_q:.1g} mH, "
        f"V_dead {v_dead:.3g} +-{s_v:.1g} V, misfit {100 * fit.misfit:.2f} %{depends}"
    )
    notes = {"misfit": fit.misfit, "swing_k": [fit.k, fit.s_k], "frequencies_hz": [p.w / TURN_RAD for p in points]}
    notes["lead_v_a"] = fit.lead
    notes["inductances"] = [
        {"current_a": float(amplitudes[k]), "inductance_d_h": each.l_d[k], "inductance_d_sigma_h": each.s_l_d[k],
         "inductance_q_h": each.l_q[k], "inductance_q_sigma_h": each.s_l_q[k]}
        for k in range(len(amplitudes))
    ]  # fmt: skip
    return Step("winding", quantities, said, notes)


def _over_current(s: Session, amplitudes: list[float], each: Fit, w: float) -> str:
    """The inductances that depend on the current, and up to which one they are known; empty if none does.

    What the lead of the dead time takes at the smallest amplitude, V_dead*4/pi*i_0/(w*I**2) with i_0 = V_dead*T/L, may
    be missed or taken twice: each amplitude but the largest has one frequency alone, which cannot tell the lead from an
    inductance.
    """
    said = []
    leads = LEADS * 4.0 / math.pi * each.v_dead**2 * s.t_s / (w * amplitudes[0] ** 2)
    for name, values, sigmas in (("L_d", each.l_d, each.s_l_d), ("L_q", each.l_q, each.s_l_q)):
        change, error = values[-1] - values[0], math.hypot(sigmas[0], sigmas[-1])
        if abs(change) > max(SURE * error, MISFIT * abs(values[0]), leads / abs(values[-1])):
            each_of = ", ".join(f"{1e3 * value:.4g}" for value in values)
            said.append(f"{name} {each_of} mH")
    if not said:
        return ""
    at = ", ".join(f"{a:.3g}" for a in amplitudes)
    known = f"known up to {amplitudes[-1]:.3g} of {s.limit:.3g} A"
    return f"; {' and '.join(said)} at {at} A, {known}: a torque table needs a map of it (registers --flux-map)"
