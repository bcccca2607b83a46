# SPDX-License-Identifier: BSD-3-Clause
"""Direction and offset of the encoder: the field turns slowly by one turn of the shaft each way, the rotor follows.

    theta_me = +-pole_pairs * code + theta_offset

The rotor lags behind the field by friction, to the same side as it turns: the mean of both ways has no lag.  The
EMF of a rotor that swings in the field drives a current through R + kp, which damps it:

    w_0^2 = 1.5*p^2*psi*I/J;    damping = psi*w_0/(2*I*(R + kp))

kp gives a damping of a third with the start values, more of it where the dead time would bend the vector, and the
integral is slower than the swing.  Each way is fitted by a line, code over field: its slope is +-1 where pole pairs and
counts are right.
"""

from __future__ import annotations

import math

import numpy as np

from fluxproof.commission import winding
from fluxproof.commission.session import Refusal, Seen, Session, Step, Value
from golden_model.scaling import leg_loss_v
from golden_model.units import TURN_RAD

CURRENT, OF_MAGNET = 0.6, 0.3  # of the limit; (L_q - L_d)*I over psi
DAMPING, SLOW_HZ, OF_SWING = 0.33, 4.0, 0.3  # of the swing; the integral's corner, and as part of the swing
FASTEST = 1.0 / 60.0  # of the sampling frequency
STIFF = 2.0  # kp*I over the dead time's voltage
RAMP_S, FIELD_HZ, LEAST_S = 0.4, 6.0, 0.8  # the field's electrical frequency, at least so long a turn
ATTEMPTS, SOFTER, SLOWER = 3, 0.4, 0.6  # where the rotor swings: kp and speed of the next attempt
SAMPLES, INDEX_TURNS = 600, 0.15  # a way; turned to find an index, beside a turn for each pass
MOVED = 0.02  # of a turn: less is a locked rotor
SLOPE = 0.05  # largest error of the slope
LAG_DEG, RIPPLE_DEG = 40.0, 15.0  # electrical, largest


class Swinging(Refusal):
    """The rotor has not come to rest in the field."""


def align(session: Session, reverse_given: bool | None) -> Step:
    """Direction and offset; ``reverse_given``: what the drive file says of the direction, None where nothing."""
    s, pairs = session, session.drive.machine.pole_pairs
    speed = TURN_RAD * min(FIELD_HZ, pairs / LEAST_S)
    s.gates_off()
    kp, ki = gains(s)
    s.load(kp, ki, reverse=0, theta_offset=0)
    s.force(0.0)
    s.gates_on()
    slow = (s.drive.machine.resistance_ohm + kp) / ki
    s.ramp(max(RAMP_S, 4.0 * slow), i_d_ref=(0.0, held(s)))
    s.settle(max(0.2, 4.0 * slow))
    if s.drive.encoder.kind == "abz":
        _find_index(s, speed)
    for attempt in range(ATTEMPTS):
        ways = _turn_both_ways(s, speed)
        try:
            found = judge(s, ways, reverse_given)
            break
        except Swinging:
            if attempt + 1 == ATTEMPTS:
                raise
            # The swing goes on dying away meanwhile, and softer regulators damp it more; a slower field leaves the
            # resonance in which the sensors' offsets, once a turn of the field, may drive it.
            kp, speed = kp * SOFTER, speed * SLOWER
            s.load(kp, (s.drive.machine.resistance_ohm + kp) / slow, reverse=0, theta_offset=0)
    s.ramp(0.1, i_d_ref=(held(s), 0.0))
    s.gates_off()
    return found


def _turn_both_ways(s: Session, speed: float) -> list[Seen]:
    """A turn of the shaft forward, and one back."""
    ways, pairs = [], s.drive.machine.pole_pairs
    for sign in (1.0, -1.0):
        s.progress(f"alignment, field turns {'forward' if sign > 0 else 'back'}")
        s.force(0.0, sign * speed)
        s.settle(0.1)
        seconds = TURN_RAD * pairs / speed
        pause = max(seconds / SAMPLES - 3.0 * s.t_s, 0.0)
        end = s.bus.now() + seconds
        ways.append(s.look(10 * SAMPLES, pause, until=lambda _, end=end: s.bus.now() >= end))
        reached = float(np.hypot(ways[-1].i_d, ways[-1].i_q).mean())
        if reached < 0.8 * held(s):
            raise Refusal(
                f"too little voltage: {reached:.3g} A flow, expected {held(s):.3g} A; check the bus voltage "
                "and [machine] resistance_ohm"
            )
    return ways


def _spread(ways: list[np.ndarray], pieces: int) -> float:
    """Standard uncertainty of the mean of both ways, from the means of their pieces."""
    found = []
    for way in ways:
        means = np.array([np.angle(np.mean(np.exp(1j * piece))) for piece in np.array_split(way, pieces)])
        around = np.angle(np.exp(1j * (means - np.angle(np.mean(np.exp(1j * means))))))
        found.append(float(np.var(around, ddof=1)) / pieces)
    return math.sqrt(sum(found)) / len(found)


def held(s: Session) -> float:
    """The field's current [A]: less where reluctance would take the magnet's torque away (L_q above L_d)."""
    m = s.drive.machine
    saliency = max(m.inductance_q_h - m.inductance_d_h, 0.0)
    return min(CURRENT * s.limit, OF_MAGNET * m.magnet_flux_wb / saliency if saliency else math.inf)


