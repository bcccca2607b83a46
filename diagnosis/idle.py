"""Dead time at zero current: it acts, but no curve of the loss over the current can show it.

The ripple then decides which edge of a pulse is late.  The pulses are late by up to the dead time, which resembles late
gates or a sampling skew; the loss at the current in the middle of the pulses resembles a smaller magnet flux.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.catalogue.dead_time import RIPPLE, WIDTHS
from fluxproof.diagnosis.fit import Model, Solution


def carries_none(view) -> bool:
    """Whether the currents of all blocks are within the ripple."""
    m, bus = view.machine, view.nominal.inverter.dc_bus_v
    reach = RIPPLE * view.sample_time_s * bus / min(m.inductance_d_h, m.inductance_q_h)
    return float(np.abs(view.i.mean(axis=1)).max()) < reach


def unseen_loss(view, effect, solutions) -> list[Solution]:
    """Solutions with a dead time that explains what the given solutions of a zero-current point explain; may be empty.

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
    """Loss of a leg [V] whose dead time explains the late pulses of a solution; 0 if it cannot."""
    tau = max((solution.c[n]["tau"] for n in ("delay", "sampling_skew") if n in solution.c), default=0.0)
    return tau / nominal.sample_time_s * nominal.inverter.dc_bus_v


def _of_flux(solution, view) -> float:
    """Loss of a leg [V] that explains the missing magnet flux of a solution; 0 if no flux is missing.

    The current in the middle of a pulse is what the EMF drives during the half dead time by which the pulse is late.
    """
    m, bus = view.machine, view.nominal.inverter.dc_bus_v
    c, emf = solution.c, float(np.abs(view.omega).mean()) * m.magnet_flux_wb
    share = c.get("magnet_flux", {}).get("delta_psi_m", 0.0) / m.magnet_flux_wb + c.get("udc_gain", {}).get("gain", 0.0)
    per_volt = 0.5 * view.sample_time_s / bus * emf / m.inductance_q_h / (WIDTHS[0] * m.rated_current_a)
    return float(np.sqrt(max(-share, 0.0) * emf / max(per_volt, 1e-30)))
