# SPDX-License-Identifier: BSD-3-Clause
"""Current references as others make them, in the golden core's loop on the same plants.

``python -m studies.speed.others [METHOD ...]``.

All know the nameplate, one inductance an axis.  Each is asked for i_d and i_q [A] sample by sample; current regulators,
decoupling, voltage circle, dead time and measurement are those of the project's own figures.

* duty feedback: MTPA, and a weakening current that grows with the voltage over 90 % of the circle, in the manner of
  vedderb/bldc (``foc_run_fw``), ramped over 50 ms;
* Newton: MTPA, and where its flux linkage is beyond u_max/omega the point of torque and flux limit by Newton's method,
  or the largest torque within both limits, in the manner of FluxWeaken.c of Infineon's motor-ctrl-lib;
* motulator: its CurrentReference as it is, fed with the unlimited voltage.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from types import SimpleNamespace
from typing import Protocol

import numpy as np

from fluxproof.checkout import BUILD
from fluxproof.cosim.driven_plant import described_sensors
from fluxproof.cosim.golden_loop import IDEAL, PLANT, Bench, Stimulus, run_switching
from fluxproof.cosim.sensor_edges import no_edges
from fluxproof.files import write_json
from fluxproof.plant import IMPOSED_SPEED, Inverter, initial_state, plant_params, sensor_params
from golden_model import fluxproof
from golden_model.registers import registers
from golden_model.torque_table import Plane
from golden_model.units import from_si, to_si
from studies.speed import figures

SPEEDS, TORQUES, SECONDS = (1.2, 1.5, 2.0, 3.0), (0.25, 0.5, 0.75, 0.98), 0.25
VOLTAGE = 0.98  # of the circle, as the core's voltage_target
FW_START, FW_RAMP_S = 0.9, 0.05


@dataclasses.dataclass
class Seen:
    """What a reference generator knows of a sample."""

    omega: float  # electrical, rad/s
    u_max: float  # radius of the circle, V
    u: float  # of the last sample, V, before the circle's limit


class Method(Protocol):
    """A reference generator."""

    def currents(self, torque: float, seen: Seen) -> tuple[float, float]:
        """(i_d, i_q) [A] for a torque [Nm]."""
        ...


def mtpa(machine, torque: float, i_max: float) -> tuple[float, float]:
    """The point of least current with constant inductances: i_d from i_q, i_q by bisection over the torque."""
    psi, delta = machine.magnet_flux_wb, machine.inductance_d_h - machine.inductance_q_h
    low, high, wanted = 0.0, i_max, abs(torque) / (1.5 * machine.pole_pairs)

    def i_d(i_q):
        if abs(delta) < 1e-9:
            return 0.0
        root = math.sqrt(psi * psi + 4.0 * delta * delta * i_q * i_q)
        return (-psi + root) / (2.0 * delta)

    for _ in range(40):
        i_q = 0.5 * (low + high)
        low, high = (i_q, high) if (psi + delta * i_d(i_q)) * i_q < wanted else (low, i_q)
    size = math.hypot(i_d(low), low)
    part = min(1.0, i_max / size) if size else 1.0
    return part * i_d(low), math.copysign(part * low, torque)


class DutyFeedback:
    """MTPA and a weakening current by the voltage that is used."""

    def __init__(self, case):
        self.machine, self.i_max = case.drive.machine, case.drive.current_limit_a
        self.step, self.weakening = self.i_max * case.drive.sample_time_s / FW_RAMP_S, 0.0

    def currents(self, torque, seen):
        used = min(seen.u / seen.u_max, 1.0)
        wanted = self.i_max * max(0.0, used - FW_START) / (1.0 - FW_START)
        self.weakening += min(max(wanted - self.weakening, -self.step), self.step)
        i_d, i_q = mtpa(self.machine, torque, self.i_max)
        i_d = max(i_d - self.weakening, -self.i_max)
        most = math.sqrt(self.i_max**2 - i_d**2)
        return i_d, min(max(i_q, -most), most)


class Newton:
    """MTPA, else torque and flux limit by four steps of Newton's method from the last point."""

    def __init__(self, case):
        self.machine, self.i_max = case.drive.machine, case.drive.current_limit_a
        self.last, self.i_d = np.zeros(2), np.linspace(-self.i_max, 0.0, 201)

    def most(self, flux: float) -> tuple[float, float, float]:
        """(torque over 1.5*p, i_d, i_q), the largest within flux limit and current circle, by the nameplate."""
        m, i_d = self.machine, self.i_d
        room = np.maximum(flux * flux - (m.magnet_flux_wb + m.inductance_d_h * i_d) ** 2, 0.0)
        i_q = np.minimum(np.sqrt(room) / m.inductance_q_h, np.sqrt(np.maximum(self.i_max**2 - i_d**2, 0.0)))
        torque = (m.magnet_flux_wb + (m.inductance_d_h - m.inductance_q_h) * i_d) * i_q
        k = int(np.argmax(torque))
        return float(torque[k]), float(i_d[k]), float(i_q[k])

    def currents(self, torque, seen):
        m, (i_d, i_q) = self.machine, mtpa(self.machine, torque, self.i_max)
        l_d, l_q, psi = m.inductance_d_h, m.inductance_q_h, m.magnet_flux_wb
        most = VOLTAGE * seen.u_max / max(abs(seen.omega), 1e-6)
        if math.hypot(psi + l_d * i_d, l_q * i_q) <= most:
            self.last = np.array([i_d, i_q])
            return i_d, i_q
        x, wanted = self.last.copy(), torque / (1.5 * m.pole_pairs)
        best, *point = self.most(most)
        if abs(wanted) >= best:
            self.last = np.array([point[0], math.copysign(point[1], torque)])
            return point[0], math.copysign(point[1], torque)
        for _ in range(4):
            d = psi + l_d * x[0]
            off = np.array([(psi + (l_d - l_q) * x[0]) * x[1] - wanted, d * d + (l_q * x[1]) ** 2 - most * most])
            slope = np.array([[(l_d - l_q) * x[1], psi + (l_d - l_q) * x[0]], [2 * l_d * d, 2 * l_q * l_q * x[1]]])
            if abs(np.linalg.det(slope)) < 1e-12:
                break
            x = np.clip(x - np.linalg.solve(slope, off), -self.i_max, self.i_max)
        x[0] = min(x[0], 0.0)
        q_most = math.sqrt(max(self.i_max**2 - x[0] ** 2, 0.0))
        x[1] = min(max(x[1], -q_most), q_most)
        self.last = x
        return float(x[0]), float(x[1])


