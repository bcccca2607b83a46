"""What an effect of the catalogue is, and the four ways in which physics enters the balance.

The misfit of a channel is what was recorded minus what the nominal drive would need:

    u       mean stator voltage of an interval in dq, complex (b, m) [V]
    sum     i_a + i_b + i_c at the samples' middle, real (b, m) [A]
    torque  torque at the shaft, real (b, m) [Nm]

An effect says which *columns* it adds to the misfit, per unit of its coefficients: a ``core`` that stands for
its usual formula and a ``free`` set that bends that formula as far as its variables and symmetry allow.  A
name rests on what an effect depends on; no formula of a real machine is the catalogue's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.result import Estimate

Column = dict  # channel -> array
DOUBT = 2.0  # standard deviations that a value must be on the wrong side to be ruled out
ALIKE = 0.1  # so near, relative, are two the same


@dataclass(frozen=True)
class Parameter:
    """A number that describes an effect."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Effect:
    """Base of the catalogue's entries; each lives in a file of its own and is found by being there.

    absorbs: effects that a freer curve of this one contains; they are asserted beside it on stronger evidence only.
    confounders: effects that look alike, with ``separated_by`` in words.
    """

    name: str
    title: str
    equation: str
    signature: str
    confounders: tuple[str, ...]
    separated_by: str
    parameters: tuple[Parameter, ...]
    absorbs: tuple[str, ...] = ()
    positive: bool = False  # the leading coefficient cannot be below zero
    corrects: bool = (
        False  # an error of the record rather than a term of the machine: ``corrected`` takes it away
    )
    smoothed: bool = False  # its terms stay on smoothed currents when the model is applied

    def core(self, view) -> dict[str, Column]:
        """Columns of the usual formula, {coefficient: column}."""
        raise NotImplementedError

    def free(self, view) -> dict[str, Column]:
        """Further columns, for a curve as free as the effect's variables and symmetry allow."""
        return {}

    def floor(self, nominal) -> float:
        """Least size of the effect that is worth a name, in units of ``size``."""
        raise NotImplementedError

    def overshadowed(self, c: dict[str, dict], nominal) -> float:
        """Size up to which another effect of a model with coefficients c makes the same by itself."""
        return 0.0

    def ceiling(self, nominal) -> float:
        """Largest size that a drive which still runs can have, in units of ``size``."""
        return float("inf")

    def too_large(self, c: dict[str, float], view) -> bool:
        """Whether no drive that still runs has coefficients c in a recording."""
        return self.size(c, view.nominal) > self.ceiling(view.nominal)

    def size(self, c: dict[str, float], nominal) -> float:
        """One number for how large the effect is."""
        return abs(next(iter(c.values())))

    def doubt(self, c: dict[str, float], view) -> np.ndarray | float:
        """Voltage (b,) [V] that no curve of the effect could tell, beside its share of what the curve says."""
        return 0.0

    def moved(self, c: dict[str, float], view) -> float:
        """How much the effect changed over a recording, in units of ``size``: a drift is its own change."""
        return self.size(c, view.nominal)

    def possible(self, c: dict[str, float], covariance: np.ndarray, nominal) -> bool:
        """Whether the coefficients are not, beyond doubt, what physics rules out; covariance in their order."""
        return not self.positive or sum(c.values()) >= -DOUBT * np.sqrt(max(covariance.sum(), 0.0))

    def corrected(self, view, c: dict[str, float]):
        """The view without this error of the record (only where ``corrects``)."""
        raise NotImplementedError

    def estimates(self, c: dict[str, float], covariance: np.ndarray, nominal) -> dict[str, Estimate]:
        """Parameters of the effect from its coefficients, whose order is that of the covariance."""
        raise NotImplementedError

    def relative(self, c: dict[str, dict], nominal) -> float:
        """What the coefficients are multiplied by beside the other named effects, c of all of them."""
        return 1.0

    def plant(self, c: dict[str, float], nominal) -> dict:
        """The effect as the plant is told it, {"machine.resistance_ohm": 1.7, ...}."""
        return {}


