"""The golden model in compiled loops: the controller alone, and closed over the averaged plant."""

from __future__ import annotations

import numpy as np

from golden_model import fluxproof
from golden_model.kernel import CACHE_DIR, kernel
from plant import advance_averaged
from plant import layout as L
from plant.jit import SOURCE_HASH
from plant.sensors import current_code, position_code, u_dc_code

BOTH = CACHE_DIR.parent / f"{CACHE_DIR.name}-{SOURCE_HASH}"


def mixed_kernel(function):
    """A kernel that calls the golden model and the plant."""
    return kernel(function, BOTH)


@kernel
def run_controller(state, samples, registers, config, observed):
    """``samples`` (n, 11) in, ``observed`` (n, len(Observed)) out, both int64; returns the last state."""
    for k in range(samples.shape[0]):
        x = samples[k]
        sample = fluxproof.Sample(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10])
        state, out = fluxproof.step(state, sample, registers, config)
        for n, value in enumerate(out):
            observed[k, n] = value
    return state


@mixed_kernel
def run_averaged(
    state, references, u_dc, load, registers, config, plant_state, plant_params, sensors, period_s, out
):
    """Closed loop over the averaged plant; the duties of a sample act in the next period.

    ``references`` (n, 4) int64: omega_ref, i_d_ref, i_q_ext, speed_mode; ``u_dc`` [V], ``load`` [Nm] (n,).
    ``out`` (n, 8) float64 receives i_d, i_q [A], lambda_d, lambda_q [Wb], omega_m [rad/s], torque [Nm] before the
    period, and u_alpha, u_beta [V] during it.  Returns the controller's last state.
    """
    duties = np.full(3, 0.5)
    for k in range(load.shape[0]):
        out[k, 0], out[k, 1] = plant_state[L.I_D], plant_state[L.I_Q]
        out[k, 2], out[k, 3] = plant_state[L.LAMBDA_D], plant_state[L.LAMBDA_Q]
        out[k, 4], out[k, 5] = plant_state[L.OMEGA_M], plant_state[L.TORQUE]
        sample = fluxproof.Sample(
            current_code(sensors, 0, plant_state[L.I_A], k),
            current_code(sensors, 1, plant_state[L.I_B], k),
            current_code(sensors, 2, plant_state[L.I_C], k),
            u_dc_code(sensors, u_dc[k], k),
            position_code(sensors, plant_state[L.THETA_M], k),
            references[k, 0],
            references[k, 1],
            references[k, 2],
            references[k, 3],
            0,
            1,
        )
        state, seen = fluxproof.step(state, sample, registers, config)
        advance_averaged(plant_state, plant_params, duties, u_dc[k], load[k], period_s)
        out[k, 6], out[k, 7] = plant_state[L.U_ALPHA], plant_state[L.U_BETA]
        duties[0] = seen.compare_a / config.carrier_half
        duties[1] = seen.compare_b / config.carrier_half
        duties[2] = seen.compare_c / config.carrier_half
    return state
