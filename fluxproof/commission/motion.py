# SPDX-License-Identifier: BSD-3-Clause
"""Inertia and friction from torque steps, the magnet flux from held speeds, and a point that was not fitted.

Torque steps of i_q both ways, the place of the shaft [electrical rad] from the encoder, integrals over snapshots:

    theta = theta_0 + omega_0*t + K*(double integral of i_q) - b*(of sign(omega)) - c*(of omega)
    K = 1.5*p^2*psi/J;    b = p*T_coulomb/J;    c = B/J

Each step has its own theta_0 and omega_0; omega is the fit's own.  A dead time makes every pulse late by half of it,
whatever the sign of the current: the valley, where the current is sampled, lies T_dead/2 before the middle of the zero
voltage, in which the current falls by (R*i_q + omega*psi)/L_q:

    i_q sampled = i_q*(1 + R*T_dead/(2*L_q)) + omega*psi*T_dead/(2*L_q)

so that the K of the fit is too small by the bracket, and its c too large by K*psi*T_dead/(2*L_q).  Held speeds of both
senses, with a current in the d axis of both signs, so that the direction of the dead time's voltage V_1 is known:

    u_q = R*i_q + V_1*i_q/|i| + w_e*(psi + L_d*i_d)
    u_d = R*i_d + V_1*i_d/|i| - w_e*L_q*i_q + w_e*psi*sin(error)

``error`` is what alignment has left of the encoder's offset.  w_e and R as in winding.  Each
speed is held with both signs of i_d: an error of V_1's direction changes its sign with them and leaves psi alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from fluxproof.commission.session import Refusal, Seen, Session, Step, Value, solve
from golden_model.units import TURN_RAD, from_si

TORQUE = (0.4, 0.8, 0.2, 0.1)  # of the current limit: usual, where the shaft does not move, where it moves too fast
OF_RATED, OF_VOLTAGE = 0.5, 0.45  # the speed reached: of the rated one, of the speed at which the EMF takes the voltage
CYCLES, LONGEST_S, LEAST_ROWS, ROWS = 2, 4.0, 30, 400  # torque steps
MOVES = 0.1  # of that speed: less is no motion
LEFT_OUT = 0.08  # of a step, at its begin
HALL_FROM = 0.4  # of the highest speed: Hall sensors, whose angle between the edges is that of the last sector's speed
SECTOR = TURN_RAD / 6  # between two edges of Hall sensors
# Mean of a*T*t/2 + a*t**2/2 over a sector passed in T: what the angle with the speed of the sector before is late
LATE = 5.0 / 12.0
HALL_FITS = 12  # the same with Hall sensors, see _fit
FITS = 4  # with the speed of the fit before; the third changes nothing that counts
D_CURRENT, LARGEST_I_Q = 0.35, 0.7  # of the limit, held speeds
SPEED_HZ, FILTER_HZ, HELD_S, ROWS_HELD = 4.0, 40.0, 0.3, 300
NEAR, ARRIVE_S = 0.02, 3.0  # of the speed
TURNS = 4.3  # electrical, of which the whole ones count
SPREAD = 0.1  # largest rms of a held speed, of itself
PREDICTED = 0.04  # largest error of the point that was not fitted, of its voltage
LARGEST_ERROR_DEG = 15.0  # electrical, that alignment may have left
SIGMA_PSI, SIGMA_K = 0.01, 0.1  # largest uncertainties
# Means of hundreds of samples have no noise: what the equation leaves is the model's error, and every point of a sense
# repeats it.  Of the eight points two count.
REPEATED = 4.0


def current_gains(s: Session) -> tuple[float, float]:
    """(kp, ki) with the measured winding: the file's bandwidth, at most a fortieth of the sampling frequency."""
    m = s.drive.machine
    w_c = TURN_RAD * min(s.drive.control.current_bandwidth_hz, 1.0 / 40.0 / s.t_s)
    return w_c * min(m.inductance_d_h, m.inductance_q_h), w_c * m.resistance_ohm


def top_speed(s: Session) -> float:
    """The highest speed of these steps [electrical rad/s]."""
    m = s.drive.machine
    return min(OF_RATED * m.pole_pairs * m.rated_speed_rad_s, OF_VOLTAGE * s.voltage() / max(m.magnet_flux_wb, 1e-9))