class FluxEffect(Effect):
    """An effect that is a flux linkage of the machine: it says its shapes, per unit of its coefficients."""

    def core_psi(self, view) -> dict[str, np.ndarray]:
        """Flux shapes of the usual formula, {coefficient: (b, m+1) complex dq}."""
        raise NotImplementedError

    def free_psi(self, view) -> dict[str, np.ndarray]:
        """Further flux shapes."""
        return {}

    def core(self, view):
        return {name: flux(view, psi) for name, psi in self.core_psi(view).items()}

    def free(self, view):
        return {name: flux(view, psi) for name, psi in self.free_psi(view).items()}

    def psi(self, view, c) -> np.ndarray:
        """The effect's flux linkage, (b, m+1) complex dq [Wb]."""
        shapes = {**self.core_psi(view), **self.free_psi(view)}
        return sum(value * shapes[name] for name, value in c.items() if value)

    def delta_l(self, c) -> tuple[float, float]:
        """What it adds to L_d and L_q [H]."""
        return 0.0, 0.0


def voltage(u) -> Column:
    """A voltage that the machine or the inverter needs beyond the nominal one, (b, m) complex dq."""
    return {"u": u}


def flux(view, psi) -> Column:
    """A flux linkage beyond the nominal one, (b, m+1) complex dq."""
    return {"u": view.flux(psi), "torque": torque_of(view, psi, view.i)}


def current_error(view, error) -> Column:
    """Measured minus true current, (b, m+1) complex dq: the balance was made with the measured one."""
    psi = view.inductances(error)
    return {
        "u": -view.machine.resistance_ohm * 0.5 * (error[:, 1:] + error[:, :-1]) - view.flux(psi),
        "torque": -torque_of(view, psi, view.i) - torque_of(view, view.psi, error),
    }


def angle_error(view, delta) -> Column:
    """Measured minus true electrical angle, (b, m+1): all that was turned to dq was turned too far."""
    turned = -1j * view.i
    psi = view.inductances(turned)
    return {
        "u": -view.flux((1j * view.psi + psi) * delta),
        "torque": -torque_of(view, psi * delta, view.i) - torque_of(view, view.psi, turned * delta),
    }


def zero_vector_slope(view):
    """Slope of the measured dq current in the zero vector, seen at the angle of the valley (b, m+1) [A/s]."""
    m = view.machine
    emf = -m.resistance_ohm * view.i - 1j * view.omega * view.psi
    return emf.real / m.inductance_d_h + 1j * emf.imag / m.inductance_q_h + 1j * view.omega * view.i


def torque_of(view, psi, i):
    """Air-gap torque of the intervals, (b, m) [Nm], from flux linkage and current at the samples."""
    torque = 1.5 * view.machine.pole_pairs * (np.conj(psi) * i).imag
    return 0.5 * (torque[:, 1:] + torque[:, :-1])


def full_loss(c) -> float:
    """Full value [V] of a dead time with coefficients c: the bumps of its curve are those near zero current."""
    return float(sum(v for key, v in c.items() if not key.startswith("bump")))


def within_dead_time(c, nominal) -> float:
    """Up to which a delay or skew is nothing but the dead time of a model with coefficients c [s]."""
    return (1.0 + ALIKE) * half_dead_time(c, nominal)


def half_dead_time(c, nominal) -> float:
    """By how much a model's dead time moves the middle of every pulse [s]: one of its edges is late by the whole.

    c: {effect: {coefficient: value}}.
    """
    share = abs(full_loss(c.get("dead_time", {}))) / nominal.inverter.dc_bus_v
    return 0.5 * share * nominal.sample_time_s


def to_true_resistance(c, nominal) -> float:
    """Nominal resistance over the one that named effects with coefficients c say: for shares of the resistance."""
    r = nominal.machine.resistance_ohm
    return r / max(r + c.get("resistance", {}).get("delta_r", 0.0), 0.1 * r)


def rated_torque(nominal) -> float:
    """Torque of the magnets at rated current [Nm]."""
    m = nominal.machine
    return 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a


def sigma(covariance, k=0) -> float:
    """Standard deviation of coefficient k."""
    return float(np.sqrt(max(covariance[k, k], 0.0)))


def one(name, unit, value, spread) -> dict[str, Estimate]:
    """A single parameter."""
    return {name: Estimate(float(value), float(spread), unit)}
