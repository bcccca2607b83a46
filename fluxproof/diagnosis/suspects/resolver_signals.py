# SPDX-License-Identifier: BSD-3-Clause
"""A resolver whose sine and cosine have different amplitudes or are not at right angles.

With as many pole pairs as the machine it is wrong twice per electrical turn.  Of amplitudes that differ by the share a,
and an angle between the windings that is wrong by q, the error is a/2 sin(2 theta_e) + q/2 cos(2 theta_e), beside a
constant q/2 that is an offset.  The mean of the angle over some samples (blocks.py) keeps a part of it, less at higher
speed.
"""

import numpy as np

from fluxproof.diagnosis.balance.quantised_angle import mean_of_wave
from fluxproof.diagnosis.balance.view import HALF_WIDTH
from fluxproof.diagnosis.effects import MeasurementError, Orders, Parameter, angle_error, one


def _waves(view):
    kept = mean_of_wave(view.omega * view.sample_time_s / np.pi, 2 * HALF_WIDTH + 1)
    return {"sin": kept * np.sin(2.0 * view.theta), "cos": kept * np.cos(2.0 * view.theta)}


class ResolverSignals(MeasurementError):
    def core(self, view):
        return {name: angle_error(view, wave) for name, wave in _waves(view).items()}

    def floor(self, nominal):
        return 0.003

    def ceiling(self, nominal):
        return 0.3

    def size(self, c, nominal):
        return float(np.hypot(c["sin"], c["cos"]))

    def corrected(self, view, c):
        return view.turned(sum(c[name] * wave for name, wave in _waves(view).items()))

    def estimates(self, c, covariance, nominal):
        spread = float(np.sqrt(0.5 * np.trace(covariance[:2, :2])))
        return one("amplitude_rad", "rad", self.size(c, nominal), spread)


EFFECT = ResolverSignals(
    name="resolver_signals",
    title="resolver with unequal signals",
    clause="the angle came from a resolver with unequal sine and cosine",
    equation="theta_measured = theta_e + a sin(2 theta_e) + b cos(2 theta_e)",
    signature="orders 2 and -2, proportional to speed, without current too",
    separated_by="rotation at zero current at two speeds; amplitudes of sine and cosine over a turn",
    plausible={"amplitude_rad": (0.0, 0.1)},  # signals that differ by a fifth
    otherwise="the rotor is eccentric",
    parameters=(Parameter("amplitude_rad", "rad", "electrical, twice per electrical turn", "amplitude"),),
    needs=("harmonics", "angle"),
    shows_at=Orders((2.0, -2.0)),
)
