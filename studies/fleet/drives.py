# SPDX-License-Identifier: BSD-3-Clause
"""Fleets of one design: every drive has its own resistance, inductances and magnet flux, some a hidden fault.

The simulator is that of the own generator of the blind study, which is not the estimator's model.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from studies.blind import cases, forms, unknown
from studies.blind.build import Build, fresh
from studies.blind.generate import write_recording
from studies.blind.machines import Nominal, random_nominal
from studies.blind.plans import Plan

SPREAD = 0.05  # largest deviation of a drive from its drive file, even within it
SPEEDS = (0.1, -0.35, 0.6, -0.9)  # of the top speed
CURRENTS = ((0.0, 0.9), (0.0, -0.45), (-0.6, 0.5), (-0.3, -0.8), (0.0, 0.0))  # of the rated current: i_d, i_q
ATTEMPTS = 12
# Faults that a recording with a torque transducer and without a temperature shows, from the registry of the blind
# study: all of it but the two drifts with temperature.
DRIFTS = ("resistance_temperature", "magnet_temperature")
FAULTS = tuple(sorted(set(forms.EFFECTS) - set(DRIFTS)))
SIZES = (1.5, 3.0)  # of a typical size (registry.py), even in the logarithm
# A magnet flux that is off by a typical 5 % is within the spread: a fault is at least four times as far.
OWN_SIZES = {"magnet_flux": (4.0, 6.0)}


@dataclass(frozen=True)
class Hidden:
    """What is wrong with a drive beyond its manufacturing spread; effects: [{name, form, size, parameters}]."""

    effects: tuple = ()
    kind: str = ""


@dataclass
class FleetDrive:
    """One drive before simulation."""

    serial: str
    build: Build
    true: dict = field(default_factory=dict)
    hidden: Hidden = Hidden()


def design_of(seed: int) -> Nominal:
    """The nominal drive of a fleet."""
    return random_nominal(np.random.default_rng([seed, 4711]))


def station_plan(nominal: Nominal, rows: int) -> Plan:
    """The same operating points for every drive, as an end-of-line station runs them."""
    i_rated = nominal.machine["rated_current_a"]
    points = [(d * i_rated, q * i_rated) for d, q in CURRENTS]
    top = nominal.omega_rated
    while any(nominal.voltage(s * top, *p) > 0.75 * nominal.voltage_limit for s in SPEEDS for p in points):
        top *= 0.97
    each = rows // (len(SPEEDS) * len(points))
    return Plan([(s * top, *p, each) for s in SPEEDS for p in points])


def healthy(nominal: Nominal, seed: int, number: int, rows: int, attempt: int = 0) -> FleetDrive:
    """A drive with manufacturing spread alone."""
    rng = np.random.default_rng([seed, number, attempt])
    build = fresh(rng, nominal, station_plan(nominal, rows), True)
    r, l_d, l_q, psi = 1.0 + rng.uniform(-SPREAD, SPREAD, 4)
    m = build.drive.motor
    build.change("motor", r_a=r * m.r_a, r_b=r * m.r_b, r_c=r * m.r_c)
    build.change("motor", l_d=l_d * m.l_d, l_q=l_q * m.l_q, psi_m=psi * m.psi_m)
    m = build.drive.motor
    true = dict(resistance_ohm=m.r_a, inductance_d_h=m.l_d, inductance_q_h=m.l_q, magnet_flux_wb=m.psi_m)
    return FleetDrive(f"S{number:05d}", build, {k: float(v) for k, v in true.items()})


def with_fault(drive: FleetDrive, seed: int, number: int, name: str, attempt: int = 0) -> FleetDrive:
    """The drive with one effect of the blind study's registry beside its spread."""
    rng = np.random.default_rng([seed, number, attempt, 1])
    size = float(np.exp(rng.uniform(*np.log(OWN_SIZES.get(name, SIZES)))))
    form = str(rng.choice(forms.EFFECTS[name][1]))
    parameters = forms.apply(name, drive.build, rng, size, form)
    cases.keep_convex(drive.build)
    drive.hidden = Hidden(({"name": name, "form": form, "size": size, "parameters": parameters},))
    return drive


def with_unknown(drive: FleetDrive, seed: int, number: int, kind: str) -> FleetDrive:
    """The drive with an effect that is not in the catalogue."""
    rng = np.random.default_rng([seed, number, 2])
    unknown.KINDS[kind](drive.build, rng, float(rng.uniform(1.0, 2.0)))
    drive.hidden = Hidden(kind=kind)
    return drive


def record(drive: FleetDrive, seed: int, number: int, attempt: int = 0) -> dict:
    """Columns of one recording."""
    return drive.build.record(np.random.default_rng([seed, number, attempt, 3]))[0]


def recording_of(job) -> Path:
    """The file of a job of ``written`` or ``ageing``."""
    return job[-1] / (f"drive_{job[2]:05d}.parquet" if len(job) == 7 else f"age_{job[3]:05d}.parquet")


def written(job) -> dict:
    """Simulate and write one recording, unless it is there; {"serial", "recording", "role", "name"} of its truth.

    job: (design, seed, number, role, name, rows, folder), role: healthy, fault or unknown; name: of fault or kind.
    """
    nominal, seed, number, role, name, rows, _ = job
    path = recording_of(job)
    truth = {"serial": f"S{number:05d}", "recording": path.name, "role": role, "name": name}
    if path.exists():
        return truth
    for attempt in range(ATTEMPTS):
        drive = healthy(nominal, seed, number, rows, attempt)
        if role == "fault":
            with_fault(drive, seed, number, name, attempt)
        elif role == "unknown":
            with_unknown(drive, seed, number, name)
        try:
            columns = record(drive, seed, number, attempt)
        except ZeroDivisionError:  # the hidden flux map has no current for a flux
            continue
        if cases.sound(drive, columns):
            write_recording(path, columns, "parquet")
            return truth
    raise RuntimeError(f"drive {number} ({role} {name}): no sound drive in {ATTEMPTS} attempts")


def roles(seed: int, count: int, kind: str) -> list[tuple[str, str]]:
    """(role, name) of each drive: 3 % have a fault, 2 % the unknown effect ``kind``; at least 3 and 4."""
    rng = np.random.default_rng([seed, 99])
    faulty, strange = max(3, round(0.03 * count)), max(4, round(0.02 * count))
    names = [str(FAULTS[n]) for n in rng.permutation(len(FAULTS))]
    out = [("fault", names[n % len(names)]) for n in range(faulty)]
    out += [("unknown", kind)] * strange + [("healthy", "")] * (count - faulty - strange)
    return [out[n] for n in rng.permutation(count)]


def ageing(job) -> dict:
    """One recording of a drive that loses flux; job: (design, seed, share of the flux, number, rows, folder)."""
    nominal, seed, share, number, rows, _ = job
    path = recording_of(job)
    if not path.exists():
        drive = healthy(nominal, seed, 0, rows)
        drive.build.change("motor", psi_m=share * drive.build.drive.motor.psi_m)
        write_recording(path, record(drive, seed, 1000 + number), "parquet")
    return {"recording": path.name, "share": share}
