"""What the [plant] sections of a drive file add to its nominal machine: an improved drive as the nominal one.

The core's own sections hold a linear machine; saturation, iron loss, dead time and the like stand in [plant.machine] and
[plant.inverter].  They belong to the simulation, so that only what they leave is a misfit.  Each effect states its part
(``Effect.given``); the flux linkage is that of the plant, which saturates both axes together.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effect import flux
from fluxproof.diagnosis.improved_plant import plant_of
from fluxproof.plant import flux_from_currents, machine_params
from fluxproof.plant.jit import njit

BENDS = ("saturation_d_per_a2", "saturation_q_per_a2", "cross_saturation_wb_per_a2", "flux_map")  # keys of a flux


def described(view) -> dict[str, np.ndarray]:
    """Values {channel: array} that the [plant] sections add to those of the nominal machine (see effect.py)."""
    if not view.nominal.plant:
        return {}
    plant, out = plant_of(view.nominal), {}
    parts = [effect.given(view, plant) for effect in view.visible(CATALOGUE).values()]
    if any(key in view.nominal.plant.get("machine", {}) for key in BENDS):
        parts.append(bent(view, plant.machine))
    for part in parts:
        for channel, values in part.items():
            out[channel] = out.get(channel, 0.0) + values
    return out


def bent(view, machine):
    """Column of the plant's flux linkage beyond the nominal inductances, at the measured current."""
    exact = view.with_raw_current()
    psi = _fluxes(machine_params(machine), machine.magnet_flux_wb, exact.i.real, exact.i.imag)
    return flux(exact, psi - exact.nominal_psi - (machine.magnet_flux_wb - view.machine.magnet_flux_wb))


@njit
def _fluxes(m, psi_m, i_d, i_q):
    """Flux linkage of dq currents (b, n) [A] as complex (b, n) [Wb]."""
    out = np.empty(i_d.shape, np.complex128)
    for b in range(i_d.shape[0]):
        for n in range(i_d.shape[1]):
            psi_d, psi_q = flux_from_currents(m, psi_m, i_d[b, n], i_q[b, n])
            out[b, n] = psi_d + 1j * psi_q
    return out
