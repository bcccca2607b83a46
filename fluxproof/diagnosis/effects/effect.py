# SPDX-License-Identifier: BSD-3-Clause
"""Base class of the catalogue's effects, and the four ways in which physics enters the voltage balance.

The misfit of a channel is the recorded value minus the one that the nominal drive needs:

    u       mean stator voltage of an interval in dq, complex (b, m) [V]
    sum     i_a + i_b + i_c at the samples' middle, real (b, m) [A]
    torque  torque at the shaft, real (b, m) [Nm]

An effect defines the *columns* (regressors) that it adds to the misfit, per unit of its coefficients: ``core`` is
its usual formula, ``free`` are further columns for any curve that its variables and symmetry allow.  An effect is
identified by the variables it depends on, since no real machine follows the catalogue's formula exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.ground.machine import airgap_torque, slope_in_zero_vector
from fluxproof.diagnosis.ground.result import Estimate

Column = dict  # channel -> array
NEEDS = {
    "harmonics": "a row per control period",
    "samples": "the instants of sampling, in a log of the control",
    "time": "a time axis, or several temperatures",
    "angle": "an angle that was measured, not taken from the voltages",
    "inverter": "an inverter that switches",
    "current": "measured currents",
}
LEAST_LEFT = 0.1  # of a parameter of the machine: a smaller one is not this machine
LEAST_CURRENT = 0.08  # of rated current: an axis with less current does not determine a curve over it
DOUBT = 2.0  # standard deviations by which a value must violate a limit to be rejected


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect in the report."""

    name: str
    unit: str
    meaning: str
    title: str = ""  # as a headline calls it, "dead-time voltage"; empty: the meaning
    negative: str = ""  # as a headline calls a negative one, whose sign it then leaves out: "earlier by"
    periods: str = ""  # key of [control] that counts it, if it is a whole number of control periods

    @property
    def called(self) -> str:
        return self.title or self.meaning


