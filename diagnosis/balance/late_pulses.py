"""Pulses that are late by a part of a period: the samples see their ripple.

A leg is high from (1 - d) / 2 to (1 + d) / 2 of its period.  Samples at the share s of that period see the flux

    psi_r(s) = (2/3) u_dc T sum_x [clip(s - (1 - d_x) / 2, 0, d_x) - s d_x] a^x,   s = 1 - late / T

beyond that of the mean voltage.  It is none as long as the samples stay in the zero vector between the pulses.
"""

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit

ORDERS = (3.0, -3.0, 6.0, -6.0)  # electrical, at which the ripple differs from a mean voltage that is late
COARSE, FINE = 0.02, 0.002  # periods between the delays that are tried
ALIKE = 1.1  # of the least remainder: delays within it are as good, as those that put the samples in one zero vector


def beyond_mean(duty, at):
    """Periods (..., 3) for which legs of the duties have been high at the share ``at`` of a period, beyond the mean."""
    return np.clip(at - 0.5 * (1.0 - duty), 0.0, duty) - at * duty


def ripple(view, late):
    """Ripple (b, m+1) [A] in dq that the samples see if all pulses come ``late`` (0 .. 1) periods late."""
    legs = beyond_mean(view.duties[:, :-1], 1.0 - late)
    volts = (2 / 3) * (legs @ np.exp(2j * np.pi / 3 * np.arange(3))) * view.u_dc.mean(axis=1)[:, None]
    psi, m = volts * view.sample_time_s * np.conj(view.turn), view.machine
    return psi.real / (m.inductance_d_h + view.delta_l[0]) + 1j * psi.imag / (m.inductance_q_h + view.delta_l[1])


def instant(view, seen) -> float:
    """Delay (periods) whose ripple leaves the least of the misfit, the same for all views of a recording.

    seen: function (ripple) -> voltage (b, m) that the samples add to the misfit.
    """
    if "late_pulses" not in view.memo:
        turns = np.abs(view.theta[:, -1] - view.theta[:, 0]) / (2 * np.pi)
        waves = np.exp(1j * np.array(ORDERS)[:, None, None] * view.theta_mid)
        clear = np.abs(ORDERS)[:, None] * turns > 1.0
        found = misfit(view)["u"]

        def left(late):  # absolute values, since a dead time may be there at order 6
            rest = found - seen(ripple(view, late))
            return float(np.abs((rest * waves).mean(axis=2))[clear].sum())

        first = _middle(np.arange(COARSE, 1.0 - 0.5 * COARSE, COARSE), left)
        view.memo["late_pulses"] = _middle(first + np.arange(-COARSE, COARSE + FINE, FINE), left)
    return view.memo["late_pulses"]


def _middle(tried, left) -> float:
    """The middle of neighbouring delays that leave about the least: of several, of those nearest to the centre.

    Samples in a zero vector between the pulses, at both ends, would show no delay or one of a whole period.
    """
    rest = np.array([left(late) for late in tried])
    alike = np.flatnonzero(rest <= ALIKE * rest.min())
    best = alike[np.argmin(np.abs(alike - 0.5 * (len(tried) - 1)))]
    worse = np.setdiff1d(np.arange(len(tried)), alike)
    first = max(worse[worse < best], default=-1) + 1
    last = min(worse[worse > best], default=len(tried)) - 1
    return float(tried[first : last + 1].mean())
