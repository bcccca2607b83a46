# SPDX-License-Identifier: BSD-3-Clause
"""Offsets of the current sensors with the gates off; then which sensor answers to which leg.

Offsets: mean code of each sensor; its uncertainty is the codes' deviation over the root of their number.

Phases: at a standing forced angle a slow integrator raises the voltage until a sensor shows a small part of the current
limit.  Nothing else closes the loop, so a sensor with the wrong sign or in the wrong place cannot run away: the voltage
grows by the same few volts a second, and the host ends it.  The answers at 0, 120, 240 and 90 degrees are compared with
those of every order and sign of the sensors; the true one must fit best and well.
"""

from __future__ import annotations

import math
from itertools import permutations, product

import numpy as np

from fluxproof.commission.session import Refusal, Session, Step, Value
from golden_model.fluxproof import REGISTERS
from golden_model.io.fault_latch import NAMES
from golden_model.scaling import leg_loss_v
from golden_model.units import TURN_RAD, from_si

SAMPLES, MOST_SAMPLES, OFFSET_SIGMA = 400, 12000, 0.3  # of an offset; more until its uncertainty [codes] is this
LARGEST_OFFSET = 0.06  # of the range: a sensor beyond is not there, or not at zero
MOVING_TURNS = 2e-3  # the shaft stands within
LOOKED_FOR = 0.2  # of the current limit
ANGLES = (0.0, 120.0, 240.0, 90.0)
RISE_S, PATIENCE = 0.6, 1.6  # to the expected voltage; how many times that voltage
HOLD_S, GROWN = 0.25, 1.8  # after LOOKED_FOR; ended early above so many times of it
OPEN_BELOW = 0.15  # of the largest current of any phase
FITS = 0.8  # correlation of the answers with the true order; a wrong one reaches 0.5
LEAST_BUS = 0.7  # of the nominal voltage


def offsets(session: Session) -> Step:
    """Offsets of the sensors; Refusal for a moving shaft, a missing supply or a dead sensor."""
    s, drive = session, session.drive
    s.gates_off()
    s.release()
    s.load()
    seen = s.look(SAMPLES)
    moved = np.ptp(seen.code)
    if moved > MOVING_TURNS + 2.0 * s.code_step:
        raise Refusal(f"the shaft turned by {360 * moved:.2g} degrees with the gates off, expected standstill")
    u_dc, nominal = float(seen.u_dc.mean()), drive.inverter.dc_bus_v
    if u_dc < LEAST_BUS * nominal:
        raise Refusal(
            f"too little voltage: {u_dc:.4g} V on the bus, expected {nominal:.4g} V; check the supply, "
            "[sensors] u_dc_range_v and [inverter] dc_bus_v"
        )
    codes = seen.adc
    more = int((float(codes.std(axis=0, ddof=1).max()) / OFFSET_SIGMA) ** 2) - SAMPLES
    if more > 0:
        s.progress(f"offsets, {min(more, MOST_SAMPLES)} samples more")
        codes = np.vstack([codes, s.look(min(more, MOST_SAMPLES)).adc])
    means, deviations = codes.mean(axis=0), codes.std(axis=0, ddof=1)
    mid = 2.0 ** (drive.sensors.adc_bits - 1)
    used = "bc" if drive.current_sensors == 2 else "abc"
    values = {}
    for k, x in enumerate("abc"):
        if x not in used:
            continue
        if abs(means[k] - mid) > LARGEST_OFFSET * mid:
            raise Refusal(
                f"sensor {x} shows code {means[k]:.0f} without current, expected {mid:.0f}: check its supply and wiring"
            )
        sigma = max(deviations[k], 1.0 / math.sqrt(12.0)) / math.sqrt(len(codes))
        values[f"offset_{x}"] = Value(float(means[k]), float(sigma), "codes")
    found = tuple(float(m) if x in used else mid for x, m in zip("abc", means, strict=True))
    s.know("sensors", current_offset_code=found)
    shown = ", ".join(f"{x} {means['abc'.index(x)]:.2f}" for x in used)
    said = f"{shown} codes +-{max(v.sigma for v in values.values()):.2f}; bus {u_dc:.4g} V"
    return Step("offsets", values, said, {"u_dc_v": u_dc})


