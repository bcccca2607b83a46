# SPDX-License-Identifier: BSD-3-Clause
"""What the steps share: registers in force, snapshots in SI units, the watch on the currents, the gates."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fluxproof.commission.bus import Bus
from fluxproof.cosim.step_response import Curve, Situation
from fluxproof.plant.transforms import linear_limit
from golden_model.board_registers import SECTORS, board_registers
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.encoders import forced_position
from golden_model.fluxproof import REGISTERS
from golden_model.io import board_map
from golden_model.io.fault_latch import NAMES
from golden_model.io.register_map import Kind
from golden_model.registers import registers
from golden_model.units import TURN_RAD, from_si, to_si

WHOLE = board_map.registers()
STOP_OF_LIMIT = 1.05  # of the current limit: a snapshot above ends the commissioning
TRIPPED = 1 << 1  # of the register flags
LEAST_OF_BUS = 0.1  # of the nominal bus voltage: below it no gain of the legs is formed
LOOK_S = 5e-3  # between two looks at the currents
OF_HEARTBEAT, LEAST_HEARTBEAT_S = 1.0 / 3.0, 4.0 * LOOK_S  # longest wait without a write; what such a host can keep
# Nothing that rests on the machine's data acts during commissioning, and no limit of a speed that is forced.
QUIET = {"compensate": 0, "flux_mode": 0, "l_d": 0, "l_q": 0, "lambda_mg": 0, "emf_samples": 0, "residual_samples": 0}
OPEN_WIDE = ("omega_trip", "omega_away", "offset_max")  # limits of the motion and of the sensors' zero, not yet known


class Refusal(Exception):
    """Commissioning ends here; one line: what was seen, what was expected, what to check."""


@dataclass(frozen=True)
class Value:
    """A measured value with its standard uncertainty (1 sigma)."""

    value: float
    sigma: float
    unit: str


@dataclass
class Step:
    """What a step has found, for the line on the terminal and commission.json."""

    name: str
    values: dict[str, Value]
    said: str
    notes: dict = field(default_factory=dict)
    responses: tuple[tuple[Drive, Situation, Curve], ...] = ()  # the drive, a step of it, what was measured


class Seen:
    """Snapshots in sequence as arrays in SI units: ``t``, i_d, i_q, u_d, u_q, omega_me, u_dc, theta_me, adc_x, code.

    ``code``: the encoder's place [mechanical turns], unwrapped from its first value within a turn.  ``u_d``, ``u_q``
    are the voltages behind the devices, ``voltage_gain`` times those of the registers.
    """

    def __init__(self, drive: Drive, rows: list[dict], times: list[float]):
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        self.t = np.array(times)
        names = ("i_d", "i_q", "u_d", "u_q", "omega_me", "u_dc")
        self.i_d, self.i_q, self.u_d, self.u_q, self.omega_me, self.u_dc = (
            to_si(name, columns[name], drive) for name in names
        )
        gain = voltage_gain(drive, self.u_dc)
        self.u_d, self.u_q = gain * self.u_d, gain * self.u_q
        self.theta_me = np.unwrap(to_si("theta_me", columns["theta_me"], drive))
        self.adc = np.array([columns[f"snap_adc_{x}"] for x in "abc"]).T
        turns = 2.0**-drive.sensors.position_bits
        self.code = np.unwrap(columns["snap_code"] * turns, period=1.0)
        self.place = np.unwrap(columns["snap_position"] * turns, period=1.0)

    @property
    def current(self) -> np.ndarray:
        return self.i_d + 1j * self.i_q

    @property
    def voltage(self) -> np.ndarray:
        return self.u_d + 1j * self.u_q


def voltage_gain(drive: Drive, u_dc: np.ndarray) -> np.ndarray:
    """The leg's mean voltage per commanded one, of unequal thresholds of switch and diode.

    With the duty d a leg loses ``d*v_switch + (1 - d)*v_diode`` at i > 0 and ``-(1 - d)*v_switch - d*v_diode`` at
    i < 0: half their sum with the sign of i, which V_dead has, and ``(d - 1/2)*(v_switch - v_diode)`` at either sign,
    which is a share of the voltage ``(d - 1/2)*u_dc``.
    """
    i = drive.inverter
    return 1.0 + (i.v_diode_v - i.v_switch_v) / np.maximum(u_dc, LEAST_OF_BUS * i.dc_bus_v)


CHARGED = "a supply that takes back what braking gives, or a brake resistor ([protection] brake_on_v)"


class Session:
    """One commissioning on a bus; ``drive`` is what is known so far."""

    def __init__(self, bus: Bus, drive: Drive, progress: Callable[[str], None] = lambda text: None):
        self.bus, self.drive, self.progress = bus, drive, progress
        self.limit, self.t_s = drive.current_limit_a, drive.sample_time_s
        self.started = bus.now()

    # ---------------------------------------------------------------- the code

    @property
    def code_pairs(self) -> int:
        """Electrical turns in a turn of the code: Hall sensors alone give an electrical code."""
        return 1 if self.coarse else self.drive.code_pairs

    @property
    def coarse(self) -> bool:
        """Hall sensors alone: the code stands within a sector of 60 degrees."""
        return self.drive.encoder.kind == "hall"

    @property
    def code_step(self) -> float:
        """Smallest step of the code, in its turns."""
        if self.coarse:
            return 1.0 / SECTORS
        return 1.0 / min(2**self.drive.sensors.position_bits, self.drive.encoder.counts or 1 << 30)

    # ---------------------------------------------------------------- registers

    def load(self, kp: float | None = None, ki: float | None = None, **others: int) -> None:
        """All registers of the drive with QUIET and ``others``; current gains [V/A], [V/(A s)] if given."""
        control = {}
        if kp is not None:
            control = {f"current_kp_{axis}_v_per_a": kp for axis in "dq"}
            control |= {f"current_ki_{axis}_v_per_as": ki for axis in "dq"}
        drive = replace(self.drive, control=replace(self.drive.control, **control))
        values = board_registers(drive) | QUIET
        values |= {name: REGISTERS[name].high for name in OPEN_WIDE if name in REGISTERS}
        self._write(values | others)

    def load_final(self) -> None:
        """All registers as the drive says, nothing left out."""
        self._write(board_registers(self.drive))

    def speed_gains(self, kp: float, ki: float, filter_hz: float) -> dict[str, int]:
        """The registers of these gains [A s/rad], [A/rad] of the speed loop, per electrical speed and angle."""
        control = replace(self.drive.control, speed_kp_as_per_rad=kp, speed_ki_a_per_rad=ki, speed_filter_hz=filter_hz)
        values = registers(replace(self.drive, control=control)).values
        return {name: getattr(values, name) for name in ("speed_kp", "speed_ki", "k_filter")}

    def _write(self, values: dict[str, int]) -> None:
        for name, value in values.items():
            if name not in ("position_restart", "omega_given"):  # the board's own
                self._put(name, value)

    def _put(self, name: str, value: int) -> None:
        """Write it, but a still setting only where it changes: gains are loaded while the gates switch, too."""
        if WHOLE[name].kind is not Kind.STILL or self.bus.read(name) != value:
            self.bus.write(name, value)

    def set(self, **si: float) -> None:
        """References in SI units: i_d_ref, i_q_ext [A], omega_ref [electrical rad/s]."""
        for name, value in si.items():
            self.bus.write(name, from_si(name, value, self.drive))

    def force(self, angle_rad: float = 0.0, speed_rad_s: float = 0.0) -> None:
        """The electrical angle, and what it turns by [electrical rad/s], in place of the encoder's."""
        pairs = self.code_pairs
        code = round(angle_rad / TURN_RAD / pairs * 2**forced_position.TURN_W) % 2**forced_position.TURN_W
        self.bus.write("forced_angle", code)
        self.bus.write("forced_rate", forced_position.setting(speed_rad_s / pairs, self.t_s))
        self._put("position_source", 1)

    def release(self) -> None:
        """The encoder's angle again."""
        self.bus.write("position_source", 0)

    def gates_off(self) -> None:
        """References zero, gates off."""
        self.bus.write("enable", 0)
        self.set(i_d_ref=0.0, i_q_ext=0.0, omega_ref=0.0)
        self.bus.write("speed_mode", 0)

    def gates_on(self) -> None:
        self.bus.write("clear_trip", 1)
        self.bus.write("enable", 1)

    # ---------------------------------------------------------------- what is seen

    def look(self, samples: int, pause_s: float = 0.0, until: Callable[[dict], bool] | None = None) -> Seen:
        """Snapshots, ``pause_s`` apart besides the time they take; Refusal at a trip or a current above the limit."""
        rows, times = [], []
        for _ in range(samples):
            rows.append(self.snapshot())
            times.append(self.bus.now())
            if until is not None and until(rows[-1]):
                break
            if pause_s:
                self.pause(pause_s)
        return Seen(self.drive, rows, times)

    def snapshot(self) -> dict:
        """One snapshot, after the watch."""
        row = self.bus.snapshot()
        if self.bus.read("flags") & TRIPPED:
            self.bus.write("enable", 0)
            told = [n for k, n in enumerate(NAMES) if self.bus.read("fault_flags") >> k & 1]
            charged = f", and {CHARGED}" if "u_dc_high" in told else ""
            raise Refusal(f"the core has tripped: {', '.join(told)}; expected no fault: see docs/faults.md{charged}")
        size = math.hypot(*(to_si(n, row[n], self.drive) for n in ("i_d", "i_q")))
        if size > STOP_OF_LIMIT * self.limit:
            self.bus.write("enable", 0)
            raise Refusal(
                f"a current of {size:.3g} A, expected at most {self.limit:.3g} A: check the sensors' gain and the "
                "start values of R and L"
            )
        return row

    def pause(self, seconds: float) -> None:
        """Wait, and write within the core's heartbeat; a snapshot writes too."""
        longest = self.drive.protection.heartbeat_s * OF_HEARTBEAT or math.inf
        while seconds > longest:
            self.bus.wait(longest)
            self.bus.write("speed_mode", self.bus.read("speed_mode"))
            seconds -= longest
        self.bus.wait(seconds)

    def settle(self, seconds: float) -> None:
        """Wait, with a look at the currents every few milliseconds."""
        end = self.bus.now() + seconds
        while self.bus.now() < end:
            self.pause(min(LOOK_S, max(end - self.bus.now(), self.t_s)))
            self.snapshot()

    def ramp(self, seconds: float, steps: int = 20, **to: tuple[float, float]) -> None:
        """References from the first to the second value."""
        for k in range(1, steps + 1):
            self.set(**{name: a + (b - a) * k / steps for name, (a, b) in to.items()})
            self.settle(seconds / steps)

    def voltage(self) -> float:
        """The largest voltage at the present bus voltage [V]."""
        u_dc = to_si("u_dc", self.bus.snapshot()["u_dc"], self.drive)
        return linear_limit(u_dc) * (1.0 - self.drive.control.voltage_reserve)

    def know(self, section: str, **values) -> None:
        """Replace what the drive file says; Refusal where the file's other values forbid it."""
        try:
            self.drive = replace(self.drive, **{section: replace(getattr(self.drive, section), **values)})
        except DriveError as error:
            raise Refusal(f"measured values do not fit the drive file: {error}") from None


def solve(matrix: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Least squares: (solution, its standard uncertainties from the residuals, rms of the residuals)."""
    solution, _, rank, _ = np.linalg.lstsq(matrix, values, rcond=None)
    if rank < matrix.shape[1]:
        raise Refusal("the measured points do not determine the model: too little current or motion")
    rest = values - matrix @ solution
    freedom = max(len(values) - matrix.shape[1], 1)
    variance = float(np.vdot(rest, rest).real) / freedom
    covariance = np.linalg.inv(matrix.T @ matrix) * variance
    return solution, np.sqrt(np.diag(covariance)), math.sqrt(variance)