class Motulator:
    """motulator's CurrentReference."""

    def __init__(self, case):
        from motulator.drive.control.sm import CurrentReferenceCfg
        from motulator.drive.control.sm._current_vector import CurrentReference
        from motulator.drive.utils import SynchronousMachinePars

        m, self.t_s = case.drive.machine, case.drive.sample_time_s
        par = SynchronousMachinePars(
            n_p=m.pole_pairs, R_s=m.resistance_ohm, L_d=m.inductance_d_h, L_q=m.inductance_q_h, psi_f=m.magnet_flux_wb
        )
        nominal = m.pole_pairs * m.rated_speed_rad_s
        cfg = CurrentReferenceCfg(par, max_i_s=case.drive.current_limit_a, nom_w_m=nominal, k_u=VOLTAGE)
        self.generator = CurrentReference(par, cfg)

    def currents(self, torque, seen):
        feedback = SimpleNamespace(w_m=seen.omega, u_dc=seen.u_max * math.sqrt(3.0))
        ref = SimpleNamespace(tau_M=torque, T_s=self.t_s, u_s=seen.u, i_s=0j)
        ref = self.generator.output(feedback, ref)
        self.generator.update(feedback, ref)
        return float(np.real(ref.i_s)), float(np.imag(ref.i_s))


METHODS = {"duty feedback": DutyFeedback, "Newton": Newton, "motulator": Motulator}