def inertia(session: Session) -> Step:
    """K, b, c of the torque steps; the drive then has an inertia that fits the start value of psi."""
    s, m = session, session.drive.machine
    top, factor = top_speed(s), TORQUE[0]
    for factor in TORQUE:
        s.progress(f"inertia, {factor * s.limit:.3g} A")
        pieces, slow = _steps(s, factor * s.limit, top)
        if slow and factor == TORQUE[0]:
            continue  # try more
        if slow or min(len(piece.t) for piece in pieces) >= LEAST_ROWS:
            break
        if factor == TORQUE[1]:
            break  # less did not move it
    if slow:
        raise Refusal(
            f"the shaft does not turn: {factor * s.limit:.3g} A bring it to {abs(slow):.3g} electrical rad/s in "
            f"{LONGEST_S:.0f} s, expected {MOVES * top:.3g}; check the load, the brake and the inertia"
        )
    pairs = m.pole_pairs
    (k, b, c), (s_k, s_b, s_c), rms = torque_fit([_moving(s, piece) for piece in pieces])
    if k <= 0.0:
        raise Refusal(
            f"a positive torque current turns the shaft backward ({k:.3g} rad/s2 per A): the encoder's offset or "
            "direction is wrong; check the coupling of the encoder"
        )
    if s_k > SIGMA_K * k:
        raise Refusal(f"the acceleration is {k:.4g} +-{s_k:.2g} rad/s2 per A: the load disturbs; free the shaft")
    s.know("machine", inertia_kgm2=1.5 * pairs**2 * m.magnet_flux_wb / k)
    quantities = {"acceleration_per_a": Value(k, s_k, "rad/s2/A")}
    said = f"{k:.4g} +-{s_k:.1g} electrical rad/s2 per A, friction {b / k:.2g} A, rms {math.degrees(rms):.2g} degrees"
    return Step("inertia", quantities, said, {"k": [k, s_k], "b": [b, s_b], "c": [c, s_c]})


@dataclass(frozen=True)
class Moving:
    """A torque step without its begin: time [s], place [electrical rad], current [A], speed, as the core sees them.

    ``told``: the rows whose place the encoder tells; ``sector``: the angle between two edges where it is interpolated.
    """

    t: np.ndarray
    theta: np.ndarray
    current: np.ndarray
    omega: np.ndarray
    told: np.ndarray
    sector: float = 0.0


def _moving(s: Session, piece: Seen) -> Moving:
    """Hall sensors tell the place while the speed changes little within a sector, by (1/6 turn)*(change/speed)."""
    first = max(int(LEFT_OUT * len(piece.t)), 1)
    t, omega = piece.t[first:] - piece.t[first], piece.omega_me[first:]
    turns = (-1.0 if s.drive.sensors.position_reverse else 1.0) * s.code_pairs * TURN_RAD
    told = np.abs(omega) > (HALL_FROM * np.abs(omega).max() if s.coarse else -1.0)
    return Moving(t, turns * piece.code[first:], piece.current[first:], omega, told, SECTOR if s.coarse else 0.0)


def torque_fit(pieces: list[Moving]) -> tuple[np.ndarray, np.ndarray, float]:
    """((K, b, c), their standard uncertainties, rms of the place [rad]).

    What repeats in all rows of a step (a current's ripple that the snapshots met, a cogging torque) is in no residual
    of neighbours: of the residuals' uncertainty and that of leaving out one step after another the larger counts.
    """
    found, sigma, rms = _fit(pieces)
    without = np.array([_fit([p for p in pieces if p is not one])[0] for one in pieces])
    spread = np.sqrt((len(pieces) - 1) * without.var(axis=0))
    return found, np.maximum(sigma, spread), rms


