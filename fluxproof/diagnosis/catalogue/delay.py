# SPDX-License-Identifier: BSD-3-Clause
"""The duties take effect later than assumed: the voltage is that of an earlier row.

Either the mean of a period is late, as with a modulator that interpolates or registers that load at the carrier's peak,
or all pulses are, as with a carrier that is shifted against the trigger of the converters, and the samples see their
ripple; orders 3 and 6 show which.  As long as the samples stay in the zero vector between the pulses, nothing is seen,
so that usual gate drivers are harmless.  Around the delay of the recording the effect is linear: a chord as its
formula, a tangent, the tangent of the ripple alone (a filter in front of the converters delays it), and the share of
the torque's ripple that a transducer does not show.

At operating points there is no ripple.  A voltage that was measured through a filter is late as well, u / (1 + j omega
tau), and smaller by half of (omega tau)^2: the loss is a curve beside the delay.  Or the angle is late, from an
observer, a filter or an older message, so that all dq values are turned by omega tau.  Both follow omega^2 psi tau on
the d axis, and load tells them apart; as forms of one cause neither takes what the other leaves.
"""

import numpy as np

from fluxproof.diagnosis.balance.curves import parabola
from fluxproof.diagnosis.balance.late_pulses import instant, late_ripple
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.shaft import SHOWN
from fluxproof.diagnosis.effects import (
    DOUBT,
    Alternatives,
    Caveat,
    FreeCurve,
    MeasurementError,
    Parameter,
    angle_error,
    current_error,
    one,
    sigma,
    torque_of,
    voltage,
)
from fluxproof.diagnosis.ground import constants as k
from fluxproof.plant.transforms import linear_limit

MOST_PERIODS = 3.0  # periods; more than is possible, so that the iteration can return
TRIED, FINE = np.arange(1, 50) / 50, 0.002  # periods, of late pulses
NEAR = 0.15  # periods between a delay and that of its ripple: about a zero vector
STEP = 0.005  # periods on both sides of a delay, over which the slope of the ripple is taken
RIPPLE = 0.1  # share by which the ripple may be wrong: a filter of the currents rounds it
LATE = 0.5  # rad at the highest speed, by which a filter makes a voltage or an angle late
COUNT = "duty_applied_after_samples"
TIMES = ("tau", "gates", "shift")  # coefficients whose sum is the delay


def _smooth(view):
    """Stator-frame voltage of the intervals -1 .. m without noise, (b, m+2) [V]: a parabola in dq over the block.

    A current loop returns the converters' noise in the recorded voltage.  A column of the raw voltage would therefore
    contain the noise of the misfit, and moving the raw voltage would filter it.
    """
    turn = np.exp(1j * view.interval_angle)
    return parabola(view.u * np.conj(turn)) * turn


def _shifted(view, u, rows):
    """The voltage u (b, m+2) [V] of ``rows`` intervals earlier; at the ends of a block it turns on with the angle."""
    place = np.arange(u.shape[1]) - rows
    inside, angle = np.clip(place, 0, u.shape[1] - 1), view.interval_angle
    step = np.where(place < 0, angle[:, 1:2] - angle[:, :1], angle[:, -1:] - angle[:, -2:-1])
    return u[:, inside] * np.exp(1j * (place - inside) * step)


def _moved(view, share):
    """Change of the voltage (b, m+2) [V] if it is taken ``share`` periods earlier."""
    u, whole = _smooth(view), int(np.floor(share))
    part = share - whole
    return (1.0 - part) * _shifted(view, u, whole) + part * _shifted(view, u, whole + 1) - u


def _seen(view, at):
    """Voltage (b, m) [V] that the samples add to the misfit."""
    return current_error(view, late_ripple(view, at))["u"]


def _ripples(view):
    """Ripple (b, m+1) [A/s] per second of delay: the chord up to the delay of the recording, and the tangent there."""
    period = view.sample_time_s
    late = instant(view, "late_pulses", TRIED, FINE, _seen)
    a, b = max(late - STEP, 0.0), min(late + STEP, 1.0)
    return {
        "gates": late_ripple(view, late) / (late * period),
        "shift": (late_ripple(view, b) - late_ripple(view, a)) / ((b - a) * period),
    }


def _sampled(view):
    """(b, 1) whether the torque is measured: like the currents, it is a sample and has their ripple."""
    return np.isin(view.shaft, SHOWN)[:, None]


def _time(c):
    """Delay [s] of coefficients."""
    return sum(c.get(name, 0.0) for name in TIMES)


def _error(view, c):
    """Ripple (b, m+1) [A] that the samples see, or 0."""
    if not c.get("gates"):
        return np.zeros_like(view.i)
    columns = _ripples(view)
    return c.get("gates", 0.0) * columns["gates"] + (c.get("shift", 0.0) + c.get("filter", 0.0)) * columns["shift"]