@dataclass(frozen=True)
class Effect:
    """Base class of the catalogue's entries; each has its own file, which the catalogue imports automatically.

    confounders: effects with a similar signature; ``separated_by`` describes the experiment that separates them.
    """

    name: str
    title: str  # a noun, as a headline calls it
    equation: str
    signature: str
    confounders: tuple[str, ...]
    separated_by: str
    parameters: tuple[Parameter, ...]
    rescales: tuple[str, ...] = ()  # signals and [machine] keys that it scales or offsets: i, u, u_dc, theta_e, ...
    needs: tuple[str, ...] = ()  # of NEEDS: what a recording must show for the effect to be seen
    named: bool = True  # False: the simulation has no parameter for it, so it is described and not reported
    clause: str = ""  # of an effect that is not reported: completes "the residual looks as if ..."
    positive: bool = False  # the leading coefficient cannot be negative
    corrects: bool = (
        False  # a measurement error rather than a property of the machine: ``corrected`` removes it from the data
    )
    starts: tuple[dict, ...] = ()  # coefficients from which a large misfit is also approached, far from a linear effect
    one_of: tuple[tuple[str, ...], ...] = ()  # groups of coefficients that are mutually exclusive
    drift_of: str = ""  # the constant effect of which this one is a slow drift
    trailing: tuple[float, ...] = ()  # further electrical orders at which the effect may have harmonics
    mechanical: bool = False  # a torque of the shaft rather than a voltage of the machine
    curve: float = 0.3  # share of the formula by which the free curve may depart from it
    exact: bool = False  # a constant of the nominal drive or a scale: no error of a formula is assumed
    corrected_last: bool = False  # of several measurement errors: its correction uses the corrected currents
    spreads: bool = False  # varies from drive to drive, so every set of a fleet includes it
    bends: bool = False  # a flux linkage that is no line of the current: a flux map shows it
    map_shapes: tuple[str, ...] = ()  # shapes of a flux map without and with it (flux_surface.SHAPES)
    beside_map: bool = False  # a function of the current that is not a flux: fitted together with a flux map
    takes_flux: bool = False  # ``lost_flux``: its current does not magnetise
    shows_at: tuple[float, ...] = (0.0,)  # electrical orders at which its voltage, current sum or torque appears
    shows_at_turns: tuple[float, ...] = ()  # the same per mechanical turn
    # {parameter: (least, largest) or (least, largest, "machine.key" that they are relative to)} of a usual drive:
    # values outside have low prior odds and are flagged, with another explanation.
    plausible: dict = field(default_factory=dict, hash=False)
    otherwise: str = ""
    stays: str = ""  # why a drive file cannot take the effect out of a recording that has it
    smoothed: bool = False  # its columns use smoothed currents also when the model is applied

    def core(self, view) -> dict[str, Column]:
        """Columns of the usual formula, {coefficient: column}."""
        raise NotImplementedError

    def free(self, view) -> dict[str, Column]:
        """Further columns, for a curve as free as the effect's variables and symmetry allow."""
        return {}

    def expected(self, view) -> bool:
        """Whether the recording itself says that the effect acts, as a recorded temperature says of a resistance."""
        return False

    def log_choice(self, view) -> float:
        """Log of the prior probability of what was chosen for the columns, such as an order of a torque."""
        return 0.0

    def curve_scale(self, key, cores: dict[str, float], nominal) -> float:
        """Coefficient of the free column ``key`` that departs from the formula by as much as the formula itself.

        cores: {coefficient of the formula: its value at the floor}; by default all have one unit.
        """
        return max(cores.values())

    def floor(self, nominal) -> float:
        """Smallest size at which the effect is reported, in units of ``size``."""
        raise NotImplementedError

    def ceiling(self, nominal) -> float:
        """Largest usual size, in units of ``size``: it sets the prior, and what is larger is impossible (too_large)."""
        return float("inf")

    def too_large(self, c: dict[str, float], view) -> bool:
        """Whether coefficients c are impossible in a drive that runs."""
        return self.size(c, view.nominal) > self.ceiling(view.nominal) or self._leaves_nothing(c, view.machine)

    def _leaves_nothing(self, c, machine) -> bool:
        """Whether the first coefficient makes a parameter of the machine negative or nearly zero."""
        values = [getattr(machine, key) for key in self.rescales if hasattr(machine, key)]
        return any(value + next(iter(c.values())) < LEAST_LEFT * value for value in values)

    def size(self, c: dict[str, float], nominal) -> float:
        """Size of the effect as one number, in the unit of its ``floor``."""
        return abs(next(iter(c.values())))

    def doubt(self, c: dict[str, float], view) -> np.ndarray | float:
        """Voltage (b,) [V] by which any curve of the effect may be wrong, in addition to a share of its value."""
        return 0.0

    def late_s(self, c: dict[str, float], nominal) -> float:
        """Shift of the middle of every pulse [s] that the effect causes beside its own voltage."""
        return 0.0

    def lost_flux(self, view, c: dict[str, float]):
        """Missing flux linkage (b, m+1) complex dq [Wb] of currents that do not magnetise (only if ``takes_flux``)."""
        raise NotImplementedError

    def moved(self, c: dict[str, float], view) -> float:
        """Change of the effect over a recording, in units of ``size``; of a drift, its size."""
        return self.size(c, view.nominal)

    def possible(self, c: dict[str, float], covariance: np.ndarray, nominal) -> bool:
        """Whether the coefficients are physically possible within their uncertainty; covariance in their order."""
        return not self.positive or sum(c.values()) >= 0.0

    def corrected(self, view, c: dict[str, float]):
        """The view without this measurement error (only if ``corrects``)."""
        raise NotImplementedError

    def estimates(self, c: dict[str, float], covariance: np.ndarray, nominal) -> dict[str, Estimate]:
        """Parameters of the effect, {name: Estimate}, from its coefficients in the order of the covariance."""
        raise NotImplementedError

    def caveat(self, view, c: dict[str, float]) -> str:
        """What its estimates from coefficients c leave open in such a recording, as a sentence; "" if nothing."""
        return ""

    def relative(self, c: dict[str, dict], nominal) -> float:
        """Factor on the coefficients that follows from the other named effects; c: {effect: coefficients}."""
        return 1.0

    def given(self, view, plant) -> Column:
        """Column of this effect as the drive file's [plant] sections already describe it; plant: plant_of the file."""
        return {}

    def plant(self, c: dict[str, float], nominal) -> dict:
        """The effect as parameters of the plant, {"machine.resistance_ohm": 1.7, ...}."""
        return {}


