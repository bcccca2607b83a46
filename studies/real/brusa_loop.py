# SPDX-License-Identifier: BSD-3-Clause
"""The measured Brusa map in closed loop: the golden model uses a linear nameplate, the switching plant the map.

The load machine imposes the speed, the core regulates dq currents over a grid; its inputs and outputs become a
canonical recording in SI units.  Leg voltages follow the compare values through the plant's dead time.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.scenarios import RPM
from fluxproof.diagnosis.ground.recording import Recording, from_columns
from fluxproof.plant import IMPOSED_SPEED, FluxMap, Machine
from golden_model import drive as drives
from golden_model.registers import registers
from golden_model.units import from_si, si_per_lsb

LINEAR_CURRENT_MODEL = 0  # register flux_mode: the decoupling uses the nameplate
RAMP_S = 0.02  # from one operating point to the next; a step would saturate the voltage
SETTLE_S = 0.02


@dataclass(frozen=True)
class Course:
    """Consecutive operating points at one speed: rpm, (n,) i_d and i_q [A], seconds of each."""

    rpm: float
    i_d: np.ndarray
    i_q: np.ndarray
    dwell_s: float


def measured_map(file: Path) -> FluxMap:
    """The map of brusa_meas.csv, corrected where noise makes it non-monotonic (see FluxMap.mended)."""
    table = np.genfromtxt(file, delimiter=",", names=True)
    return FluxMap.from_points(table["id_A"], table["iq_A"], table["psid_Vs"], table["psiq_Vs"]).mended()


def serpentine(levels_d, levels_q) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of the levels in small steps: (i_d, i_q), both (n_d * n_q,)."""
    i_q = np.concatenate([levels_q[:: 1 if k % 2 == 0 else -1] for k in range(len(levels_d))])
    return np.repeat(levels_d, len(levels_q)), i_q


def references(course: Course, sample_time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Current references (n,) [A]: ramps between the points, then the dwells."""
    ramp, hold = round(RAMP_S / sample_time_s), round((SETTLE_S + course.dwell_s) / sample_time_s)
    rise = np.concatenate([np.linspace(0.0, 1.0, ramp, endpoint=False), np.ones(hold)])
    out = []
    for levels in (course.i_d, course.i_q):
        before = np.concatenate([[0.0], levels[:-1]])
        out.append((before[:, None] + (levels - before)[:, None] * rise).ravel())
    return out[0], out[1]


def record(drive_file, flux_map: FluxMap, course: Course, dead_time_s=0.0) -> Recording:
    """Run a course in closed loop; the core's currents, angle, bus voltage and duties as a Recording."""
    drive = drives.load(drive_file)
    machine = Machine.from_mapping({**vars(drive.machine), "flux_map": flux_map})
    i_d, i_q = references(course, drive.sample_time_s)
    n, ones = len(i_d), np.ones(len(i_d), np.int64)
    codes = lambda name, values: np.round(values / si_per_lsb(name, drive)).astype(np.int64)  # noqa: E731
    scene = Scenario(
        omega_ref=0 * ones,
        load=np.full(n, course.rpm * RPM),
        u_dc=np.full(n, drive.inverter.dc_bus_v),
        i_d_ref=codes("i_d_ref", i_d),
        i_q_ext=codes("i_q_ext", i_q),
        speed_mode=0 * ones,
        enable=ones,
        omega_m=course.rpm * RPM,
    )
    plain = registers(drive)
    changes = {"compensate": int(dead_time_s > 0.0), "eta_v": 0, "flux_mode": LINEAR_CURRENT_MODEL}
    changes["i_max"] = from_si("i_q_ref", 1.5 * drive.machine.rated_current_a, drive)
    plain = plain._replace(values=plain.values._replace(**changes))
    seen = simulate(drive, plain, scene, machine, dead_time_s=dead_time_s, mode=IMPOSED_SPEED).observed
    columns = {"t": np.arange(n) * drive.sample_time_s}
    names = {"i_d": "i_d", "i_q": "i_q", "theta_e": "theta_me", "omega_e": "omega_me", "u_dc": "u_dc"}
    columns |= {name: seen[signal] * si_per_lsb(signal, drive) for name, signal in names.items()}
    columns |= {f"d_{x}": seen[f"compare_{x}"] / plain.config.carrier_half for x in "abc"}
    columns |= {"i_d_ref": i_d, "i_q_ref": i_q}
    return from_columns(columns, drive.sample_time_s, f"brusa map at {course.rpm:g} rpm")