def _fit(pieces: list[Moving]) -> tuple[np.ndarray, np.ndarray, float]:
    """((K, b, c), standard uncertainties of the residuals, their rms).

    The core's speed lags by its filter, so that the friction would turn its sign too late, and its angle is wrong
    between the edges of Hall sensors: from the second fit on, speed and angle are those of the fit before.

    Hall sensors.  Near standstill nobody tells the place, and the q current depends on it: di_q/dtheta = -i_d.  A fit
    with the place of the fit before diverges there, so the new place stands in its own equation, linear in it:
    theta + K*(double integral of i_d*theta) = the others.  Between the edges the angle of an accelerated shaft is
    late by LATE*a*(sector/omega)^2 in the mean, which is smooth, so that no residual would show it.
    """
    told = np.concatenate([p.told for p in pieces])
    coarse = any(p.sector for p in pieces)
    twice = [_integrator(p.t) @ _integrator(p.t) if coarse else np.zeros((0, 0)) for p in pieces]
    speeds, currents = [p.omega for p in pieces], [p.current for p in pieces]
    late, angles, k = [np.zeros(len(p.t)) for p in pieces], [p.theta for p in pieces], 0.0
    for _ in range(HALL_FITS if coarse else FITS):
        blocks, given = [], []
        for n, (p, omega, current) in enumerate(zip(pieces, speeds, currents, strict=True)):
            own = np.zeros((len(p.t), 2 * len(pieces)))
            own[:, 2 * n], own[:, 2 * n + 1] = 1.0, p.t
            parts = [_integral(p.t, part) for part in (np.imag(current), -np.sign(omega), -omega)]
            columns = np.column_stack([own, *(_integral(p.t, part) for part in parts), np.zeros(len(p.t))])
            if coarse:
                turned = k * twice[n] * np.real(current)
                columns[:, -1] = turned @ angles[n]
                columns = solve_triangular(np.eye(len(p.t)) + turned, columns, lower=True)
            blocks.append(columns[:, :-1])
            given.append(columns[:, -1])
            speeds[n] = np.column_stack([np.ones(len(p.t)), *parts])
        whole, known = np.vstack(blocks), np.concatenate(given)
        theta = (np.concatenate([p.theta + lag for p, lag in zip(pieces, late, strict=True)]) - known)[told]
        matrix = whole[told]
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-30)
        found, sigma, rms = solve(matrix / scale, theta)
        rest = theta - matrix / scale @ found
        found, sigma = found / scale, sigma / scale
        k = found[-3]
        angles = np.split(whole @ found + known, np.cumsum([len(p.t) for p in pieces])[:-1])
        currents = [p.current * np.exp(1j * (p.theta - at)) for p, at in zip(pieces, angles, strict=True)]
        speeds = [part @ np.r_[found[2 * n + 1], found[-3:]] for n, part in enumerate(speeds)]
        late = [_late(p, found[-3:], omega, i) for p, omega, i in zip(pieces, speeds, currents, strict=True)]
    like = float(np.clip(np.corrcoef(rest[1:], rest[:-1])[0, 1], 0.0, 0.99))
    return found[-3:], sigma[-3:] * math.sqrt((1.0 + like) / (1.0 - like)), rms  # neighbours resemble each other


def _late(piece: Moving, found: np.ndarray, omega: np.ndarray, current: np.ndarray) -> np.ndarray:
    """By how much the place between the edges is late, in the mean of a sector [rad]; of rows that are told."""
    k, b, c = found
    rate = k * np.imag(current) - b * np.sign(omega) - c * omega
    passed = np.divide(piece.sector, np.abs(omega), out=np.zeros(len(omega)), where=piece.told & (omega != 0.0))
    return LATE * rate * passed**2


def _integrator(t: np.ndarray) -> np.ndarray:
    """The matrix of ``_integral``."""
    half = 0.5 * np.diff(t)
    matrix = np.zeros((len(t), len(t)))
    matrix[1:, :-1] = np.tril(np.tile(half, (len(half), 1)))
    matrix[1:, 1:] += np.tril(np.tile(half, (len(half), 1)))
    return matrix


def _integral(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(t))])


def _steps(s: Session, current: float, top: float) -> tuple[list[Seen], float]:
    """(snapshots of each step, 0) or ([], the speed reached) where it does not move."""
    s.gates_off()
    s.release()
    s.settle(0.02)
    s.load(*current_gains(s))
    s.gates_on()
    target, pieces, sign = from_si("omega_ref", top, s.drive), [], 1.0
    for n in range(2 * CYCLES + 1):
        sign = 1.0 if n % 2 == 0 else -1.0
        s.set(i_q_ext=sign * current)
        began, rows, times = s.bus.now(), [], []
        while True:
            rows.append(s.snapshot())
            times.append(s.bus.now())
            speed, spent = rows[-1]["omega_me"], times[-1] - began
            if n == 0 and spent > 0.05 and -speed * sign > 0.3 * target:
                s.bus.write("enable", 0)
                raise Refusal(
                    "a positive torque current turns the shaft backward: the encoder's offset or direction is wrong; "
                    "check the coupling of the encoder"
                )
            if speed * sign >= target or spent > LONGEST_S:
                break
            if spent > ROWS * 3.0 * s.t_s:
                s.pause(spent / ROWS)
        pieces.append(Seen(s.drive, rows, times))
        if n == 0 and pieces[0].omega_me[-1] < MOVES * top:
            s.gates_off()
            return [], float(pieces[0].omega_me[-1]) or 1e-9
    # Braked before the gates go off, so that the next step begins near standstill.
    s.set(i_q_ext=-sign * current)
    end = s.bus.now() + LONGEST_S
    while s.bus.now() < end and s.snapshot()["omega_me"] * sign > 0.1 * target:
        pass
    s.gates_off()
    return pieces, 0.0


