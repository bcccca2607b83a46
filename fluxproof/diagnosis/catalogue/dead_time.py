# SPDX-License-Identifier: BSD-3-Clause
"""Voltage loss of the inverter: dead time and device drops, and how both vanish near zero current.

It depends on the current at the switching edges, not on the sampled one.  The two edges of a pulse see the ripple with
opposite signs, so that their mean is the current in the middle of the pulse, half a dead time after the sample.  On a
drive with a small inductance, the sampled current instead would leave a voltage perpendicular to the current, which
looks like a wrong L_d.  The free curve is made of bumps: a ramp between two other ramps is nearly their mean.
"""

from collections.abc import Callable

import numpy as np

from fluxproof.diagnosis.effects import (
    DOUBT,
    Caveat,
    Described,
    FreeCurve,
    LegLoss,
    Orders,
    Parameter,
    voltage,
    zero_vector_slope,
)
from fluxproof.diagnosis.ground.result import Estimate

# No width is so large that the curve would resemble a resistance over most of the current range: one that no recorded
# current leaves would be one.
WIDTHS = (0.02, 0.12)  # of rated current: where the loss of the core has reached its full value
KNOTS = (0.0, 0.005, 0.02, 0.05, 0.12)  # of rated current: ends of the bumps of the free curve
DROP = 0.05  # of rated current: where device drops have reached their full value
STILL_GROWS = (0.12, 0.3)  # of rated current: growth beyond this range counts as resistance
RIPPLE = 1 / 32  # of u_dc T / L: a quarter of the largest current ripple
TOLD = 0.05  # of the winding resistance: a steeper rise of the loss is reported, because it looks like resistance
CLAMPED = 0.1  # uncertainty, as a share of the loss, while ripple decides which diode conducts


def _currents(view):
    """Phase currents (b, m, 3) [A] in the middle of the pulses: the mean over the two switching edges of a leg.

    The measured current is used, since the instant of its zero crossing matters; the mean of an interval's two samples
    is uncorrelated with their difference, which is the noise of the misfit.  One edge of every pulse is late by the
    whole dead time, whatever the sign of the current: the converters sample half a dead time before the middle of the
    zero vector, and the current continues with its slope there.
    """
    exact = view.with_raw_current()
    return view.phases(exact.replace(i=exact.i + view.late_s * zero_vector_slope(view)).i_mid)


def _leg_losses(view, shapes):
    """Losses {name: column} of the legs in dq, each an odd function of the phase current in per unit of rated."""
    x = _currents(view) / view.machine.rated_current_a
    return {name: voltage(view.from_phases(shape(x))) for name, shape in shapes.items()}


def _following_bus(view, columns):
    """The columns at the recorded bus voltage: the loss due to dead time is proportional to it."""
    factor = view.u_dc / view.nominal.inverter.dc_bus_v
    return {name: voltage(column["u"] * factor) for name, column in columns.items()}


def _ramp(width) -> Callable:
    return lambda x: np.clip(x / width, -1.0, 1.0)


def _bump(knot) -> Callable:
    k = KNOTS.index(knot)
    return lambda x: np.sign(x) * np.interp(np.abs(x), KNOTS[k - 1 : k + 2], (0.0, 1.0, 0.0))


# {coefficient: loss of a leg as a function of its current in per unit of rated}
WIDTH_OF = {f"v_{w:g}": w for w in WIDTHS}
RAMPS = {key: _ramp(w) for key, w in WIDTH_OF.items()}
# Bumps instead of more ramps: a ramp between two others is nearly their mean.
BUMPS = {f"bump_{knot:g}": _bump(knot) for knot in KNOTS[1:-1] if knot not in WIDTHS}
# Beyond the last knot: growth of any device, a drop in log(i), a commutation loss in 1/i.
TAILS = {
    "growth": lambda x: np.sign(x) * np.interp(np.abs(x), STILL_GROWS, (0.0, 1.0)),
    "log": lambda x: np.sign(x) * np.log(np.maximum(np.abs(x) / KNOTS[-1], 1.0)),
    "fade": lambda x: np.sign(x) * (1.0 - KNOTS[-1] / np.maximum(np.abs(x), KNOTS[-1])),
}
DROPS = {"drop": _ramp(DROP)}  # of devices, which do not depend on the bus voltage
SHAPES: dict[str, Callable] = {**RAMPS, **BUMPS, **TAILS, **DROPS}


def _at(c, x):
    """Weights of the coefficients in the loss at a current x, per unit of rated, in their order."""
    return np.array([float(SHAPES[key](x)) for key in c])


def full_loss(c) -> float:
    """Voltage loss at rated current [V] of coefficients c; the bumps only shape the curve near zero current."""
    return float(sum(v * SHAPES[key](1.0) for key, v in c.items()))


def _rise(c) -> float:
    """Growth of the loss [V] from the last knot to rated current."""
    return sum(c.get(key, 0.0) * TAILS[key](1.0) for key in ("log", "fade", "growth"))


def _half_late(loss, nominal) -> float:
    """Shift of a pulse's middle [s] by a loss [V]: one edge is late by the whole dead time, the middle by half."""
    return 0.5 * abs(loss) / nominal.inverter.dc_bus_v * nominal.sample_time_s