class FluxEffect(Effect):
    """An effect that is a flux linkage of the machine, given as shapes per unit of its coefficients."""

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

    def psi(self, view, c) -> np.ndarray | float:
        """The effect's flux linkage, (b, m+1) complex dq [Wb]."""
        shapes = {**self.core_psi(view), **self.free_psi(view)}
        return sum(value * shapes[name] for name, value in c.items() if value)

    def delta_l(self, c) -> tuple[float, float]:
        """Its contribution to (L_d, L_q) [H]."""
        return 0.0, 0.0


def voltage(u) -> Column:
    """Column of a voltage needed in addition to the nominal one, (b, m) complex dq."""
    return {"u": u}


def flux(view, psi) -> Column:
    """Column of a flux linkage in addition to the nominal one, (b, m+1) complex dq."""
    return {"u": view.flux(psi), "torque": torque_of(view, psi, view.i)}


def current_error(view, error) -> Column:
    """Column of an error of the measured current, measured minus true, (b, m+1) complex dq."""
    psi = view.inductances(error)
    return {
        "u": -view.machine.resistance_ohm * 0.5 * (error[:, 1:] + error[:, :-1]) - view.flux(psi),
        "torque": -torque_of(view, psi, view.i) - torque_of(view, view.psi, error),
    }


def phase_error(view, error) -> Column:
    """Column of errors of the measured phase currents, (b, m+1, 3): also in their sum, where three are measured."""
    column = current_error(view, view.from_phases(error))
    if view.has_sum:
        total = error.sum(axis=2)
        column["sum"] = 0.5 * (total[:, 1:] + total[:, :-1])
    return column


def angle_error(view, delta) -> Column:
    """Column of an error of the measured angle, measured minus true, (b, m+1): it rotates every dq quantity."""
    turned = -1j * view.i
    psi = view.inductances(turned)
    return {
        "u": -view.flux((1j * view.psi + psi) * delta),
        "torque": -torque_of(view, psi * delta, view.i) - torque_of(view, view.psi, turned * delta),
    }


def zero_vector_slope(view):
    """Slope of the measured current in the zero vector, in dq at the angle of the valley, (b, m+1) [A/s]."""
    return slope_in_zero_vector(view.machine, view.i, view.omega, view.psi)


def torque_of(view, psi, i):
    """Air-gap torque of the intervals, (b, m) [Nm], from flux linkage and current at the samples."""
    torque = airgap_torque(view.machine, psi, i)
    return 0.5 * (torque[:, 1:] + torque[:, :-1])


def sigma(covariance, k=0) -> float:
    """Standard deviation of coefficient k."""
    return float(np.sqrt(max(covariance[k, k], 0.0)))


def one(name, unit, value, spread) -> dict[str, Estimate]:
    """{name: Estimate} of a single parameter."""
    return {name: Estimate(float(value), float(spread), unit)}


def plausible_range(limits, nominal) -> tuple[float, float]:
    """(least, largest) value of a usual drive; limits: an entry of ``Effect.plausible``."""
    reference = 1.0
    if len(limits) > 2:
        section, key = limits[2].split(".")
        reference = float(getattr(getattr(nominal, section), key))
    return limits[0] * reference, limits[1] * reference


def believable(estimate, limits, nominal) -> bool:
    """Whether an estimate is within what its effect declares as plausible, or doubtfully beyond it."""
    low, high = plausible_range(limits, nominal)
    doubt = DOUBT * estimate.sigma if np.isfinite(estimate.sigma) else 0.0
    return low - doubt <= estimate.value <= high + doubt