def magnet(session: Session, first: Step, v_dead: float) -> Step:
    """psi, the rest of the encoder's error, inertia and friction from ``first``; the drive then has all of them."""
    s, m = session, session.drive.machine
    top, v_1, k = top_speed(s), 4.0 / math.pi * v_dead, first.notes["k"][0]
    w_s = TURN_RAD * SPEED_HZ
    kp = w_s / k
    s.gates_off()
    s.release()
    s.settle(0.05)
    i_max = from_si("i_q_ext", LARGEST_I_Q * s.limit, s.drive)
    values = s.speed_gains(kp, kp * w_s / 5.0, FILTER_HZ)
    s.load(*current_gains(s), i_max=i_max, **values)
    s.bus.write("speed_mode", 1)
    s.gates_on()
    i_d = D_CURRENT * s.limit
    plan = [
        (sign * top * part, j) for sign in (1, -1) for part, j in ((0.5, i_d), (0.5, -i_d), (1.0, -i_d), (1.0, i_d))
    ]
    points, at, held = [], 0.0, 0.0
    for n, (speed, j) in enumerate([*plan, (-0.75 * top, 0.6 * i_d)]):
        s.progress(f"magnet flux, {speed / m.pole_pairs * 30 / math.pi:.0f} rpm ({n + 1} of {len(plan) + 1})")
        seconds = max(0.1, 1.5 * abs(speed - at) / (LARGEST_I_Q * 0.5 * s.limit * k))
        s.ramp(seconds, omega_ref=(at, speed), i_d_ref=(held, j))
        at, held = speed, j
        arrive(s, speed)
        points.append(_held(s, speed))
    s.ramp(max(0.1, 1.5 * abs(at) / (LARGEST_I_Q * 0.5 * s.limit * k)), omega_ref=(at, 0.0), i_d_ref=(held, 0.0))
    s.gates_off()
    return judge(s, first, points, v_1)


def arrive(s: Session, speed: float) -> None:
    """Until the mean speed of a tenth of a second is near the reference, or patience ends."""
    s.settle(HELD_S)
    end = s.bus.now() + ARRIVE_S
    while s.bus.now() < end and abs(float(s.look(20, 5e-3).omega_me.mean()) - speed) > NEAR * abs(speed):
        pass


def _held(s: Session, speed: float) -> np.ndarray:
    """Means of (omega, i_d, i_q, u_d, u_q) at a speed that is held."""
    turns_s = TURNS * TURN_RAD / abs(speed)
    seen = s.look(ROWS_HELD, max(turns_s / ROWS_HELD - 3.0 * s.t_s, 0.0))
    omega, spread = float(seen.omega_me.mean()), float(seen.omega_me.std())
    if abs(omega - speed) > 0.05 * abs(speed) or spread > SPREAD * abs(speed):
        used = float(np.abs(seen.voltage).mean()) / s.voltage()
        why = "too little voltage for it" if used > 0.95 else "the load is too large, or the speed loop does not settle"
        raise Refusal(
            f"the speed is {omega:.4g} +-{spread:.2g} electrical rad/s, expected {speed:.4g}: {why}, "
            f"{100 * used:.0f} % of the voltage are used"
        )
    turned = np.abs(seen.theta_me - seen.theta_me[0])
    whole = turned <= max(math.floor(turned[-1] / TURN_RAD), 1) * TURN_RAD  # harmonics of the angle cancel
    return np.array([float(getattr(seen, n)[whole].mean()) for n in ("omega_me", "i_d", "i_q", "u_d", "u_q")])


