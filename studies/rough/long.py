# SPDX-License-Identifier: BSD-3-Clause
"""Healthy drives with rough sensors for as long as one likes: whether anything trips that should not.

python -m studies.rough.long [SAMPLES]      of each drive file; a line a drive, status 1 where something tripped

Sample by sample (golden core, switching plant with dead time, drops and the supply of the file); speeds and loads are
drawn.  The motor is not quite the described one, the sensors have gains, zeros, noise, a disc off its centre.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.driven_plant import Scenario, bus_of, described_sensors
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.sensor_edges import edges_of
from fluxproof.plant.sensors import Sensors
from fluxproof.simulate.run import inverter_of, machine_of
from golden_model.board_registers import core_changes
from golden_model.drive import Drive, load
from golden_model.io import fault_latch
from golden_model.registers import registers
from golden_model.units import from_si

NAMES = ("brusa_hsm1", "drone_24v", "emrax228", "hub_36v", "paper000", "paper001", "servo_24v", "spindle_400v")
SEED, SEGMENT = 49, 20_000  # samples with the same motor and sensors
MOTOR = {"resistance_ohm": 0.2, "inductance_d_h": 0.1, "inductance_q_h": 0.1, "magnet_flux_wb": 0.03}  # largest errors
GAIN, ZERO, NOISE = 0.005, 0.002, 0.002  # of a current sensor; the last two of the rated current
BUS_NOISE, OFF_CENTRE_RAD = 0.002, 0.01  # of the bus; of the disc, electrical, and half of it twice a turn
SPEED, LOAD, CHANGES = 0.8, 0.3, 12  # largest parts of rated speed and torque; changes of both in a segment
STARTS = 200  # samples with the gates off


def rough_sensors(drive: Drive, seed: int) -> Sensors:
    """The described sensors as a board has them."""
    rng, pairs, current = (
        np.random.default_rng((SEED, seed, 1)),
        drive.machine.pole_pairs,
        drive.machine.rated_current_a,
    )
    return replace(
        described_sensors(drive),
        current_gain_error=tuple(rng.uniform(-GAIN, GAIN, 3)),
        current_offset_a=tuple(rng.uniform(-ZERO, ZERO, 3) * current),
        current_noise_a=NOISE * current,
        u_dc_noise_v=BUS_NOISE * drive.inverter.dc_bus_v,
        eccentricity_once_rad=OFF_CENTRE_RAD / pairs,
        eccentricity_once_phase_rad=rng.uniform(0.0, 6.28),
        eccentricity_twice_rad=OFF_CENTRE_RAD / 2.0 / pairs,
        eccentricity_twice_phase_rad=rng.uniform(0.0, 6.28),
        seed=seed,
    )


def segment(drive: Drive, seed: int) -> tuple[int, dict[str, int], float]:
    """(samples with the gates on until a trip, {fault: 1}, part of the rated speed at the trip) of one motor."""
    rng = np.random.default_rng((SEED, seed))
    machine = machine_of(drive, imposed=True)
    machine = replace(machine, **{n: getattr(machine, n) * (1.0 + rng.uniform(-e, e)) for n, e in MOTOR.items()})
    m, pieces = drive.machine, np.sort(rng.integers(STARTS, SEGMENT, CHANGES))
    held = np.searchsorted(pieces, np.arange(SEGMENT), side="right")
    asked = rng.uniform(-SPEED, SPEED, CHANGES + 1) * rng.integers(0, 4, CHANGES + 1).clip(0, 1)
    torque = rng.uniform(0.0, LOAD, CHANGES + 1) * 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a
    speeds = [from_si("omega_ref", part * m.rated_speed_rad_s * m.pole_pairs, drive) for part in asked]
    nothing, n = np.zeros(SEGMENT, np.int64), np.arange(SEGMENT)
    scenario = Scenario(
        omega_ref=np.array(speeds, np.int64)[held], load=np.zeros(SEGMENT), brake=torque[held],
        u_dc=np.full(SEGMENT, drive.inverter.dc_bus_v), i_d_ref=nothing, i_q_ext=nothing, speed_mode=nothing + 1,
        enable=(n >= STARTS).astype(np.int64), theta_m=rng.uniform(0.0, 6.28),
    )  # fmt: skip
    given, edges = registers(drive), None
    if drive.encoder.kind == "hall":
        given, edges = given._replace(values=given.values._replace(**core_changes(drive))), edges_of(drive)
    seen = simulate(
        drive, given, scenario, machine, rough_sensors(drive, seed), drive.inverter.dead_time_s,
        inverter=inverter_of(drive), bus=bus_of(drive), edges=edges,
    )  # fmt: skip
    causes = fault_latch.of_sample(seen.observed) & ~given.values.fault_ignore & fault_latch.TRIPPING
    trips = np.flatnonzero(causes * scenario.enable)
    if not len(trips):
        return SEGMENT - STARTS, {}, 0.0
    at = int(trips[0])
    named = {name: 1 for k, name in enumerate(fault_latch.NAMES) if int(causes[at]) >> k & 1}
    return at - STARTS, named, float(seen.plant["omega_m"][at]) / m.rated_speed_rad_s


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m studies.rough.long", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("samples", type=int, nargs="?", default=1_250_000, help="of each drive")
    parser.add_argument("--only", default="", help="drives whose name contains this text")
    parser.add_argument("--first", type=int, default=0, help="number of the first motor")
    given, told, total = parser.parse_args(), 0, 0
    for name in (n for n in NAMES if given.only in n):
        drive, samples, seed = load(DRIVES / f"{name}.toml"), 0, given.first
        while samples < given.samples:
            ran, named, part = segment(drive, seed)
            if named:
                told += 1
                print(f"{name}, motor {seed}: {', '.join(named)} after {ran} samples at {part:.2f} rated", flush=True)
            samples, seed = samples + max(ran, 1), seed + 1
        total += samples
        print(f"{name}: {samples} samples, {seed - given.first} motors", flush=True)
    print(f"{total} samples, {told} trips")
    return 1 if told else 0


if __name__ == "__main__":
    sys.exit(main())