def _ramps_left(view) -> dict[str, Callable]:
    """The ramps that some recorded current leaves, at least the narrowest.

    Decided once for all views of a recording: corrected currents must not change the set of coefficients.
    """
    largest = view.memo.setdefault("ramps", float(np.abs(view.i).max()) / view.machine.rated_current_a)
    return {key: RAMPS[key] for key, width in WIDTH_OF.items() if width < largest or width == WIDTHS[0]}


class DeadTime(LegLoss, FreeCurve, Caveat, Described):
    def core(self, view):
        return _following_bus(view, _leg_losses(view, _ramps_left(view)))

    def free(self, view):
        out = _following_bus(view, _leg_losses(view, BUMPS | TAILS))
        if np.ptp(view.u_dc.mean(axis=1)) > 0.04 * view.nominal.inverter.dc_bus_v:
            out |= _leg_losses(view, DROPS)
        return out

    def possible(self, c, covariance, nominal):
        """A leg loses voltage at every current: noise around zero current would also fit a gain there.

        Within the ripple of the current a pulse may end as if the current had either sign: there a gain up to the full
        loss is possible.
        """
        values, full = np.array(list(c.values())), _at(c, 1.0)
        reach = self.reach(c, nominal) / nominal.machine.rated_current_a
        most = abs(full @ values)
        for weights, least in ((full, 0.0), *((_at(c, x), -most if x <= reach else 0.0) for x in KNOTS[1:])):
            if weights @ values < least - DOUBT * np.sqrt(max(weights @ covariance @ weights, 0.0)):
                return False
        return True

    def late_s(self, c, nominal):
        return _half_late(full_loss(c), nominal)

    def floor(self, nominal):
        return 0.0002 * nominal.inverter.dc_bus_v

    def relevant(self, nominal):
        return 0.001 * nominal.inverter.dc_bus_v

    def ceiling(self, nominal):
        return 0.15 * nominal.inverter.dc_bus_v

    def size(self, c, nominal):
        return abs(full_loss(c))

    def doubt(self, c, view):
        """While the current is within its ripple or its shift by the dead time, the loss is no function of it."""
        within = np.abs(_currents(view)) < self.reach(c, view.nominal)
        return CLAMPED * self.size(c, view.nominal) * np.mean(within, axis=(1, 2))

    def reach(self, c, nominal) -> float:
        """Current [A] within which its ripple and its shift by the dead time decide the loss."""
        m, volts = nominal.machine, RIPPLE * nominal.inverter.dc_bus_v + 0.5 * self.size(c, nominal)
        return nominal.sample_time_s * volts / min(m.inductance_d_h, m.inductance_q_h)

    def estimates(self, c, covariance, nominal):
        at_full = _at(c, 1.0)
        # A loss that still grows towards rated current may belong to a resistance.
        spread = float(np.hypot(np.sqrt(max(at_full @ covariance @ at_full, 0.0)), _rise(c)))
        return {"v_dead_v": Estimate(full_loss(c), spread, "V")}

    def caveat(self, view, c):
        m, last = view.machine, KNOTS[-1]
        ohm = 4 / np.pi * _rise(c) / ((1.0 - last) * m.rated_current_a)  # of the fundamental of the leg's voltage
        if ohm < TOLD * m.resistance_ohm:
            return ""
        rises = f"The loss of the inverter rises by {_rise(c):.2g} V from {last:g} of rated current to rated current"
        return f"{rises}; a resistance {ohm:.2g} Ohm larger looks the same, and only a measured one separates them."

    def given(self, view, plant):
        loss = plant.inverter.dead_time_s * view.nominal.inverter.pwm_frequency_hz * view.nominal.inverter.dc_bus_v
        if not view.nominal.plant.get("inverter", {}).get("dead_time_s"):
            return {}  # in the core's own section it is a command to the gates, which the duties may contain
        width = max(plant.inverter.zero_current_a / view.machine.rated_current_a, 1e-3)
        late = view.replace(late_s=view.late_s + _half_late(loss, view.nominal))
        column = _leg_losses(late, {"all": lambda x: loss * _ramp(width)(x)})
        return _following_bus(late, column)["all"]

    def plant(self, c, nominal):
        v_dead = max(0.0, full_loss(c))
        ramps = {width: abs(c.get(key, 0.0)) for key, width in WIDTH_OF.items()}
        zone = sum(w * v for w, v in ramps.items()) / max(sum(ramps.values()), 1e-12)
        return {
            "inverter.dead_time_s": v_dead / nominal.inverter.dc_bus_v / nominal.inverter.pwm_frequency_hz,
            "inverter.zero_current_a": zone * nominal.machine.rated_current_a,
        }


EFFECT = DeadTime(
    name="dead_time",
    title="dead time of the inverter",
    equation="u_x = u_x,ref - v_dead s(i_x), s odd, s = 1 above a small current",
    signature="order 0 in phase with the current, (4/pi) v_dead, and orders 6 and 12; independent of the speed",
    separated_by="several currents, i_q reversed; another bus voltage or PWM frequency separates dead time from drops",
    parameters=(
        Parameter("v_dead_v", "V", "loss of a leg at full current, device drops included", "dead-time voltage"),
    ),
    plausible={"v_dead_v": (0.0, 0.06, "inverter.dc_bus_v")},
    otherwise="the dead time is already compensated by the recorded duties, or the bus voltage is wrong",
    needs=("inverter",),
    shows_at=Orders((0.0, 6.0, 12.0, 18.0), trailing=(12.0, 18.0, 24.0)),
)
