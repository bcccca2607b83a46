# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of rows at steady operating points, from which every effect computes its columns.

Row k of a block is the interval from sample k to k+1.  The current of a regressor is a parabola over the block: the
noise of a raw current is also in the misfit, and this correlation would cause a false inductance error on a healthy
drive.  ``blocks.view_of`` cuts a recording into blocks.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fluxproof.diagnosis.balance.curves import parabola
from fluxproof.diagnosis.balance.shaft import FREE
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.machine import flux_linkage, flux_of_current, mean_emf
from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.plant.transforms import phase_values, space_vector

# What is computed from the angle alone stays known in a copy with the same angle.
OF_THE_ANGLE = ("half_turn", "mid_turn", "turn", "theta_mid", "interval_angle")
HALF_WIDTH = 8  # the smoothed angle is the moving average over 2 HALF_WIDTH + 1 samples
SLOPE_REACH = 60  # samples over which the acceleration of a shaft with an imposed speed is computed
STACKED = ("theta", "omega", "i", "i_raw", "u", "u_dc", "temp", "torque", "slope_m", "shaft", "rows")


@dataclass
class View:
    """Arrays over blocks (b) and samples (m + 1) or intervals (m) of one or several recordings of a drive.

    theta, omega, i: (b, m+1) smoothed angle [rad], speed [rad/s], current in dq, complex [A]
    i_raw: (b, m+1) measured current in the stator frame, complex [A]
    i_abc: (b, m+1, 3) measured phase currents [A], or None if the recording has dq only
    u: (b, m+2) stator-frame voltage of the intervals -1 .. m, complex [V]; u_dc: (b, m) [V]
    mean_duty: (b, m+2) mean of the three duties, or None if the recording has none: that of centred pulses
    t, temp, run: (b,) time since the first row [s], winding temperature [degC] or nan, number of the dwell
    course: (b,) progress of slow drifts (warming), from 0 at the start to 1 at the end
    torque: (b, m) shaft torque [Nm], nan where unknown; slope_m: (b, m) d omega_m / dt
    shaft: (b,) kind of shaft (see shaft.py)
    psi_extra: (b, m+1) excess over the nominal flux found so far [Wb], for terms that depend on the flux
    delta_l: errors of L_d and L_q found so far [H]
    late_s: shift of the middle of every pulse [s] due to the dead time found so far
    """

    nominal: Nominal
    sample_time_s: float
    theta: np.ndarray
    omega: np.ndarray
    i: Complex
    i_raw: Complex
    i_abc: np.ndarray | None
    u: Complex
    u_dc: np.ndarray
    t: np.ndarray
    course: np.ndarray
    temp: np.ndarray
    torque: np.ndarray
    slope_m: np.ndarray
    shaft: np.ndarray
    run: np.ndarray
    rows: np.ndarray  # (b,) first row in its recording
    span_s: float  # length of the whole recording
    psi_extra: np.ndarray | float = 0.0
    delta_l: tuple[float, float] = (0.0, 0.0)
    late_s: float = 0.0
    mean_duty: np.ndarray | None = None
    # Shares that a common scale of the currents and a gain of the bus sensor leave of what was recorded, (b, 1) or 1.
    current_kept: np.ndarray | float = 1.0
    voltage_kept: np.ndarray | float = 1.0
    catalogue: dict = dataclasses.field(default_factory=dict)  # {name: Effect} that a drive file can describe
    memo: dict = dataclasses.field(default_factory=dict)  # cache of the effects, shared by all views of a recording

    angle_step: float = 0.0  # of the encoder's codes [rad]; 0: none is seen
    dq_voltage: bool = False  # whether the drive turned the recorded voltage with the encoder's codes
    lacks: np.ndarray | None = None  # (b,) frozensets of words in effect.NEEDS that a block cannot show; None: nothing

    least_error = 1.0  # of ``balance_error``: what the balance of a good recording has at least
    stacked = STACKED  # arrays over blocks that several recordings simply append

    def __len__(self):
        return len(self.t)

    def shows(self, effect) -> np.ndarray:
        """(b,) bool: blocks in which an effect of the catalogue can be seen."""
        if self.lacks is None:
            return np.ones(len(self), bool)
        return np.array([not lacking & set(effect.needs) for lacking in self.lacks])

    @property
    def locked(self) -> np.ndarray:
        """(b,) bool: blocks whose angle was recorded, so that harmonics of the rotor's turn can be seen."""
        lacks = self.lacks if self.lacks is not None else [()] * len(self)
        return np.array(["harmonics" not in lacking for lacking in lacks], bool)

    @property
    def has_voltage(self) -> np.ndarray:
        """(b,) bool: blocks whose voltage was recorded."""
        lacks = self.lacks if self.lacks is not None else [()] * len(self)
        return np.array(["voltage" not in lacking for lacking in lacks], bool)

    def kept_where(self, blocks, changed):
        """``changed``, a view of the same blocks, with the data of this view in ``blocks`` (b,) bool."""
        if not blocks.any():
            return changed
        pick = lambda old, new: np.where(blocks.reshape(-1, *[1] * (np.ndim(new) - 1)), old, new)  # noqa: E731
        names = ("theta", "omega", "i", "i_raw", "u", "u_dc")
        data = {name: pick(getattr(self, name), getattr(changed, name)) for name in names}
        for name in ("current_kept", "voltage_kept"):
            data[name] = np.where(blocks[:, None], getattr(self, name), getattr(changed, name))
        return changed.replace(**data)

    def visible(self, effects: dict) -> dict:
        """Those of the effects {name: Effect} that can be seen in any block."""
        return {name: effect for name, effect in effects.items() if self.shows(effect).any()}

    @property
    def turns_freely(self) -> np.ndarray:
        """(b,) bool: blocks whose acceleration is a second difference of the angle (blocks.py)."""
        return np.isin(self.shaft, FREE)

    @property
    def machine(self):
        return self.nominal.machine

    @cached_property
    def half_turn(self):
        """Factor of half the rotation in an interval, (b, m)."""
        return np.exp(0.5j * np.diff(self.theta, axis=1))

    @cached_property
    def mid_turn(self):
        """Factor from dq to the stator frame at the middle of an interval, (b, m)."""
        return np.exp(1j * self.theta_mid)

    @cached_property
    def turn(self):
        """Factor from dq to the stator frame at the samples, (b, m+1)."""
        return np.exp(1j * self.theta)

    @cached_property
    def i_mid(self):
        """Mean of an interval's two samples in the stator frame, in dq at its middle angle, (b, m) complex [A].

        The mean in dq would be longer by (omega T)^2 / 8.  An error of 0.5 % of R i resembles a resistance that falls
        with speed, or, with an iron loss, a sampling skew.
        """
        half = self.half_turn
        return 0.5 * (half * self.i[:, 1:] + np.conj(half) * self.i[:, :-1])

    @cached_property
    def omega_mid(self):
        """Speed of an interval, (b, m) [rad/s]."""
        return 0.5 * (self.omega[:, 1:] + self.omega[:, :-1])

    @property
    def top_speed(self):
        """Highest speed of the recording [rad/s]; a view of simulated points keeps that of the recording."""
        return self.memo.get("top_speed") or max(float(np.abs(self.omega).max()), 1e-9)

    @cached_property
    def theta_mid(self):
        """Angle in the middle of an interval, (b, m) [rad]."""
        return 0.5 * (self.theta[:, 1:] + self.theta[:, :-1])

    @cached_property
    def interval_angle(self):
        """Angle in the middle of the intervals -1 .. m, (b, m+2) [rad]; the outer two are continued."""
        inner = self.theta_mid
        return np.concatenate([2 * inner[:, :1] - inner[:, 1:2], inner, 2 * inner[:, -1:] - inner[:, -2:-1]], axis=1)

    @cached_property
    def nominal_psi(self):
        """Nominal flux linkage of the current, (b, m+1) complex dq [Wb]."""
        return flux_linkage(self.machine, self.i)

    @property
    def psi(self):
        """Flux linkage including the excess found so far, (b, m+1) complex dq [Wb]."""
        return self.nominal_psi + self.psi_extra

    def inductances(self, i):
        """L_d i_d + j L_q i_q [Wb] of a dq current, with the inductance errors found so far."""
        m, (more_d, more_q) = self.machine, self.delta_l
        return flux_of_current(i, m.inductance_d_h + more_d, m.inductance_q_h + more_q)

    @cached_property
    def duties(self):
        """Duties of the legs in the intervals -1 .. m, (b, m+2, 3), without noise."""
        turn = np.exp(1j * self.interval_angle)
        u: Complex = parabola(self.u * np.conj(turn)) * turn / self.u_dc.mean(axis=1)[:, None]
        legs = phase_values(u)
        if self.mean_duty is None:
            mean = 0.5 - 0.5 * (legs.max(axis=2) + legs.min(axis=2))
        else:
            mean = self.mean_duty
        return np.clip(legs + mean[..., None], 0.0, 1.0)

    @property
    def has_sum(self):
        """Whether three phase currents were measured independently."""
        return self.i_abc is not None

    def balance_error(self):
        """(b,) error of the voltage balance that no parameter explains [V]."""
        level = np.abs(self.to_dq(self.u[:, 1:-1]).mean(axis=1))
        return k.BALANCE_U * level + k.BALANCE_DC * self.nominal.inverter.dc_bus_v

    def common_errors(self):
        """Errors of the balance that all operating points have in common, (b, m) complex [V], each of a usual size.

        Along and across the voltage, as the converters' timing; along the current, as minimum pulses.
        """
        u, bus = self.to_dq(self.u[:, 1:-1]), self.nominal.inverter.dc_bus_v
        along = self.i_mid / np.abs(self.i_mid).clip(0.02 * self.machine.rated_current_a)
        return k.COMMON_U * u, 1j * k.COMMON_U * u, k.COMMON_DC * bus * along

    def stator(self, dq):
        """A dq quantity of the samples in the stator frame."""
        return dq * self.turn

    def turned(self, delta):
        """The view with ``delta`` [rad], a number or (b, m+1), subtracted from the measured angle."""
        i = self.i * np.exp(1j * delta) * np.ones_like(self.theta)
        return self.replace(theta=self.theta - delta, i=i)

    def without_current(self, error, raw_gain=None, turn=0.0):
        """The view with phase errors (b, m+1, 3) [A] subtracted from the smoothed and the measured current.

        raw_gain, turn: the measured currents are instead divided by the gains (3,) and rotated back.
        """
        i = self.i - self.from_phases(error)
        if raw_gain is None:
            i_raw = self.i_raw - self.stator(self.from_phases(error))
            i_abc = None if self.i_abc is None else self.i_abc - error
            return self.replace(i=i, i_raw=i_raw, i_abc=i_abc)
        measured = self.i_abc if self.i_abc is not None else phase_values(self.i_raw)
        mended = measured / raw_gain
        i_raw = space_vector(mended) * (1.0 - 1j * turn)
        return self.replace(i=i, i_raw=i_raw, i_abc=None if self.i_abc is None else mended)

    def with_raw_current(self):
        """The view with the measured current instead of the smoothed one."""
        return self.replace(i=self.i_raw * np.conj(self.turn))

    def to_dq(self, stator):
        """(b, m) stator-frame quantity of the intervals, rotated to dq at the middle angle."""
        return stator * np.conj(self.mid_turn)

    def flux(self, psi):
        """Mean EMF of a dq flux linkage given at the samples: (b, m+1) [Wb] to (b, m) complex dq [V]."""
        half = self.half_turn
        return mean_emf((psi[:, :-1], psi[:, 1:]), (np.conj(half), half), self.sample_time_s)

    def phases(self, i_dq):
        """Phase values (b, k, 3) of a dq quantity at the samples (k = m+1) or the intervals (k = m)."""
        return phase_values(i_dq * (self.turn if i_dq.shape[1] == self.theta.shape[1] else self.mid_turn))

    def from_phases(self, abc):
        """dq value of phase values (b, k, 3), amplitude-invariant Clarke."""
        stator = space_vector(abc)
        return stator * np.conj(self.turn if abc.shape[1] == self.theta.shape[1] else self.mid_turn)

    def replace(self, **changes):
        """A copy with other arrays."""
        out = dataclasses.replace(self, **changes)
        if out.theta is self.theta:
            out.__dict__.update({name: self.__dict__[name] for name in OF_THE_ANGLE if name in self.__dict__})
        return out

    def take(self, index):
        """The blocks of ``index`` only."""
        per_block = (*self.stacked, "i_abc", "mean_duty", "lacks", "t", "course", "run")
        arrays = {name: getattr(self, name) for name in per_block}
        return self.replace(**{name: None if x is None else x[index] for name, x in arrays.items()})


def lacking(words, count) -> np.ndarray:
    """(count,) the same frozenset of words for every block."""
    out = np.empty(count, object)
    out[:] = [frozenset(words)] * count
    return out
