# SPDX-License-Identifier: BSD-3-Clause
"""Switching plant: piecewise-constant gates, diodes, legs that float at zero current.

Between two edges every leg is in one of three modes: conducting with positive
or negative current (a Thevenin source, see `inverter`), or blocked at zero
current, with the voltage that keeps the current at zero.  Root finding locates the
instant at which the current of a conducting leg reaches zero.  A blocked leg starts
to conduct in the sub-step in which no such voltage exists any more.
"""

from fluxproof.plant import layout as L
from fluxproof.plant.inverter import switched_leg
from fluxproof.plant.jit import njit
from fluxproof.plant.kernel import accept, clear_means, refresh, sources, try_step
from fluxproof.plant.mechanics import IMPOSED_SPEED
from fluxproof.plant.transforms import clarke, inverse_clarke

ZERO_CURRENT_A = 1e-7  # smaller counts as zero: far below any sensor's resolution, far above rounding
_SHORTEST_S = 1e-13  # shorter remainders are dropped
_TRIAL_V = 100.0  # any voltage: the currents are nearly affine in it


@njit
def _trial(state, params, v, r, load, acceleration, step_s):
    """End state and currents of a step with the legs' sources v, r: (drive, step, moved)."""
    drive = sources(state, params, v, r, state[L.TORQUE], load, acceleration)
    step = try_step(state, params, drive, step_s)
    moved = state.copy()
    moved[L.LAMBDA_ALPHA], moved[L.LAMBDA_BETA] = step.lambda_alpha, step.lambda_beta
    moved[L.OMEGA_M], moved[L.THETA_M], moved[L.I_SHORT] = step.omega, step.theta, step.i_short
    refresh(moved, params)
    return drive, step, moved


@njit
def _replace(triple, k, value):
    """Copy of a 3-tuple with entry k replaced."""
    return (
        value if k == 0 else triple[0],
        value if k == 1 else triple[1],
        value if k == 2 else triple[2],
    )


@njit
def _settle_leg(state, params, v, r, k, low, high, slope, load, acceleration, step_s):
    """Source (v, r) of leg k at zero current, the other legs being fixed; blocked or not.

    If the current would become positive even at the low voltage, or negative even at
    the high one, the leg conducts; otherwise it has the voltage that gives zero current
    at the end of the step.
    """
    v_low, r_low = _replace(v, k, low[k]), _replace(r, k, slope[0][k])
    _, _, moved = _trial(state, params, v_low, r_low, load, acceleration, step_s)
    at_low = moved[L.I_A + k]
    if at_low >= 0.0:
        return v_low, r_low
    v_high, r_high = _replace(v, k, high[k]), _replace(r, k, slope[1][k])
    _, _, moved = _trial(state, params, v_high, r_high, load, acceleration, step_s)
    at_high = moved[L.I_A + k]
    if at_high <= 0.0:
        return v_high, r_high
    x_0, f_0, x_1, f_1 = low[k], at_low, high[k], at_high
    r_none = _replace(r, k, 0.0)
    for _ in range(6):
        x = x_1 - f_1 * (x_1 - x_0) / (f_1 - f_0)
        v_x = _replace(v, k, x)
        _, _, moved = _trial(state, params, v_x, r_none, load, acceleration, step_s)
        x_0, f_0, x_1, f_1 = x_1, f_1, x, moved[L.I_A + k]
        if abs(f_1) < 1e-3 * ZERO_CURRENT_A or f_1 == f_0:
            break
    return _replace(v, k, x_1), r_none


@njit
def _natural_voltage(state, params, load, acceleration, step_s):
    """Stator-frame voltage (alpha, beta) that keeps all currents at zero for a step."""
    none = (0.0, 0.0, 0.0)
    u_alpha = u_beta = 0.0
    for _ in range(3):
        _, _, m0 = _trial(state, params, _legs(u_alpha, u_beta), none, load, acceleration, step_s)
        _, _, m1 = _trial(state, params, _legs(u_alpha + _TRIAL_V, u_beta), none, load, acceleration, step_s)
        _, _, m2 = _trial(state, params, _legs(u_alpha, u_beta + _TRIAL_V), none, load, acceleration, step_s)
        a0, b0 = clarke(m0[L.I_A], m0[L.I_B], m0[L.I_C])
        if abs(a0) + abs(b0) < 1e-3 * ZERO_CURRENT_A:
            break
        a1, b1 = clarke(m1[L.I_A], m1[L.I_B], m1[L.I_C])
        a2, b2 = clarke(m2[L.I_A], m2[L.I_B], m2[L.I_C])
        aa, ba, ab, bb = a1 - a0, b1 - b0, a2 - a0, b2 - b0
        det = aa * bb - ab * ba
        u_alpha -= _TRIAL_V * (bb * a0 - ab * b0) / det
        u_beta -= _TRIAL_V * (aa * b0 - ba * a0) / det
    return u_alpha, u_beta


@njit
def _legs(alpha, beta):
    """Leg voltages with zero sum for a stator-frame voltage."""
    a, b, c = inverse_clarke(alpha, beta)
    return a, b, c


