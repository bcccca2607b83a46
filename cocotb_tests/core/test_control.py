# SPDX-License-Identifier: BSD-3-Clause
"""The golden drive as a controller: recovery from long saturation, both directions, over the averaged plant."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.cosim.golden_loop import run_averaged
from fluxproof.cosim.scenarios import RPM
from fluxproof.plant import FREE, IMPOSED_SPEED, Machine, Sensors, initial_state, plant_params, sensor_params
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.estimators import flux_models
from golden_model.registers import registers
from golden_model.units import from_si

DRIVE = drives.load(PAPER)
T_S = DRIVE.sample_time_s


def sag(start: float, stop: float, low: float):
    """Bus voltage: nominal, ``low`` between start and stop [s], back on a ramp of 20 ms.

    A real bus has a capacitor.  Were it to jump within a sample, duties computed for the low bus would act on
    the high one for a period: a kick of the plant that no regulator can prevent and that is no wind-up.
    """
    nominal = DRIVE.inverter.dc_bus_v

    def course(t):
        back = np.clip((t - stop) / 0.02, 0.0, 1.0)
        return np.where(t < start, nominal, low + (nominal - low) * back)

    return course


def simulate_drive(seconds, rpm, u_dc=None, load=None, omega_m=0.0, i_q=None, changes=None, mode=FREE, start=None):
    """Columns i_d, i_q, lambda_d, lambda_q, omega_m, torque, u_alpha, u_beta; rpm and others are f(t) arrays."""
    n = round(seconds / T_S)
    time = np.arange(n) * T_S
    values = registers(DRIVE)
    references = np.zeros((n, 4), np.int64)
    references[:, 0] = [from_si("omega_ref", w * RPM * DRIVE.machine.pole_pairs, DRIVE) for w in rpm(time)]
    references[:, 3] = 1
    if i_q is not None:
        references[:, 2] = [from_si("i_q_ext", i, DRIVE) for i in i_q(time)]
        references[:, 3] = 0
    bus = np.full(n, 563.0) if u_dc is None else u_dc(time)
    torque = np.zeros(n) if load is None else load(time)
    machine = Machine.from_mapping(vars(DRIVE.machine))
    params = plant_params(machine, mode=mode)
    sensors = sensor_params(
        Sensors(current_bits=16, current_full_scale_a=12.5, u_dc_bits=16, u_dc_full_scale_v=1000, position_bits=16)
    )
    out = np.zeros((n, 8))
    registers_used = values.values._replace(**(changes or {}))
    run_averaged(
        fluxproof.State(), references, bus, torque, registers_used, values.config,
        initial_state(machine, params, omega_m=omega_m, **(start or {})), params, sensors, T_S, out,
    )  # fmt: skip
    return time, out


@pytest.mark.parametrize("sign", [1, -1])
def test_speed_recovers_from_seconds_of_saturation(sign):
    """Three seconds with a bus too low for the speed reference; then no more overshoot than after a speed step."""
    target = 1500.0
    time, out = simulate_drive(5.0, lambda t: np.full_like(t, sign * target), u_dc=sag(0.5, 3.5, 90.0))
    speed = sign * out[:, 4] / RPM
    stuck = speed[(time > 3.0) & (time < 3.45)].mean()
    assert stuck < 0.9 * target, "the bus was not low enough to saturate"
    after = speed[time > 3.5].max() - target
    _, plain = simulate_drive(1.5, lambda t: np.full_like(t, sign * target), omega_m=sign * stuck * RPM)
    unsaturated = (sign * plain[:, 4] / RPM).max() - target
    assert after <= unsaturated + 0.02 * target, f"overshoot {after:.1f} rpm, without saturation {unsaturated:.1f} rpm"


@pytest.mark.parametrize("sign", [1, -1])
def test_current_recovers_from_seconds_of_saturation(sign):
    """The q current regulator with a bus too low for two seconds, in torque mode; then the response of a step."""
    hold = lambda t: np.full_like(t, 0.0)  # noqa: E731
    time, out = simulate_drive(
        2.6,
        hold,
        u_dc=sag(0.3, 2.3, 40.0),
        i_q=lambda t: np.full_like(t, sign * 3.0),
        load=lambda t: np.full_like(t, sign * 2.0),
    )
    i_q = sign * out[:, 1]
    assert i_q[(time > 2.0) & (time < 2.29)].max() < 2.7, "the bus was not low enough to saturate"
    overshoot = i_q[time > 2.3].max() - 3.0
    _, plain = simulate_drive(
        0.3, hold, i_q=lambda t: np.full_like(t, sign * 3.0), load=lambda t: np.full_like(t, sign * 2.0)
    )
    unsaturated = (sign * plain[:, 1]).max() - 3.0
    assert overshoot <= max(unsaturated, 0.0) + 0.03 * 3.0, (overshoot, unsaturated)


@pytest.mark.parametrize("sign", [1, -1])
def test_delay_compensation_in_both_directions(sign):
    """At speed the applied voltage points where it should: without the advance the d current error is far larger.

    With the decoupling of the nameplate: the flux estimator would take a wrong angle for a wrong flux and cure half.
    """

    def settle(changes):
        changes = {"flux_mode": flux_models.CURRENT_MODEL, **changes}
        _, out = simulate_drive(
            0.6, lambda t: np.full_like(t, sign * 2500.0), omega_m=sign * 2500 * RPM, changes=changes
        )
        return np.abs(out[50:400, 0]).max()

    assert settle({}) < 0.35 * settle({"k_delay": 0})


def test_duties_at_standstill_are_exactly_one_half():
    """Zero reference, zero speed: all duties are exactly one half in every period."""
    values = registers(DRIVE)
    state, mid = fluxproof.State(), 1 << 15
    u_dc = round(563 / 1000 * 65536)
    for _ in range(50):
        sample = fluxproof.Sample(mid, mid, mid, u_dc, 12345, 0, 0, 0, 1, 0, 0, 0, 1)
        state, out = fluxproof.step(state, sample, values.values, values.config)
        assert (out.duty_a, out.duty_b, out.duty_c) == (32768, 32768, 32768)
        assert out.omega_me == 0


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("i_q_ref", [3.0, -3.0])
@pytest.mark.parametrize("omega_e", [1500.0, 1800.0, 1850.0])
def test_no_second_stable_point_at_high_speed(omega_e, i_q_ref, sign):
    """Disturbed to minus ten ampere in both axes near the speed limit: the drive recovers and stays stable.

    With d first and no room for the EMF it would stay at i_q = -11 A for ever (see control/voltage_limit.py);
    braking, it would not even need the kick.
    """
    speed = sign * omega_e / DRIVE.machine.pole_pairs
    kick = {"i_d": -10.0, "i_q": -sign * 9.0}

    def run(start=None):
        return simulate_drive(
            0.4,
            np.zeros_like,
            i_q=lambda t: np.full_like(t, sign * i_q_ref),
            load=lambda t: np.full_like(t, speed),
            omega_m=speed,
            mode=IMPOSED_SPEED,
            start=start,
        )[1][-1000:]

    calm, kicked = run(), run(kick)
    for out in (calm, kicked):
        assert out[:, 0].mean() == pytest.approx(0.0, abs=0.1)
        assert out[:, 1].mean() == pytest.approx(sign * i_q_ref, abs=0.1)


@pytest.mark.parametrize("sign", [1, -1])
def test_above_the_voltage_limit_the_current_stays_within_the_rated(sign):
    """EMF 12 % above the circle, no field weakening: the references are not reached, but the current stays bounded."""
    speed = sign * 2200.0 / DRIVE.machine.pole_pairs
    _, out = simulate_drive(
        0.4,
        np.zeros_like,
        i_q=lambda t: np.full_like(t, sign * 3.0),
        load=lambda t: np.full_like(t, speed),
        omega_m=speed,
        mode=IMPOSED_SPEED,
    )
    assert np.hypot(out[-1000:, 0], out[-1000:, 1]).max() < 5.23


@pytest.mark.parametrize(("min_pulse", "swing"), [(600, 1.8), (2, 0.02)])
def test_minimum_pulse_close_to_the_voltage_limit(min_pulse, swing):
    """At 1900 rad/s, 97 % of the limit: i_q swings only because short low ends are closed; it stays bounded."""
    _, out = simulate_drive(
        1.0,
        np.zeros_like,
        i_q=lambda t: np.full_like(t, 3.0),
        load=lambda t: np.full_like(t, 475.0),
        omega_m=475.0,
        mode=IMPOSED_SPEED,
        changes={"min_pulse": min_pulse},
    )
    i_q = out[-2000:, 1]
    assert i_q.std() < swing
    assert np.hypot(out[-2000:, 0], i_q).max() < 5.23
