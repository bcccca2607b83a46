"""Direction and offset of the encoder: the field turns slowly by one turn of the shaft each way, the rotor follows.

    theta_me = +-pole_pairs * code + theta_offset

The rotor lags behind the field by friction, to the same side as it turns: the mean of both ways has no lag.  The
current regulators are slower than the rotor's swing in the field, so that its EMF drives a current and damps it.  Each
way is fitted by a line, code over field: its slope is +-1 where pole pairs and counts are right.
"""

from __future__ import annotations

import math

import numpy as np

from fluxproof.commission.session import Refusal, Seen, Session, Step, Value
from fluxproof.golden_model.units import TURN_RAD

CURRENT = 0.6  # of the limit
SLOW_HZ = 5.0  # current regulators
RAMP_S, FIELD_HZ, LEAST_S = 0.4, 6.0, 0.8  # the field's electrical frequency, at least so long a turn
SAMPLES = 600  # a way
MOVED = 0.02  # of a turn: less is a locked rotor
SLOPE = 0.05  # largest error of the slope
LAG_DEG, RIPPLE_DEG = 40.0, 15.0  # electrical, largest


def align(session: Session, reverse_given: bool | None) -> Step:
    """Direction and offset; ``reverse_given``: what the drive file says of the direction, None where nothing."""
    s, pairs = session, session.drive.machine.pole_pairs
    speed = TURN_RAD * min(FIELD_HZ, pairs / LEAST_S)
    s.gates_off()
    s.load(SLOW_HZ, reverse=0, theta_offset=0)
    s.force(0.0)
    s.gates_on()
    s.ramp(RAMP_S, i_d_ref=(0.0, CURRENT * s.limit))
    s.settle(0.2)
    ways = []
    for sign in (1.0, -1.0):
        s.progress(f"alignment, field turns {'forward' if sign > 0 else 'back'}")
        s.force(0.0, sign * speed)
        s.settle(0.1)
        seconds = TURN_RAD * pairs / speed
        pause = max(seconds / SAMPLES - 3.0 * s.t_s, 0.0)
        end = s.bus.now() + seconds
        ways.append(s.look(10 * SAMPLES, pause, until=lambda _, end=end: s.bus.now() >= end))
        reached = float(np.hypot(ways[-1].i_d, ways[-1].i_q).mean())
        if reached < 0.8 * CURRENT * s.limit:
            raise Refusal(
                f"too little voltage: {reached:.3g} A flow, expected {CURRENT * s.limit:.3g} A; check the bus voltage "
                "and [machine] resistance_ohm"
            )
    s.ramp(0.1, i_d_ref=(CURRENT * s.limit, 0.0))
    s.gates_off()
    return judge(s, ways, reverse_given)


def judge(s: Session, ways: list[Seen], reverse_given: bool | None) -> Step:
    """What both ways say; the drive then has direction and offset."""
    pairs = s.drive.machine.pole_pairs
    slopes, moved = [], [float(np.ptp(way.code)) for way in ways]
    if max(moved) < MOVED:
        raise Refusal(
            f"locked rotor: the field turned by a turn of the shaft each way, the encoder by {max(moved):.3f}; free the "
            "shaft, check that the encoder counts and that the current limit moves the load"
        )
    for way in ways:
        slope, _ = np.polyfit(way.place, way.code, 1)
        slopes.append(float(slope))
    ratio = sum(slopes) / 2.0
    if abs(abs(ratio) - 1.0) > SLOPE or slopes[0] * slopes[1] < 0.0 or abs(slopes[0] - slopes[1]) > 2.0 * SLOPE:
        raise Refusal(
            f"the encoder moved {slopes[0]:.3f} and {slopes[1]:.3f} turns a turn of the field, expected 1 or -1; check "
            "[machine] pole_pairs, [encoder] counts, and whether the load lets the shaft turn freely"
        )
    reverse = ratio < 0.0
    if reverse_given is not None and reverse_given != reverse:
        raise Refusal(
            f"reversed encoder: its code {'falls' if reverse else 'rises'} while the field turns forward, "
            f"[sensors] position_reverse = {str(reverse_given).lower()} says otherwise; two phases of the motor or two "
            "lines of the encoder are exchanged, or leave the key out to have it measured"
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
    if abs(math.degrees(lag)) > LAG_DEG or math.degrees(ripple) > RIPPLE_DEG:
        raise Refusal(
            f"the rotor lags the field by {math.degrees(lag):.0f} degrees and swings by {math.degrees(ripple):.0f} rms, "
            f"expected {LAG_DEG:.0f} and {RIPPLE_DEG:.0f} at most: friction, cogging or load is too large for the "
            "current limit, or an edge of the encoder is lost"
        )
    resolution = TURN_RAD * pairs / min(2**s.drive.sensors.position_bits, s.drive.encoder.counts or 1 << 30)
    sigma = math.hypot(ripple / math.sqrt(2.0 * pairs), resolution / math.sqrt(12.0 * 2.0 * pairs))
    s.know("sensors", position_reverse=reverse, theta_offset_rad=offset % TURN_RAD)
    said = (
        f"code {'falls' if reverse else 'rises'} with the field, offset {math.degrees(offset) % 360:.2f} degrees "
        f"+-{math.degrees(sigma):.2f}, lag {math.degrees(lag):.1f}, turns {abs(ratio):.4f}"
    )
    values = {"theta_offset": Value(offset % TURN_RAD, sigma, "rad"), "turns": Value(abs(ratio), abs(slopes[0] - slopes[1]) / 2, "1")}
    return Step("alignment", values, said, {"position_reverse": reverse, "lag_deg": math.degrees(lag)})
