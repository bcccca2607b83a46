"""Fleets of one design: every drive has its own resistance, inductances and magnet flux, some a hidden fault.

The simulator is that of the own generator of the blind study, which is not the estimator's model.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from studies.blind import cases, forms, unknown
from studies.blind.build import Build, fresh
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