@njit
def _choose(state, params, low, high, slope, load, acceleration, step_s):
    """Sources (v, r) of the three legs for the coming step."""
    i = (state[L.I_A], state[L.I_B], state[L.I_C])
    v, r = low, slope[0]
    at_zero = unsure = 0
    which = 0
    for k in range(3):
        if abs(i[k]) <= ZERO_CURRENT_A:
            at_zero += 1
            if high[k] > low[k]:
                unsure += 1
                which = k
        elif i[k] < 0.0:
            v, r = _replace(v, k, high[k]), _replace(r, k, slope[1][k])
    if unsure == 0:
        return v, r
    if at_zero == 1:
        return _settle_leg(state, params, v, r, which, low, high, slope, load, acceleration, step_s)
    # No current anywhere: the star point may float as long as every leg can block.
    u_alpha, u_beta = _natural_voltage(state, params, load, acceleration, step_s)
    e = _legs(u_alpha, u_beta)
    first = second = 0
    for k in range(1, 3):
        if low[k] - e[k] > low[first] - e[first]:
            first = k
        if high[k] - e[k] < high[second] - e[second]:
            second = k
    if low[first] - e[first] <= high[second] - e[second]:
        return e, (0.0, 0.0, 0.0)
    # The legs with the highest and the lowest voltage conduct.
    third = 3 - first - second
    v = _replace(_replace(low, first, low[first]), second, high[second])
    r = _replace(slope[0], second, slope[1][second])
    if high[third] == low[third]:
        return v, r
    return _settle_leg(state, params, v, r, third, low, high, slope, load, acceleration, step_s)


@njit
def _first_crossing(before, after, low, high):
    """Conducting leg whose current passed zero earliest (by chord), or -1."""
    found, earliest = -1, 2.0
    for k in range(3):
        i_0, i_1 = before[L.I_A + k], after[L.I_A + k]
        if high[k] > low[k] and abs(i_0) > ZERO_CURRENT_A and abs(i_1) > ZERO_CURRENT_A and i_0 * i_1 < 0.0:
            fraction = i_0 / (i_0 - i_1)
            if fraction < earliest:
                found, earliest = k, fraction
    return found


@njit
def _locate(state, params, v, r, k, i_end, load, acceleration, step_s):
    """Duration [s] after which the current of leg k is zero (Illinois' false position)."""
    x_0, f_0, x_1, f_1 = 0.0, state[L.I_A + k], step_s, i_end
    x = step_s
    for _ in range(40):
        x = x_1 - f_1 * (x_1 - x_0) / (f_1 - f_0)
        _, _, moved = _trial(state, params, v, r, load, acceleration, x)
        f = moved[L.I_A + k]
        if abs(f) <= 0.1 * ZERO_CURRENT_A:
            break
        if f * f_1 < 0.0:
            x_0, f_0 = x_1, f_1
        else:
            f_0 *= 0.5
        x_1, f_1 = x, f
    return x


@njit
def _advance_constant(state, params, word, u_dc, load, acceleration, duration_s, period_s):
    """Advance with constant gates for duration_s, stopping at every zero crossing."""
    inv = params.inverter
    a_low, a_high, a_rp, a_rn = switched_leg(inv, word & 1, word & 8, u_dc)
    b_low, b_high, b_rp, b_rn = switched_leg(inv, word & 2, word & 16, u_dc)
    c_low, c_high, c_rp, c_rn = switched_leg(inv, word & 4, word & 32, u_dc)
    low, high = (a_low, b_low, c_low), (a_high, b_high, c_high)
    slope = ((a_rp, b_rp, c_rp), (a_rn, b_rn, c_rn))
    left = duration_s
    while left > _SHORTEST_S:
        # Equal parts, so that no very short step remains.
        step_s = left / max(1.0, -(-left // params.max_step_s))
        v, r = _choose(state, params, low, high, slope, load, acceleration, step_s)
        drive, step, moved = _trial(state, params, v, r, load, acceleration, step_s)
        k = _first_crossing(state, moved, low, high)
        if k >= 0:
            x = _locate(state, params, v, r, k, moved[L.I_A + k], load, acceleration, step_s)
            if x > _SHORTEST_S:
                step_s = x
                # The voltage of a blocked leg is recalculated for the shorter step.
                v, r = _choose(state, params, low, high, slope, load, acceleration, step_s)
                drive, step, moved = _trial(state, params, v, r, load, acceleration, step_s)
        accept(state, drive, step, step_s, period_s)
        refresh(state, params)
        left -= step_s


@njit
def advance_switching(state, params, edge_times, gate_words, u_dc, load, period_s, probe_s=-1.0):
    """Advance the state in place by one period of switched gates.

    edge_times: (n,) rising, within 0..period_s [s]; gate_words: (n,) integers,
    in force from their edge on (bits 0..2 upper a, b, c; 3..5 lower a, b, c).
    Before the first edge the word in state[GATES] applies.  u_dc [V].
    load: as in `advance_averaged`.  probe_s: instant at which the currents and
    the angle are copied to PROBE_A.. (an ADC trigger); negative means never.
    Raises ValueError when both gates of a leg are on.
    """
    acceleration, load_torque = 0.0, load
    if params.mechanics.mode == IMPOSED_SPEED:
        acceleration, load_torque = (load - state[L.OMEGA_M]) / period_s, 0.0
    clear_means(state)
    refresh(state, params)
    word, now = int(state[L.GATES]), 0.0
    for k in range(len(edge_times) + 1):
        until = min(edge_times[k], period_s) if k < len(edge_times) else period_s
        if until < now:
            raise ValueError("edge times must rise and must not be negative")
        if now <= probe_s < until or (probe_s == until and k == len(edge_times)):
            _advance_constant(state, params, word, u_dc, load_torque, acceleration, probe_s - now, period_s)
            state[L.PROBE_A], state[L.PROBE_B], state[L.PROBE_C] = state[L.I_A], state[L.I_B], state[L.I_C]
            state[L.PROBE_THETA_M] = state[L.THETA_M]
            now = probe_s
        _advance_constant(state, params, word, u_dc, load_torque, acceleration, until - now, period_s)
        now = until
        if k < len(edge_times):
            word = gate_words[k]
    state[L.GATES] = word
    state[L.TIME] += period_s