def play(case, method: Method, torque: np.ndarray, speed: np.ndarray) -> dict[str, np.ndarray]:
    """A run at imposed speeds (n,) with the references of ``method`` for torques (n,) [Nm]; the plant's signals."""
    drive, chosen = case.drive, registers(case.drive, case.flux)
    values, n = chosen.values._replace(use_table=0), len(torque)
    params = plant_params(case.plant, Inverter(), mode=IMPOSED_SPEED)
    bench = Bench(
        registers=values, config=chosen.config,
        plant_state=initial_state(case.plant, params, omega_m=float(speed[0])), plant_params=params,
        sensors=sensor_params(described_sensors(drive)), dead_time_s=float(drive.inverter.dead_time_s),
        period_s=drive.sample_time_s, levels=np.zeros(3), waits=np.full(3, float(drive.inverter.dead_time_s)),
        free=False, bus=IDEAL, u_dc=np.array([drive.inverter.dc_bus_v]), edges=no_edges(), table=chosen.table,
    )  # fmt: skip
    out, observed = np.zeros((n, len(PLANT))), np.zeros((n, len(fluxproof.Observed._fields)), np.int64)
    state, column = fluxproof.State(), {name: k for k, name in enumerate(fluxproof.Observed._fields)}
    kp = {row.name: row.si for row in chosen.rows if row.name in ("kp_d", "kp_q")}
    u_max, u, asked = drive.inverter.dc_bus_v / math.sqrt(3.0), 0.0, (0.0, 0.0)
    given = np.zeros((1, 8), np.int64)
    given[0, 7] = 1
    one = [np.zeros(1) for _ in range(3)]
    for k in range(n):
        asked = method.currents(float(torque[k]), Seen(speed[k] * drive.machine.pole_pairs, u_max, u))
        given[0, 1], given[0, 2] = (
            from_si(name, i, drive) for name, i in zip(("i_d_ref", "i_q_ext"), asked, strict=True)
        )
        one[0][0], one[1][0] = drive.inverter.dc_bus_v, speed[k]
        part = slice(k, k + 1)
        state = run_switching(state, Stimulus(given, *one), bench, k, out[part], observed[part])
        seen = observed[k]
        parts = []
        for x, i_ref in zip("dq", asked, strict=True):
            si = {name: to_si(f"{name}_{x}", seen[column[f"{name}_{x}"]], drive) for name in ("i", "u_int", "u_dec")}
            parts.append(si["u_int"] + si["u_dec"] + kp[f"kp_{x}"] * (i_ref - si["i"]))
        u = math.hypot(*parts)
    return dict(zip(PLANT, out.T, strict=True))


def rows_of(case, name: str) -> list[dict]:
    """Loss and torque at half the base speed, torque above it."""
    plane = Plane(case.truth, case.drive.machine.pole_pairs, case.drive.current_limit_a)
    base, top, limit = figures.base_speed(case, plane), plane.most(np.inf)[0], case.drive.current_limit_a
    n, above, wrong, found = round(SECONDS / case.drive.sample_time_s), [], [], []
    for part in TORQUES:
        asked = part * top * np.minimum(np.linspace(0.0, 4.0, n // 2), 1.0)
        run = play(case, METHODS[name](case), asked, np.full(n // 2, 0.5 * base))
        torque, i_d, i_q = (figures.settled(run[key]) for key in ("torque", "i_d", "i_q"))
        best = plane.least_current(torque, np.inf) or plane.most(np.inf)[1:]
        above.append(100.0 * ((i_d**2 + i_q**2) / (best[0] ** 2 + best[1] ** 2) - 1.0))
        wrong.append(100.0 * (torque - part * top) / top)
    found.append(("copper loss above the optimum, mean", np.mean(above), "%"))
    found.append(("copper loss above the optimum, worst", np.max(above), "%"))
    found.append(("asked against delivered, of the largest", np.abs(wrong).max(), "%"))
    for times in SPEEDS:
        most = figures.possible(case, plane, times * base)
        if most < 0.02 * top:
            continue
        ramp = np.minimum(np.linspace(0.3, 1.7, n), 1.0) * times * base
        run = play(case, METHODS[name](case), np.full(n, 1.2 * top), ramp)
        share, size = 100.0 * figures.settled(run["torque"]) / most, np.hypot(run["i_d"], run["i_q"])
        found.append((f"torque at {times:g} x base of what the map allows", share, "%"))
        found.append((f"peak current at {times:g} x base of its limit", size.max() / limit, "1"))
    return [
        {"experiment": case.name, "method": name, "figure": figure, "value": round(float(value), 3), "unit": unit}
        for figure, value, unit in found
    ]


def main() -> int:
    """All methods on all plants, or those named: a line for each figure, and build/studies/speed_others.json."""
    rows = []
    for case in figures.cases(figures.brusa()):
        for name in sys.argv[1:] or METHODS:
            for one in rows_of(case, name):
                head = f"{one['experiment']:20} {one['method']:14} {one['figure']:45}"
                print(f"{head} {one['value']:>9g} {one['unit']}", flush=True)
                rows.append(one)
    write_json(BUILD / "studies" / "speed_others.json", rows)
    return 0


if __name__ == "__main__":
    np.seterr(invalid="ignore")
    sys.exit(main())