def gains(s: Session) -> tuple[float, float]:
    """(kp [V/A], ki [V/(A s)]) with the start values."""
    m, current = s.drive.machine, held(s)
    swing = winding.swing(s, current)
    damped = m.magnet_flux_wb * swing / (2.0 * DAMPING * current) - m.resistance_ohm
    stiff = STIFF * 4.0 / math.pi * leg_loss_v(s.drive) / current
    henry = min(m.inductance_d_h, m.inductance_q_h)
    kp = min(max(damped, stiff), TURN_RAD * henry * FASTEST / s.t_s)
    return kp, (m.resistance_ohm + kp) * min(TURN_RAD * SLOW_HZ, OF_SWING * swing)


def _find_index(s: Session, speed: float) -> None:
    """Turns of the shaft until the encoder has found its index and met it again, as many as that takes at most."""
    s.progress("alignment, looking for the index")
    s.force(0.0, speed)
    turns, looks = s.drive.encoder.index_passes + INDEX_TURNS, 40 * s.drive.encoder.index_passes
    pause = turns * TURN_RAD * s.drive.machine.pole_pairs / speed / looks
    seen = s.look(looks, pause, until=lambda _: bool(s.bus.read("encoder_flags") & 1))
    if not s.bus.read("encoder_flags") & 1 and float(np.ptp(seen.code)) > 0.9:
        raise Refusal(
            "no index within a turn of the shaft, or not again at the same place, expected one a turn; check the line "
            "Z and [encoder] index_phase"
        )


def judge(s: Session, ways: list[Seen], reverse_given: bool | None) -> Step:
    """What both ways say; the drive then has direction and offset."""
    pairs = s.code_pairs
    slopes, moved = [], [float(np.ptp(way.code)) for way in ways]
    if max(moved) < MOVED:
        raise Refusal(
            f"locked rotor: the encoder moved by {max(moved):.3f} turns, expected 1, as the field each way; free the "
            "shaft, check that the encoder counts and that the current limit moves the load"
        )
    for way in ways:
        slope, _ = np.polyfit(way.place, way.code, 1)
        slopes.append(float(slope))
    ratio = sum(slopes) / 2.0
    if abs(abs(ratio) - 1.0) > SLOPE or slopes[0] * slopes[1] < 0.0 or abs(slopes[0] - slopes[1]) > 2.0 * SLOPE:
        raise Refusal(
            f"the encoder moved {slopes[0]:.3f} and {slopes[1]:.3f} turns a turn of the field, expected 1 or -1; check "
            "[machine] pole_pairs, [encoder] counts, [sensors] position_pole_pairs, and whether the load lets the "
            "shaft turn freely"
        )
    reverse = ratio < 0.0
    if reverse_given is not None and reverse_given != reverse:
        raise Refusal(
            f"reversed encoder: its code {'falls' if reverse else 'rises'} while the field turns forward, "
            f"[sensors] position_reverse = {str(reverse_given).lower()} contradicts this; two phases of the motor or "
            "two lines of the encoder are exchanged, or leave the key out to have it measured"
        )
    sign = -1.0 if reverse else 1.0
    # The field is where the current is, which the dead time moves around the forced angle.
    parts = [way.theta_me + np.angle(way.current) - sign * pairs * TURN_RAD * way.code for way in ways]
    means = [np.angle(np.mean(np.exp(1j * part))) for part in parts]
    lag = float(np.angle(np.exp(1j * (means[0] - means[1]))) / 2.0)
    offset = float(np.angle(sum(np.exp(1j * mean) for mean in means)))
    ripple = math.sqrt(
        float(np.mean([np.angle(np.exp(1j * (p - m))) ** 2 for p, m in zip(parts, means, strict=True) for p in p]))
    )
    step = TURN_RAD * pairs * s.code_step
    ripple = math.sqrt(max(ripple**2 - step**2 / 12.0, 0.0))  # without the rounding to the step of the code
    if abs(math.degrees(lag)) > LAG_DEG or math.degrees(ripple) > RIPPLE_DEG:
        raise Swinging(
            f"the rotor lags the field by {math.degrees(lag):.0f} degrees and swings by {math.degrees(ripple):.0f} "
            f"rms, expected {LAG_DEG:.0f} and {RIPPLE_DEG:.0f} at most: friction, cogging or load is too large for the "
            "current limit, or an edge of the encoder is lost"
        )
    turned = s.drive.machine.pole_pairs  # electrical turns each way
    sigma = math.hypot(_spread(parts, max(turned, 4)), step / math.sqrt(12.0 * 2.0 * turned))
    s.know("sensors", position_reverse=reverse, theta_offset_rad=offset % TURN_RAD)
    said = (
        f"code {'falls' if reverse else 'rises'} with the field, offset {math.degrees(offset) % 360:.2f} degrees "
        f"+-{math.degrees(sigma):.2f}, lag {math.degrees(lag):.1f}, turns {abs(ratio):.4f}"
    )
    values = {
        "theta_offset": Value(offset % TURN_RAD, sigma, "rad"),
        "turns": Value(abs(ratio), abs(slopes[0] - slopes[1]) / 2, "1"),
    }
    taken = float(np.mean([np.abs(way.voltage).mean() / np.abs(way.current).mean() for way in ways]))
    notes = {"position_reverse": reverse, "lag_deg": math.degrees(lag), "volts_per_a": taken}
    return Step("alignment", values, said, notes)
