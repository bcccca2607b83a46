# SPDX-License-Identifier: BSD-3-Clause
"""Random drives of three voltage classes for commissioning: the true one in its plant, and a file with wrong values."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

import numpy as np

from fluxproof.commission.simulated import Board, SimulatedBus
from fluxproof.cosim.driven_plant import bus_of, described_sensors
from fluxproof.plant import Inverter, Machine
from golden_model import drive as drives
from golden_model.front_ends import Encoder

# bus [V], rated current [A] from and to, PWM [Hz], dead time [s]
CLASSES = ((24.0, 3.0, 20.0, 20e3, 300e-9), (80.0, 4.0, 40.0, 16e3, 500e-9), (560.0, 3.0, 40.0, 10e3, 2e-6))
# Thresholds of switch and diode [V], part of the circle that a switch's slope takes at the rated current
DEVICES = ((0.0, 0.1, 0.004), (0.0, 0.1, 0.004), (0.9, 0.8, 0.002))
BRAKE_ON = 1.15  # of the bus: a brake resistor behind a rectifier, as the steps of torque brake
UNEVEN_RAD = 1e-3  # electrical, once and half of it twice a turn: a disc that is a little off its centre
CLOCK_HZ = 160e6
COUNTS = (None, 4000, 4096, 10000)  # a turn; None: a code of 16 bits


@dataclass(frozen=True)
class Case:
    """One motor: ``file`` is what commissioning starts from, ``true`` what it should find."""

    seed: int
    true: drives.Drive
    file: drives.Drive
    board: Board
    theta_offset_rad: float
    offset_codes: np.ndarray

    def bus(self, **changes) -> SimulatedBus:
        """A new simulated bus; ``changes`` of the Board."""
        return SimulatedBus(self.true, replace(self.board, **changes))


def case(seed: int) -> Case:
    """The same motor for the same seed; the class is seed modulo 3."""
    r = np.random.default_rng((20260, seed))
    volts, least, most, pwm, dead = CLASSES[seed % len(CLASSES)]
    circle, current = volts / math.sqrt(3.0), least * (most / least) ** r.random()
    pairs = int(r.choice([2, 3, 4, 5, 7, 10]))
    speed = min(100.0 * 4.5 ** r.random(), 2200.0 / pairs)
    omega = pairs * speed
    psi = r.uniform(0.5, 0.75) * circle / omega
    ohm = r.uniform(0.04, 0.15) * circle / current
    henry = r.uniform(0.1, 0.4) * circle / current / omega
    torque = 1.5 * pairs * psi * current
    machine = drives.Machine(
        pole_pairs=pairs,
        resistance_ohm=ohm,
        inductance_d_h=henry,
        inductance_q_h=henry * r.uniform(0.95, 1.5),
        magnet_flux_wb=psi,
        rated_current_a=current,
        rated_speed_rad_s=speed,
        inertia_kgm2=0.03 * 10.0 ** r.random() * torque / speed,
        viscous_friction_nms=r.uniform(0.0, 0.02) * torque / speed,
        coulomb_friction_nm=r.uniform(0.005, 0.04) * torque,
    )
    counts = COUNTS[int(r.integers(len(COUNTS)))]
    reverse, offset = bool(r.integers(2)), float(r.uniform(0.0, 2.0 * math.pi))  # sensed place at theta_m = 0
    sign = -1.0 if reverse else 1.0
    bits, span = int(r.choice([12, 14, 16])), float(r.uniform(1.8, 2.5)) * current
    shift = r.uniform(-0.03, 0.03, 3)
    v_switch, v_diode, slope = DEVICES[seed % len(CLASSES)]
    slope *= circle / current
    true = drives.Drive(
        machine=machine,
        inverter=drives.Inverter(
            volts, pwm, dead, 2.0 * dead, v_switch_v=v_switch, v_diode_v=v_diode, r_switch_ohm=slope, r_diode_ohm=slope
        ),
        control=drives.Control(min(500.0, pwm / 40.0), speed_bandwidth_hz=10.0, speed_filter_hz=300.0),
        sensors=drives.Sensors(bits, span, 2.0 * volts, 16),
        core=drives.Core(CLOCK_HZ),
        encoder=Encoder() if counts is None else Encoder("abz", counts),
        protection=drives.Protection(brake_on_v=BRAKE_ON * volts),
    )
    sensors = replace(
        described_sensors(true),
        current_offset_a=tuple(shift * span),
        current_noise_a=float(r.uniform(2e-4, 8e-4)) * span,
        position_offset_rad=offset,
        position_direction=-1 if reverse else 1,
        eccentricity_once_rad=UNEVEN_RAD / pairs,
        eccentricity_twice_rad=0.5 * UNEVEN_RAD / pairs,
        eccentricity_twice_phase_rad=1.0,
        seed=seed,
    )
    board = Board(
        Machine.from_mapping(asdict(machine)),
        Inverter(0.0, v_switch, v_diode, slope, slope),
        dead,
        sensors,
        bus=bus_of(true),
        theta_m=float(r.uniform(0.0, 6.28)),
        seed=seed,
    )
    of_l = 4.0 ** r.uniform(-0.5, 0.5)
    wrong = replace(
        machine,
        resistance_ohm=ohm * 4.0 ** r.uniform(-0.5, 0.5),
        inductance_d_h=machine.inductance_d_h * of_l,
        inductance_q_h=machine.inductance_q_h * of_l,
        magnet_flux_wb=psi * r.uniform(0.7, 1.3),
        inertia_kgm2=machine.inertia_kgm2 * 9.0 ** r.uniform(-0.5, 0.5),
        viscous_friction_nms=0.0,
        coulomb_friction_nm=0.0,
    )
    codes = 2.0 ** (bits - 1) * (1.0 + shift)
    return Case(seed, true, replace(true, machine=wrong), board, (-sign * pairs * offset) % (2.0 * math.pi), codes)
