# SPDX-License-Identifier: BSD-3-Clause
"""The four ways in which physics enters the voltage balance, as columns: {channel: array} per unit of a coefficient.

The misfit of a channel is the recorded value minus the one that the nominal drive needs:

    u       mean stator voltage of an interval in dq, complex (b, m) [V]
    sum     i_a + i_b + i_c at the samples' middle, real (b, m) [A]
    torque  torque at the shaft, real (b, m) [Nm]
"""

from __future__ import annotations

from typing import NamedTuple

from fluxproof.diagnosis.ground.machine import airgap_torque, slope_in_zero_vector

Column = dict  # channel -> array


class Wave(NamedTuple):
    """Key of a coefficient that belongs to a wave over the turn."""

    order: int
    part: str  # "cos", "sin"; of forward and backward waves "fc", "fs", "bc", "bs"


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
