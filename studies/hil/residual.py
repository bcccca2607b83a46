# SPDX-License-Identifier: BSD-3-Clause
"""The residual beside the motor: healthy drives at random speeds and currents, and single faults in steady running.

The plant switches with dead time and device drops; its sensors have noise.  The core has the registers of the drive
file.  A healthy motor has R, L_d, L_q and magnets 1 to 2 % off, and sensors 0.1 % apart.  A fault is there from the
first sample, and so is steady running, or it comes while the drive runs: time counts from the fault.  Shorted turns
have no resistance but their own and the leakage of their whole inductance, which the current of a real short exceeds.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.closed_loop import Result
from fluxproof.cosim.driven_plant import Scenario, described_sensors
from fluxproof.cosim.golden_loop import simulate
from fluxproof.plant import IMPOSED_SPEED, Machine
from fluxproof.plant.sensors import Sensors
from fluxproof.simulate.run import inverter_of, machine_of
from golden_model.drive import Drive, load
from golden_model.estimators.motor_residual import DROP_I, DROP_OMEGA, LEAST
from golden_model.formats import TURN
from golden_model.front_ends import Converters, Encoder
from golden_model.registers import registers
from golden_model.units import from_si, si_per_lsb
from studies.hil.figure import least, most

NAMES = ("paper001", "servo_24v", "spindle_400v", "emrax228", "hub_36v")
NOISE = 0.001  # of the rated current
WRONG, APART = (0.01, 0.02), 0.001  # parameters of a healthy motor; gains of its sensors
TARGET_S, STEADY_S = 0.05, 0.08
SEGMENT = 20_000  # samples with the same motor
SPEEDS, CHANGES = (-0.8, 0.8), 25  # of the rated speed; of speed and current in a segment
SEED = 53
SLIP_AT_S = 0.1  # of steady running before an encoder slips
SLOWEST_S = 15e-6  # a time constant that the plant's step follows
SHARES = (0.01, 0.02, 0.03, 0.05, 0.1)  # of a phase's turns


def drive_of(name: str) -> Drive:
    """The drive file with a residual; codes come from ideal front ends."""
    drive = load(DRIVES / f"{name}.toml")
    core = dataclasses.replace(drive.core, residual=True)
    return dataclasses.replace(drive, core=core, encoder=Encoder(), converters=Converters())


def play(drive: Drive, machine: Machine, sensors: Sensors, speed: np.ndarray, i_q: np.ndarray, changes=None) -> Result:
    """A driven shaft with this speed [rad/s] and these currents [A] asked for, a value a sample.

    ``changes``: as in Scenario.
    """
    n, volts = len(speed), drive.inverter.dc_bus_v
    asked = np.array([from_si("i_q_ext", i, drive) for i in i_q], np.int64)
    nothing = np.zeros(n, np.int64)
    scenario = Scenario(
        omega_ref=nothing, load=speed, u_dc=np.full(n, volts), i_d_ref=nothing, i_q_ext=asked, speed_mode=nothing,
        enable=np.ones(n, np.int64), omega_m=float(speed[0]), changes=changes or {},
    )  # fmt: skip
    return simulate(
        drive, registers(drive), scenario, machine, sensors, drive.inverter.dead_time_s, IMPOSED_SPEED,
        inverter=inverter_of(drive),
    )  # fmt: skip


def noisy(drive: Drive, seed: int, **changes) -> Sensors:
    """The described sensors with noise and these errors."""
    noise = NOISE * drive.machine.rated_current_a
    return dataclasses.replace(described_sensors(drive), current_noise_a=noise, seed=seed, **changes)


def healthy(drive: Drive, segment: int) -> Result:
    """A segment of a healthy drive: speed in ramps, currents in steps, both drawn."""
    rng = np.random.default_rng((SEED, segment))
    described = machine_of(drive, imposed=True)
    names = ("resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb")
    off = {n: getattr(described, n) * (1.0 + rng.uniform(*WRONG) * rng.choice((-1, 1))) for n in names}
    at = np.linspace(0, SEGMENT, CHANGES)
    speed = np.interp(np.arange(SEGMENT), at, rng.uniform(*SPEEDS, CHANGES)) * drive.machine.rated_speed_rad_s
    amperes = rng.uniform(-1.0, 1.0, CHANGES) * drive.machine.rated_current_a
    i_q = np.repeat(amperes, -(-SEGMENT // CHANGES))[:SEGMENT]
    sensors = noisy(drive, segment, current_gain_error=tuple(rng.uniform(-APART, APART, 3)))
    return play(drive, dataclasses.replace(described, **off), sensors, speed, i_q)


class Fault(NamedTuple):
    """What is wrong, and where: shares of the rated current and speed, which is at least what is watched."""

    name: str
    speed: float
    current: float
    machine: Callable[[Machine], dict] = lambda _m: {}
    sensors: Callable[[Drive], dict] = lambda _d: {}
    slip_deg: float = 0.0  # electrical, by which the encoder slips at SLIP_AT_S


def shorted(machine: Machine, share: float) -> dict:
    """Keys of the plant for a share of the turns of phase b, shorted; its time constant is SLOWEST_S at least."""
    leakage = max(share**2 * machine.inductance_d_h, SLOWEST_S * share * machine.resistance_ohm)
    return {"shorted_share": share, "shorted_phase": 1, "shorted_leakage_h": leakage}


FAULTS = (
    Fault("magnets 5 % weaker", 0.8, 0.3, machine=lambda m: {"magnet_flux_wb": 0.95 * m.magnet_flux_wb}),
    Fault("R 30 % higher", 0.0, 1.0, machine=lambda m: {"resistance_ohm": 1.3 * m.resistance_ohm}),
    Fault("a sensor 2 % high", 0.3, 1.0, sensors=lambda _d: {"current_gain_error": (0.02, 0.0, 0.0)}),
    Fault(
        "a sensor's zero off by 0.5 % of rated", 0.3, 0.3,
        sensors=lambda d: {"current_offset_a": (0.005 * d.machine.rated_current_a, 0.0, 0.0)},
    ),
    Fault(
        "encoder slipped by 10 electrical degrees", 0.3, 0.3,
        sensors=lambda d: {"position_offset_rad": math.radians(10) / d.machine.pole_pairs},
    ),
    Fault("encoder that slips by 10 electrical degrees while it runs", 0.3, 0.3, slip_deg=10.0),
    Fault("5 % of the turns of a phase shorted", 0.8, 0.3, machine=lambda m: shorted(m, 0.05)),
)  # fmt: skip


def steady(drive: Drive, fault: Fault) -> tuple[Result, int]:
    """(Steady running, its sample from which the fault is there)."""
    at = round(SLIP_AT_S / drive.sample_time_s) if fault.slip_deg else 0
    described, n = machine_of(drive, imposed=True), at + round(STEADY_S / drive.sample_time_s)
    machine = dataclasses.replace(described, **fault.machine(described))
    omega, amperes = operating_point(drive, fault)
    speed, i_q = np.full(n, omega / drive.machine.pole_pairs), np.full(n, amperes)
    offset = registers(drive).values.theta_offset + round(fault.slip_deg / 360.0 / TURN.lsb)
    changes = {at: {"theta_offset": offset % (1 << TURN.width)}} if at else {}
    return play(drive, machine, noisy(drive, SEED, **fault.sensors(drive)), speed, i_q, changes), at


def until_flag(drive: Drive, fault: Fault) -> float:
    """Time from the fault to the flag [s]; infinite without one, negative where it came before the fault."""
    result, at = steady(drive, fault)
    flagged = np.flatnonzero(result.observed["motor_differs"])
    return (flagged[0] - at) * drive.sample_time_s if len(flagged) else math.inf


def least_short(drive: Drive) -> float:
    """The smallest of SHARES, shorted at the operating point of the last fault, that is flagged within TARGET_S."""
    for share in SHARES:
        fault = FAULTS[-1]._replace(machine=lambda m, share=share: shorted(m, share))
        if until_flag(drive, fault) <= TARGET_S:
            return share
    return math.inf


class Least(NamedTuple):
    """Smallest changes that the limits let through no longer, as shares of magnet flux and R."""

    magnets: float
    resistance: float


def limit_v(drive: Drive, omega: float, amperes: float) -> float:
    """Voltage that the mean residual may have at this electrical speed and current, from the registers."""
    regs = registers(drive).values
    speed, current = round(omega / si_per_lsb("omega_me", drive)), round(amperes / si_per_lsb("i_q", drive))
    parts = regs.residual_min + (speed * regs.residual_w >> DROP_OMEGA) + (current * regs.residual_i >> DROP_I)
    return parts * 2.0**-LEAST.frac_bits * drive.bases.flux_wb / drive.sample_time_s


def operating_point(drive: Drive, fault: Fault) -> tuple[float, float]:
    """Electrical speed, at least what is watched, and current of a fault."""
    slow = registers(drive).values.residual_slow * si_per_lsb("omega_me", drive)
    m = drive.machine
    return max(fault.speed * m.rated_speed_rad_s * m.pole_pairs, 1.15 * slow), fault.current * m.rated_current_a


def least_flagged(drive: Drive) -> Least:
    """From the limit, at the operating points of FAULTS: magnets change the mean by delta psi omega, R by delta R i."""
    (omega, amperes), (slow, rated) = (operating_point(drive, fault) for fault in FAULTS[:2])
    m = drive.machine
    magnets = limit_v(drive, omega, amperes) / (omega * m.magnet_flux_wb)
    return Least(magnets, limit_v(drive, slow, rated) / (m.resistance_ohm * rated))


def figures(options) -> list[dict]:
    """No flag of a healthy drive; each fault of each drive within its time."""
    drives = [drive_of(name) for name in NAMES]
    segments, flags = max(round(options.samples / SEGMENT), 1), 0
    for k in range(segments):
        flags += int(np.count_nonzero(healthy(drives[k % len(drives)], k).observed["motor_differs"]))
    rows = [
        most("residual: samples with a flag of healthy drives", flags, 0, "samples"),
        least("residual: samples of healthy drives", segments * SEGMENT, 1_000_000, "samples"),
    ]
    for fault in FAULTS:
        times = [until_flag(drive, fault) for drive in drives]
        late = max(times) if min(times) >= 0.0 else math.inf
        rows.append(most(f"residual: {fault.name}, flag of the last of {len(times)} drives", late, TARGET_S, "s"))
    shares = [100.0 * least_short(drive) for drive in drives]
    print(f"smallest share of the turns that is flagged, of {SHARES}: {dict(zip(NAMES, shares, strict=True))}")
    return rows