def phases(session: Session) -> Step:
    """Which sensor answers to which leg; Refusal for anything but the true order, or a phase that carries nothing."""
    s = session
    answers, largest = [], np.zeros(3)
    for angle in ANGLES:
        s.progress(f"phases at {angle:.0f} degrees")
        answers.append(_answer(s, math.radians(angle)))
        largest = np.maximum(largest, np.abs(answers[-1]))
    s.gates_off()
    answers = np.array(answers)
    if largest.max() < 0.5 * LOOKED_FOR * s.limit:
        raise Refusal(
            f"no current: at most {largest.max():.2g} A, expected {LOOKED_FOR * s.limit:.2g} A; two phases are "
            "open, or the power stage does not switch"
        )
    for x, size in zip("abc", largest, strict=True):
        if size < OPEN_BELOW * largest.max():
            raise Refusal(
                f"phase {x} is open: {size:.2g} A in it, expected {largest.max():.2g} A as in the others; check its "
                "cable and its sensor"
            )
    fits = _fits(answers, s.drive.current_sensors == 2)
    (order, signs), fit = max(fits.items(), key=lambda item: item[1])
    true = fits[(0, 1, 2), (1, 1, 1)]
    if (order, signs) != ((0, 1, 2), (1, 1, 1)) and fit > true + 0.02:
        raise Refusal(f"{_told(order, signs)}; expected sensors a, b, c to follow legs a, b, c in the same sense")
    if true < FITS:
        raise Refusal(
            f"the currents follow the voltages by {100 * true:.0f} % only, expected {100 * FITS:.0f} %; check the "
            "cables of the phases and the sensors"
        )
    return Step("phases", {"agreement": Value(true, 0.0, "1")}, f"in order, agreement {100 * true:.1f} %")


def _answer(s: Session, angle: float) -> np.ndarray:
    """The three sensed currents [A] when the first has reached LOOKED_FOR, or the voltage its end."""
    drive, target = s.drive, LOOKED_FOR * s.limit
    mid_loss = 4.0 / 3.0 * leg_loss_v(drive)
    most = PATIENCE * (2.0 * drive.machine.resistance_ohm * target + 1.5 * mid_loss + 0.01 * drive.inverter.dc_bus_v)
    most = min(most, 0.9 * s.voltage())
    rate = most / PATIENCE / RISE_S / target  # V/(A s): the voltage that a full error adds in a second
    ignored = 1 << NAMES.index("current_sum") | 1 << NAMES.index("position")
    ignored |= 1 << NAMES.index("open_load") if "open_load" in NAMES else 0
    s.load(0.0, rate, reverse=0, theta_offset=0, fault_ignore=ignored & REGISTERS["fault_ignore"].high)
    s.gates_off()
    s.force(angle)
    s.gates_on()
    s.set(i_d_ref=1.2 * target)  # at 90 degrees a phase shows cos 30 of it
    offsets = np.array(drive.sensors.current_offset_code)
    per_code = drive.sensors.current_range_a / 2.0 ** (drive.sensors.adc_bits - 1)

    def sensed(row):
        i = (np.array([row[f"snap_adc_{x}"] for x in "abc"]) - offsets) * per_code * drive.sensors.current_gain
        if drive.current_sensors == 2:
            i[0] = -i[1] - i[2]
        return i

    lsb = from_si("u_d", most, drive)

    def ended(row):
        return np.abs(sensed(row)).max() > target or math.hypot(row["u_d"], row["u_q"]) > lsb

    end, last = s.bus.now() + 2.0 * PATIENCE * RISE_S, []
    while s.bus.now() < end:
        row = s.snapshot()
        last = [*last, sensed(row)][-4:]
        if ended(row):
            break
        s.bus.wait(4.0 * s.t_s)
    # In the true order the integrator now holds the current, and the rotor comes to rest; in a wrong one it grows on.
    end = s.bus.now() + HOLD_S
    while s.bus.now() < end and np.abs(last[-1]).max() < GROWN * target:
        last = [*last, sensed(s.snapshot())][-20:]
        s.bus.wait(4.0 * s.t_s)
    s.bus.write("enable", 0)
    s.settle(0.02)
    return np.mean(last, axis=0)


def _fits(answers: np.ndarray, two: bool) -> dict:
    """{(order, signs): correlation} of the answers with those of sensors that see leg order[x] with signs[x]."""
    legs = np.array([[math.cos(math.radians(a) - k * TURN_RAD / 3.0) for k in range(3)] for a in ANGLES])
    size = np.linalg.norm(answers, axis=1, keepdims=True)
    seen, found = answers / np.maximum(size, 1e-12), {}
    for order in permutations(range(3)):
        for signs in product((1, -1), repeat=3):
            if two and signs[0] < 0:
                continue
            model = legs[:, order] * signs
            if two:
                model[:, 0] = -model[:, 1] - model[:, 2]
            norm = np.linalg.norm(model, axis=1, keepdims=True)
            found[order, signs] = float(np.mean(np.sum(seen * model / np.maximum(norm, 1e-12), axis=1)))
    return found


def _told(order: tuple, signs: tuple) -> str:
    """The order in words."""
    wrong = [f"sensor {x} follows leg {'abc'[leg]}" for x, leg in zip("abc", order, strict=True) if x != "abc"[leg]]
    turned = [x for x, sign in zip("abc", signs, strict=True) if sign < 0]
    words = []
    if wrong:
        words.append(f"phases are swapped: {', '.join(wrong)}")
    if turned:
        words.append(f"current sensor {' and '.join(turned)} has the wrong sign")
    return "; ".join(words)
