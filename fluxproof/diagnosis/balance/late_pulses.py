# SPDX-License-Identifier: BSD-3-Clause
"""Samples that do not lie in the zero vector between the pulses see the ripple of the pulses.

A leg is high from (1 - d) / 2 to (1 + d) / 2 of its period, from whose begin to the share s it has been high for

    h(s) = clip(s - (1 - d) / 2, 0, d)

Pulses that are all late by tau: the samples lie at s = 1 - tau / T of the period before and see the flux
psi_r = (2/3) u_dc T sum_x [h_x(s) - s d_x] a^x beyond that of the mean voltage.

Currents that are sampled tau after the valley: at s = tau / T of the period they begin, (2/3) u_dc T sum_x h_x(s) a^x
beyond the slope of the zero vector; before the valley the same of the period that ends there, with opposite sign.
"""

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.ground.machine import current_of_flux
from fluxproof.plant.transforms import space_vector

ORDERS = (3.0, -3.0, 6.0, -6.0)  # electrical, at which the ripple differs from a mean voltage that is late
ENOUGH = 40  # blocks that are looked at
ALIKE = 1.1  # of the least remainder: instants within it are as good, as those that put the samples in one zero vector


def high(duty, at):
    """Periods (..., 3) for which legs of the duties are high up to the share ``at`` of a period."""
    return np.clip(at - 0.5 * (1.0 - duty), 0.0, duty)


def _current(view, legs):
    """Current (b, m+1) in dq [A] of legs that are high for (b, m+1, 3) periods."""
    volts = space_vector(legs) * view.u_dc.mean(axis=1)[:, None]
    psi, m = volts * view.sample_time_s * np.conj(view.turn), view.machine
    return current_of_flux(psi, m.inductance_d_h + view.delta_l[0], m.inductance_q_h + view.delta_l[1])


def late_ripple(view, late):
    """Ripple (b, m+1) [A] in dq that the samples see if all pulses come ``late`` (0 .. 1) periods late."""
    duty = view.duties[:, :-1]
    return _current(view, high(duty, 1.0 - late) - (1.0 - late) * duty)


def off_valley(view, after):
    """Current (b, m+1) [A] in dq of the pulses until samples ``after`` (-1/2 .. 1/2) periods off the valley."""
    if after >= 0.0:
        return _current(view, high(view.duties[:, 1:], after))
    return -_current(view, high(view.duties[:, :-1], -after))


def instant(view, name, tried, fine, seen) -> float:
    """Instant (periods) whose ripple leaves the least of the misfit, the same for all views of a recording.

    name: of the kind of instant; tried: instants (n,); fine: distance of those tried between two of them;
    seen: function (view, instant) -> voltage (b, m) that the samples add to the misfit.
    """
    if name not in view.memo:
        memo, step = view.memo, max(1, len(view) // ENOUGH)
        view = view.take(np.arange(0, len(view), step))
        turns = np.abs(view.theta[:, -1] - view.theta[:, 0]) / (2 * np.pi)
        waves = np.exp(1j * np.array(ORDERS)[:, None, None] * view.theta_mid)
        clear = np.abs(ORDERS)[:, None] * turns > 1.0
        found = misfit(view)["u"]

        def left(x):  # absolute values, since a dead time may be there at order 6
            return float(np.abs(((found - seen(view, x)) * waves).mean(axis=2))[clear].sum())

        first, coarse = _middle(tried, left), tried[1] - tried[0]
        memo[name] = _middle(first + np.arange(-coarse, coarse + fine, fine), left)
    return view.memo[name]


def _middle(tried, left) -> float:
    """The middle of neighbouring instants that leave about the least: of several, of those nearest to the centre.

    Of late pulses, those at both ends, whose samples are in a zero vector between the pulses, show no delay or one of a
    whole period.
    """
    rest = np.array([left(x) for x in tried])
    alike = np.flatnonzero(rest <= ALIKE * rest.min())
    best = alike[np.argmin(np.abs(alike - 0.5 * (len(tried) - 1)))]
    worse = np.setdiff1d(np.arange(len(tried)), alike)
    first = max(worse[worse < best], default=-1) + 1
    last = min(worse[worse > best], default=len(tried)) - 1
    return float(tried[first : last + 1].mean())
