# SPDX-License-Identifier: BSD-3-Clause
"""The current inside PWM periods, between the samples of a run.

The samples lie in the valley, where the ripple is near zero.  Some periods of a run are therefore computed again from
their samples, each with probes at PROBES instants; the ripple is what is left of the straight line from the period's
first to its last value.
"""

from __future__ import annotations

import numpy as np

from fluxproof.plant import FREE, advance_switching, centred_gates, initial_state, layout, plant_params
from fluxproof.simulate.run import Run, inverter_of, machine_of
from golden_model.drive import Drive

PROBES, PERIODS = 48, 24


def ripple(drive: Drive, run: Run, end: int, span: int) -> dict:
    """Ripple of the phase currents in ``span`` samples before ``end``: {"t", "i_abc", "peak_to_peak_a", "rms_a"}.

    ``t`` (PROBES,) [s] and ``i_abc`` (PROBES, 3) [A] are those of the period with the largest ripple.
    """
    machine = machine_of(drive, run.scene.imposed)
    params = plant_params(machine, inverter_of(drive), mode=FREE)
    first = max(end - span, 1)
    worst, squares, shown = -1.0, [], None
    for k in np.unique(np.linspace(first, end - 1, PERIODS).astype(int)):
        t, i_abc = _period(drive, run, int(k), machine, params)
        line = i_abc[0] + np.outer(t / t[-1], i_abc[-1] - i_abc[0])
        rest = i_abc - line
        squares.append(np.mean(rest**2))
        size = float((rest.max(axis=0) - rest.min(axis=0)).max())
        if size > worst:
            worst, shown = size, (t, i_abc)
    rms = float(np.sqrt(np.mean(squares)))
    assert shown is not None  # PERIODS is positive
    return {"t": shown[0], "i_abc": shown[1], "peak_to_peak_a": worst, "rms_a": rms}


def _period(drive, run, k, machine, params):
    """Instants (PROBES,) [s] and phase currents (PROBES, 3) [A] of period ``k``."""
    period_s = drive.sample_time_s
    duties = run.compare[k - 1] / drive.carrier_half
    times, words = centred_gates(duties.astype(float), float(drive.inverter.dead_time_s), period_s)
    load = 0.0 if run.scene.imposed else float(run.scene.scenario.load[k])
    start = initial_state(
        machine, params, i_d=run["true_i_d"][k], i_q=run["true_i_q"][k], omega_m=run["true_omega_m"][k],
        theta_m=run["theta_me"][k] / machine.pole_pairs, gates=int(words[-1]),
    )  # fmt: skip
    t = np.linspace(0.0, period_s, PROBES)
    i_abc = np.empty((PROBES, 3))
    u_dc = float(run["true_u_dc"][k])
    for n, instant in enumerate(t):
        state = start.copy()
        advance_switching(state, params, times, words, u_dc, load, period_s, float(instant))
        i_abc[n] = state[layout.PROBE_A : layout.PROBE_C + 1]
    return t, i_abc
