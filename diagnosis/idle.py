"""Dead time where no current flows: it is there, but no curve of the loss over the current shows it.

Which edge of a pulse is late is up to the ripple then: the pulses come late by up to twice half the dead time, as late
gates or a skew would have them, and what is lost is that of the current in their middle, as less flux would have it.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.catalogue.dead_time import RIPPLE, WIDTHS
from fluxproof.diagnosis.fit import Model, Solution


def carries_none(view) -> bool:
    """Whether the currents of all blocks are within their ripple."""
    m, bus = view.machine, view.nominal.inverter.dc_bus_v
    reach = RIPPLE * view.sample_time_s * bus / min(m.inductance_d_h, m.inductance_q_h)
    return float(np.abs(view.i.mean(axis=1)).max()) < reach


def unseen_loss(view, effect, solutions) -> list[Solution]:
    """A dead time of the size that would do what solutions of one point without current say; none where none would.

    effect: dead_time of the catalogue.
    """
    nominal = view.nominal
    said = [v for s in solutions for v in (_of_timing(s, nominal), _of_flux(s, view))]
    losses = [v for v in said if effect.floor(nominal) < v < effect.ceiling(nominal)]
    if not losses or any(effect.name in s.model.names for s in solutions) or not carries_none(view):
        return []
    best = solutions[0]
    key = f"v_{WIDTHS[0]:g}"
    c, variance = {effect.name: {key: max(losses)}}, {effect.name: np.zeros((1, 1))}
    return [Solution(Model(frozenset([effect.name])), best.chi2, 1, best.rows, c, variance, best.score, view=view)]


def _of_timing(solution, nominal) -> float:
    """Loss of a leg [V] whose dead time makes the pulses as late as a solution says; 0 where it does not."""
    tau = max((solution.c[n]["tau"] for n in ("delay", "sampling_skew") if n in solution.c), default=0.0)
    return tau / nominal.sample_time_s * nominal.inverter.dc_bus_v


def _of_flux(solution, view) -> float:
    """Loss of a leg [V] that takes from the EMF what a solution says the magnets lack; 0 where they do not.

    In the middle of a pulse flows what the EMF drives in the half of the dead time by which that is late.
    """
    m, bus = view.machine, view.nominal.inverter.dc_bus_v
    c, emf = solution.c, float(np.abs(view.omega).mean()) * m.magnet_flux_wb
    share = c.get("magnet_flux", {}).get("delta_psi_m", 0.0) / m.magnet_flux_wb + c.get("udc_gain", {}).get("gain", 0.0)
    per_volt = 0.5 * view.sample_time_s / bus * emf / m.inductance_q_h / (WIDTHS[0] * m.rated_current_a)
    return float(np.sqrt(max(-share, 0.0) * emf / max(per_volt, 1e-30)))