class Delay(MeasurementError, FreeCurve, Alternatives, Caveat):
    one_of = (("tau", "loss"), ("angle",), ("gates", "shift", "filter", "torque"))

    def core(self, view):
        late = -view.to_dq(_moved(view, 1.0)[:, 1:-1]) / view.sample_time_s
        if not view.locked.any():
            return {"tau": voltage(late), "angle": angle_error(view, -view.omega)}
        return {"tau": voltage(late), "gates": self._pulses(view, late, "gates")}

    def free(self, view):
        if not view.locked.any():
            return {"loss": voltage(-(view.omega_mid**2) * view.to_dq(_smooth(view)[:, 1:-1]))}
        late = -view.to_dq(_moved(view, 1.0)[:, 1:-1]) / view.sample_time_s
        ripple = current_error(view, _ripples(view)["shift"])
        out = {"shift": self._pulses(view, late, "shift")}
        out["filter"] = {"u": ripple["u"], "torque": np.where(_sampled(view), 0.0, ripple["torque"])}
        if _sampled(view).any():  # unless the transducer is too slow for the ripple
            torque = current_error(view, _ripples(view)["gates"])["torque"]
            out["torque"] = {"torque": np.where(_sampled(view), torque, 0.0)}
        return out

    @staticmethod
    def _pulses(view, late, name):
        """Column of late pulses per second; late: that of a mean voltage that is late."""
        column = current_error(view, _ripples(view)[name])
        return {"u": column["u"] + late, "torque": np.where(_sampled(view), 0.0, column["torque"])}

    def floor(self, nominal):
        return 0.006 * nominal.sample_time_s

    def ceiling(self, nominal):
        return 2.5 * nominal.sample_time_s

    def size(self, c, nominal):
        return max(abs(_time(c)), abs(c.get("angle", 0.0)))

    def too_large(self, c, view):
        """The ripple is that of another delay: its columns fit something else."""
        late = _time(c) / view.sample_time_s
        other = c.get("gates") and not (0.0 < late < 1.0 and abs(late - view.memo["late_pulses"]) < NEAR)
        most = self.ceiling(view.nominal)
        if not view.locked.any():
            most = max(most, LATE / max(view.top_speed, 1e-9))
        return bool(other) or self.size(c, view.nominal) > most

    def possible(self, c, covariance, nominal):
        """A filter takes away amplitude and adds none."""
        loss = list(c).index("loss") if "loss" in c else None
        return loss is None or c["loss"] >= -DOUBT * sigma(covariance, loss)

    def curve_scale(self, key, cores, nominal):
        """A loss is that of a filter where it is half of the square of the angle."""
        per_speed = nominal.machine.magnet_flux_wb / linear_limit(nominal.inverter.dc_bus_v)
        return super().curve_scale(key, cores, nominal) * (per_speed if key == "loss" else 1.0)

    def doubt(self, c, view):
        seen = current_error(view, _error(view, c))["u"]
        return RIPPLE * np.sqrt(np.mean(np.abs(seen) ** 2, axis=1))

    def corrected(self, view, c):
        if c.get("angle"):
            return view.turned(-c["angle"] * view.omega)
        most = max(MOST_PERIODS, 0.0 if view.locked.any() else LATE / (view.top_speed * view.sample_time_s))
        late = float(np.clip(_time(c) / view.sample_time_s, -most, most))
        moved, error = view.replace(u=view.u + _moved(view, late)), _error(view, c)
        if c.get("loss"):
            kept = 1.0 - np.clip(c["loss"] * view.omega[:, :1] ** 2, -LATE, LATE)
            return moved.replace(u=moved.u / kept)
        if not error.any():
            return moved
        torque = torque_of(view, view.inductances(error), view.i - error) + torque_of(view, view.psi, error)
        seen = np.where(_sampled(view), 1.0 - c.get("torque", 0.0) / _time(c), 0.0)
        return moved.replace(
            i=view.i - parabola(error),
            i_raw=view.i_raw - view.stator(error),
            torque=view.torque - seen * torque,
        )

    def estimates(self, c, covariance, nominal):
        if c.get("angle"):
            return one("angle_late_s", "s", c["angle"], sigma(covariance, list(c).index("angle")))
        mine = [n for n, name in enumerate(c) if name in TIMES]
        return one("delay_s", "s", _time(c), np.sqrt(max(covariance[np.ix_(mine, mine)].sum(), 0.0)))

    def caveat(self, view, c):
        """At points with little load a late voltage and an early angle leave the same within twice the usual error."""
        if view.locked.any():
            return ""
        late = c.get("angle", 0.0) + _time(c)
        forms = ({"angle": late}, {"tau": late})
        left, other = (misfit(self.corrected(view, form))["u"].mean(axis=1) for form in forms)
        if np.mean(np.abs(left - other) ** 2) > (1.0 + k.FLOOR) * np.mean(np.square(view.balance_error())):
            return ""
        return "A late voltage and an early angle leave the same at these operating points: load tells them apart."

    def plant(self, c, nominal):
        return {"timing.angle_delay_s": c["angle"]} if c.get("angle") else {"timing.delay_s": _time(c)}


EFFECT = Delay(
    name="delay",
    title="delay of voltage or angle",
    equation="u(t) = u_recorded(t - tau), or of an operating point theta_measured = theta(t - tau)",
    signature="order 0: the voltage vector, or all of dq, rotated by omega tau; orders 3 and 6 of late gates",
    separated_by="two speeds, both directions; load at each; a step",
    parameters=(
        Parameter("delay_s", "s", f"beyond {COUNT}", "voltage later by", "voltage recorded late by", COUNT),
        Parameter("angle_late_s", "s", "behind the currents", "angle late by", "angle early by"),
    ),
    needs=("inverter",),
)