def judge(s: Session, first: Step, points: list[np.ndarray], v_1: float) -> Step:
    """The regression; the last point is predicted, not fitted."""
    m = s.drive.machine
    omega, i_d, i_q, u_d, u_q = np.array(points).T
    w_e, cosine = 2.0 / s.t_s * np.sin(omega * s.t_s / 2.0), np.cos(omega * s.t_s / 2.0)
    size = np.hypot(i_d, i_q)
    rest_q = u_q - v_1 * i_q / size - m.resistance_ohm * cosine * i_q
    rest_d = u_d - v_1 * i_d / size + w_e * m.inductance_q_h * i_q
    (psi, l_d), (s_psi, _), _ = solve(np.column_stack([w_e, w_e * i_d])[:-1], rest_q[:-1])
    s_psi *= math.sqrt(REPEATED)
    if not psi > 0.0 or s_psi > SIGMA_PSI * psi:
        raise Refusal(
            f"psi = {1e3 * psi:.4g} +-{1e3 * s_psi:.2g} mWb: expected an uncertainty below {100 * SIGMA_PSI:.0f} %; "
            "a load that swings, or too low a speed"
        )
    (r, error), (_, s_error), _ = solve(np.column_stack([cosine * i_d, w_e * psi])[:-1], rest_d[:-1])
    if abs(math.degrees(error)) > LARGEST_ERROR_DEG:
        raise Refusal(
            f"the EMF shows that the encoder's offset is wrong by {math.degrees(error):.0f} degrees, expected "
            f"{LARGEST_ERROR_DEG:.0f} at most: the encoder slips, or alignment was disturbed"
        )
    told_q = (w_e * psi + w_e * l_d * i_d + u_q - rest_q)[-1]
    told_d = (cosine * r * i_d + w_e * psi * error + u_d - rest_d)[-1]
    wrong = math.hypot(told_d - u_d[-1], told_q - u_q[-1]) / math.hypot(u_d[-1], u_q[-1])
    if wrong > PREDICTED:
        raise Refusal(
            f"at a held-out speed the voltage is {100 * wrong:.1f} % off, expected {100 * PREDICTED:.0f} %: "
            "R, L and psi do not describe this machine"
        )
    k, b, c = (first.notes[name] for name in "kbc")
    early = s.drive.inverter.dead_time_s / (2.0 * m.inductance_q_h)
    c = (c[0] - k[0] * psi * early, c[1])
    k = (k[0] * (1.0 + m.resistance_ohm * early), k[1])
    ratio = 1.5 * m.pole_pairs**2 * psi
    j = ratio / k[0]
    s_j = j * math.hypot(k[1] / k[0], s_psi / psi)
    coulomb, viscous = max(b[0], 0.0) * j / m.pole_pairs, max(c[0], 0.0) * j
    s.know("machine", magnet_flux_wb=float(psi), inertia_kgm2=float(j))
    s.know("machine", coulomb_friction_nm=float(coulomb), viscous_friction_nms=float(viscous))
    offset = (s.drive.sensors.theta_offset_rad - error) % TURN_RAD
    s.know("sensors", theta_offset_rad=float(offset))
    quantities = {
        "magnet_flux": Value(float(psi), float(s_psi), "Wb"),
        "inertia": Value(float(j), float(s_j), "kg m2"),
        "coulomb_friction": Value(float(coulomb), float(b[1] * j / m.pole_pairs), "Nm"),
        "viscous_friction": Value(float(viscous), float(c[1] * j), "Nm s"),
        "theta_offset": Value(float(offset), float(s_error), "rad"),
    }
    said = (
        f"psi {1e3 * psi:.5g} +-{1e3 * s_psi:.1g} mWb, J {j:.4g} +-{s_j:.1g} kg m2, offset moved by "
        f"{-math.degrees(error):.2f} +-{math.degrees(s_error):.2f} degrees, prediction {100 * wrong:.2f} % off"
    )
    return Step("magnet", quantities, said, {"predicted": wrong, "resistance_turning": float(r)})


def closed_loop(session: Session) -> Step:
    """The drive with its final registers: both senses at half the speed, no trip, no runaway."""
    s, drive = session, session.drive
    speed = 0.5 * top_speed(s)
    quiet = drive.control.speed_bandwidth_hz is None
    s.gates_off()
    s.release()
    s.load_final()
    s.settle(0.1)  # the core looks at the sensors' zero again
    if quiet:
        return Step("closed loop", {}, "no speed loop in the drive file: not run", {})
    k = 1.5 * drive.machine.pole_pairs**2 * drive.machine.magnet_flux_wb / drive.machine.inertia_kgm2
    seconds = max(0.2, 2.0 * speed / (0.4 * s.limit * k))
    s.bus.write("speed_mode", 1)
    s.gates_on()
    found, at = [], 0.0
    for to in (speed, -speed):
        s.progress(f"closed loop, {to / drive.machine.pole_pairs * 30 / math.pi:.0f} rpm")
        s.ramp(seconds * (2.0 if at else 1.0), 40, omega_ref=(at, to))
        arrive(s, to)
        at = to
        found.append(abs(_held(s, to)[0] / to - 1.0))
    s.ramp(seconds, 40, omega_ref=(at, 0.0))
    s.gates_off()
    worst = max(found)
    return Step("closed loop", {}, f"both senses, speed within {100 * worst:.2f} %", {"speed_error": worst})
