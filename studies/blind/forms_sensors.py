# SPDX-License-Identifier: BSD-3-Clause
"""Effects of sensors and sampling, in the catalogue's form and in others (registry.py).

Signs: measured = true (1 + gain) + offset, for angles measured = true + offset, for the bus measured =
true (1 + gain).  Gains of the phases sum to zero; a common part would be current_scale.
"""

from __future__ import annotations

import math

import numpy as np

from studies.blind import params as P
from studies.blind.registry import CATALOGUE, effect, rated, sign, three


@effect("late_angle")
def sampling_skew(b, rng, size, form):
    """Typical: 1 us; the other form latches the angle at another instant than the currents."""
    tau = 1e-6 * size * sign(rng)
    if form == "late_angle":
        b.change("sensor", theta_late_s=-tau)
    else:
        b.change("sensor", skew_s=tau)
    return {"skew_s": tau}


@effect("creeping")
def encoder_offset(b, rng, size, form):
    """Typical: 2 electrical degrees; the other form drifts by 15 % during the recording."""
    offset, creep = math.radians(2.0) * size * sign(rng), 0.15 * (form != CATALOGUE)
    b.on_course.append(lambda c, x: c.theta_offset.__iadd__(offset * (1.0 - creep * x)))
    return {} if creep else {"offset_rad": offset}


@effect("triangle", "leaning", "two_per_turn")
def encoder_eccentricity(b, rng, size, form):
    """Typical: 1.5 electrical degrees once per mechanical turn."""
    a = math.radians(1.5) * size
    kind = {"triangle": P.WAVE_TRIANGLE, "leaning": P.WAVE_SKEWED}.get(form, P.WAVE_COSINE)
    b.change("sensor", ecc_1=a, ecc_1_phase=rng.uniform(0, 6), ecc_1_wave=kind)
    if form == "two_per_turn":
        b.change("sensor", ecc_2=a * rng.uniform(0.2, 0.5), ecc_2_phase=rng.uniform(0, 6))
    return {"amplitude_rad": a} if form == CATALOGUE else {}


@effect("drifting")
def current_offset(b, rng, size, form):
    """Typical: 1 % of the rated current in the worst phase."""
    x = rng.uniform(-1.0, 1.0, 3)
    offsets = 0.01 * size * rated(b) * x / np.abs(x).max()
    creep = 0.3 * (form != CATALOGUE)
    b.on_course.append(lambda c, x: c.offsets.__iadd__(offsets[:, None] * (1.0 - creep * x)))
    if creep:
        return {}
    # A common-mode part is not visible in dq.
    return dict(zip(("offset_a_a", "offset_b_a", "offset_c_a"), offsets, strict=True))


@effect("two_sensors", "all_three")
def current_gain(b, rng, size, form):
    """Typical: 2 % in the worst phase."""
    g = 0.02 * size * three(rng, form == "all_three")
    if form == "two_sensors":
        g = 0.02 * size * sign(rng) * np.array((1.0, -1.0, 0.0))
        b.change("sensor", two_sensors=1)
    b.change("sensor", gain_a=g[0], gain_b=g[1], gain_c=g[2])
    return {} if form == "two_sensors" else dict(zip(("gain_a", "gain_b", "gain_c"), g, strict=True))


@effect("drooping")
def current_scale(b, rng, size, form):
    """Typical: 3 %; the other form saturates at high currents."""
    s = 0.03 * size * sign(rng)
    b.change("sensor", scale=s)
    if form == "drooping":
        b.change("sensor", cubic=-0.1 * abs(s) / rated(b) ** 2)
        return {}
    return {"scale": s}


@effect("offset")
def udc_gain(b, rng, size, form):
    """Typical: 2 %; the other form is partly an offset of the bus sensor."""
    g = 0.02 * size * sign(rng)
    if form == "offset":
        bus = b.nominal.inverter["dc_bus_v"]
        b.change("sensor", u_gain=0.4 * g, u_offset=0.6 * g * bus)
        return {"udc_gain": g}
    b.change("sensor", u_gain=g)
    return {"udc_gain": g}
