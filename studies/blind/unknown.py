# SPDX-License-Identifier: BSD-3-Clause
"""Effects that no catalogue entry describes; the correct answer is "unknown"."""

from __future__ import annotations

import math

import numpy as np

from studies.blind.build import Build


def inter_turn_short(b: Build, rng, size):
    """A shorted turn in phase a: a resistance across the EMF of that phase alone."""
    g = 0.08 * size * b.nominal.machine["rated_current_a"]
    b.change("motor", g_short=g / (b.nominal.omega_rated * b.nominal.machine["magnet_flux_wb"]))


def low_flux_order(b: Build, rng, size):
    """A flux harmonic of electrical order 2 or 3 in dq, as of a damaged magnet pole."""
    a = 0.02 * size * b.nominal.machine["magnet_flux_wb"]
    b.change("motor", psi_h=np.array([(rng.choice((2.0, 3.0)), a, rng.uniform(0, 6), a * 0.6, rng.uniform(0, 6))]))


def sensor_lowpass(b: Build, rng, size):
    """A low-pass in front of the current converters; at size 1 it lags 0.4 periods."""
    b.change("sensor", lowpass_s=0.4 * size * b.nominal.period_s)


def sensor_bend(b: Build, rng, size):
    """Current sensors with a quadratic error."""
    b.change("sensor", quadratic=0.04 * size / b.nominal.machine["rated_current_a"])


def angle_lag(b: Build, rng, size):
    """The angle comes from a slow tracking loop, which lags while the speed oscillates."""
    b.plan.swing = (0.15, float(rng.uniform(6.0, 12.0)))
    b.change("sensor", pll_rad_s=2.0 * math.pi * 40.0 / math.sqrt(size), omega_exact=0)


def load_unbalance(b: Build, rng, size):
    """An unbalanced load: torque once per mechanical turn."""
    b.with_torque = True
    b.change("shaft", unbalance=0.06 * size * b.nominal.torque_rated)


def leg_loss(b: Build, rng, size):
    """One leg's driver shortens the high time."""
    b.change("bridge", **{f"leg_{rng.choice(('a', 'b', 'c'))}": 0.01 * size})


def cross_talk(b: Build, rng, size):
    """Cross-talk of the two neighbouring conductors on each current sensor, which rotates the measured currents."""
    b.change("sensor", cross_talk=0.06 * size)


def bus_interference(b: Build, rng, size):
    """The bus voltage oscillates at a fixed frequency that the bus sensor does not measure."""
    a, hertz, phase = 0.02 * size * b.nominal.inverter["dc_bus_v"], rng.uniform(35.0, 90.0), rng.uniform(0, 6)

    def swing(course, x):
        t = np.arange(len(x)) * b.nominal.period_s
        course.u_hidden[:] += a * np.sin(2.0 * math.pi * hertz * t + phase)

    b.on_course.append(swing)


def encoder_interpolation(b: Build, rng, size):
    """Interpolation error of the encoder, many times per mechanical turn."""
    order = float(rng.choice((8, 16, 32)))
    while order in (6.0 * b.nominal.machine["pole_pairs"], 2.0 * b.nominal.machine["pole_pairs"]):
        order += 1.0
    b.change("sensor", ecc_n=math.radians(0.8) * size, ecc_order=order)


KINDS = {
    f.__name__: f
    for f in (
        inter_turn_short,
        low_flux_order,
        sensor_lowpass,
        sensor_bend,
        angle_lag,
        load_unbalance,
        leg_loss,
        cross_talk,
        bus_interference,
        encoder_interpolation,
    )
}
