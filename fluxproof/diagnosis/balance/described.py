# SPDX-License-Identifier: BSD-3-Clause
"""What a drive file describes beyond a linear machine: an improved drive given back as the drive to diagnose.

Saturation, iron loss, dead time and the like stand in [machine], [plant.machine] and [plant.inverter].  They belong to
the simulation, so that only what they leave is a misfit.  Each effect of the view's catalogue states its part
(``Effect.given``); the flux linkage is that of the plant, which saturates both axes together.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from fluxproof.diagnosis.effects import Described, flux
from fluxproof.diagnosis.ground.plant_section import plant_of
from fluxproof.plant import flux_from_currents, machine_params
from fluxproof.plant.jit import njit

LOSSES = ("iron_conductance_s",)  # further keys of [machine] beyond a linear machine
BENDS = ("saturation_d_per_a2", "saturation_q_per_a2", "cross_saturation_wb_per_a2", "flux_map")  # keys of a flux


def described(view) -> dict[str, np.ndarray]:
    """Values {channel: array} that the drive file adds to those of its linear machine (see effects/columns.py)."""
    if not view.nominal.plant and not any(getattr(view.machine, key, None) for key in BENDS + LOSSES):
        return {}
    if not view.catalogue:
        raise ValueError("a view of a drive file with physics beyond a linear machine needs the catalogue of effects")
    plant, out = plant_of(view.nominal), {}
    effects = [effect for effect in view.visible(view.catalogue).values() if isinstance(effect, Described)]
    parts = [effect.given(view, plant) for effect in effects]
    if any(getattr(plant.machine, key) for key in BENDS):
        parts.append(bent(view, plant.machine))
    for part in parts:
        for channel, values in part.items():
            out[channel] = out.get(channel, 0.0) + values
    return out


def bent(view, machine):
    """Column of the plant's flux linkage beyond the nominal inductances, at the measured current."""
    exact, m = view.with_raw_current(), view.machine
    # Constants that [plant.machine] replaces are effects of their own, relative to [machine].
    machine = dataclasses.replace(
        machine,
        inductance_d_h=m.inductance_d_h,
        inductance_q_h=m.inductance_q_h,
        magnet_flux_wb=m.magnet_flux_wb,
    )
    psi = _fluxes(machine_params(machine), m.magnet_flux_wb, exact.i.real, exact.i.imag)
    return flux(exact, psi - exact.nominal_psi)


@njit
def _fluxes(m, psi_m, i_d, i_q):
    """Flux linkage of dq currents (b, n) [A] as complex (b, n) [Wb]."""
    out = np.empty(i_d.shape, np.complex128)
    for b in range(i_d.shape[0]):
        for n in range(i_d.shape[1]):
            psi_d, psi_q = flux_from_currents(m, psi_m, i_d[b, n], i_q[b, n])
            out[b, n] = psi_d + 1j * psi_q
    return out
