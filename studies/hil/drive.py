# SPDX-License-Identifier: BSD-3-Clause
"""The drive and the ride of the study: a servo of 170 W with every effect that the motor has, 2 us of dead time."""

from __future__ import annotations

import math

import numpy as np

from fluxproof.hil.registers import motor_scale
from fluxproof.plant.inverter import Inverter
from fluxproof.plant.pmsm import Harmonic, Machine
from studies.hil.beside_plant import Control, Drive, Ride

# The Teknic motor of docs/drives/servo_24v.toml; a salient, saturating rotor, harmonics and cogging are assumed
SERVO = Machine(
    pole_pairs=4,
    resistance_ohm=0.39,
    inductance_d_h=0.2e-3,
    inductance_q_h=0.27e-3,
    magnet_flux_wb=6.3e-3,
    inertia_kgm2=2.5e-5,
    viscous_friction_nms=1e-5,
    coulomb_friction_nm=5e-3,
    saturation_d_per_a2=2e-4,
    saturation_q_per_a2=4e-4,
    cross_saturation_wb_per_a2=2e-7,
    phase_resistance_asymmetry=(0.0, 0.02, -0.01),
    emf_harmonics=(Harmonic(6, 0.02, 0.015, 0.3),),
    cogging_amplitude_nm=4e-3,
    cogging_order=24,
)
SWITCHES = Inverter(dead_time_s=2e-6, v_switch_v=0.1, v_diode_v=0.7, r_switch_ohm=4e-3, r_diode_ohm=4e-3)
U_DC_V, CURRENT_A, CLOCK_HZ = 24.0, 16.5, 200e6
RATED_A = 7.0
RATED_NM = 1.5 * SERVO.pole_pairs * SERVO.magnet_flux_wb * RATED_A
PERIOD_S = 50e-6
RAMP_RAD_S2 = 2500.0
# Share of the ride from which a speed or a load holds: two reversals, loads that drive and brake
SPEEDS_RAD_S = ((0.0, 150.0), (0.25, -200.0), (0.5, 60.0), (0.75, -120.0))
LOADS_NM = ((0.0, 0.0), (0.1, 0.2), (0.2, -0.1), (0.35, 0.25), (0.45, -0.2), (0.6, 0.0), (0.7, 0.15))


def servo() -> Drive:
    """The drive, with a PWM period of whole steps."""
    scale = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ)
    period_s = round(PERIOD_S / scale.step_s) * scale.step_s
    pull = 2 * math.pi * 1000  # bandwidth of the currents
    control = Control(
        current_p=pull * SERVO.inductance_d_h,
        current_i=pull * SERVO.resistance_ohm * period_s,
        speed_p=0.05,
        speed_i=0.05 * 30 * period_s,
        angle_p=10.0,
        limit_a=9.0,
        u_dc=U_DC_V,
        pole_pairs=float(SERVO.pole_pairs),
        l_d=SERVO.inductance_d_h,
        l_q=SERVO.inductance_q_h,
        psi_m=SERVO.magnet_flux_wb,
    )
    return Drive(scale, SERVO, SWITCHES, control, period_s)


def held_values(steps, share: np.ndarray) -> np.ndarray:
    """The value of the last step that has begun, at each share of the ride."""
    begins, values = np.array(steps).T
    return values[np.searchsorted(begins, share, side="right") - 1]


def ride(drive: Drive, seconds: float) -> Ride:
    """Speeds along ramps, the angle that belongs to them, loads in steps."""
    periods = round(seconds / drive.period_s)
    share = np.arange(periods) / periods
    wanted, speed, most = held_values(SPEEDS_RAD_S, share), np.zeros(periods), RAMP_RAD_S2 * drive.period_s
    for k in range(1, periods):
        speed[k] = speed[k - 1] + np.clip(wanted[k] - speed[k - 1], -most, most)
    return Ride(speed, np.cumsum(speed) * drive.period_s, held_values(LOADS_NM, share))
