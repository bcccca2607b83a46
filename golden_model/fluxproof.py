"""The whole core, one sample at a time: twin of rtl/fluxproof.vhd.

Raw sample -> conditioning -> transforms -> control -> modulation -> compare values.  The gates themselves
run at the clock and stand in modulation/gate_generation.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.control import current_model, current_pi, decoupling, speed_pi, voltage_limit
from golden_model.io import (
    current_conditioning,
    position,
    sample_latch,
    speed,
    u_dc_conditioning,
    u_dc_processing,
)
from golden_model.kernel import kernel
from golden_model.modulation import gate_generation, pwm_compare, svm, svm_delay_compensation
from golden_model.transforms import clarke, inverse_park, park, sincos

# Instance of the top -> (its block, the instances it waits for).  Blocks start when the last of these is done.
WIRING = {
    "latch": (sample_latch, ()),
    "conditioning": (current_conditioning, ("latch",)),
    "angle": (position, ("latch",)),
    "speed_measurement": (speed, ("latch",)),
    "bus_voltage": (u_dc_conditioning, ("latch",)),
    "bus_reciprocal": (u_dc_processing, ("bus_voltage",)),
    "stator_frame": (clarke, ("conditioning",)),
    "trig": (sincos, ("angle",)),
    "rotor_frame": (park, ("stator_frame", "trig")),
    "speed_regulator": (speed_pi, ("speed_measurement",)),
    "current_regulators": (current_pi, ("rotor_frame", "speed_regulator")),
    "flux_model": (current_model, ("rotor_frame",)),
    "cross_coupling": (decoupling, ("flux_model", "speed_measurement")),
    "circle": (voltage_limit, ("current_regulators", "cross_coupling", "bus_voltage")),
    "delay": (svm_delay_compensation, ("angle", "speed_measurement")),
    "trig_out": (sincos, ("delay",)),
    "stator_voltage": (inverse_park, ("circle", "trig_out")),
    "modulator": (svm, ("stator_voltage", "bus_reciprocal")),
    "compare": (pwm_compare, ("modulator",)),
}


MODULES = (*dict.fromkeys(module for module, _ in WIRING.values()), gate_generation)


def schedule() -> dict[str, tuple[int, int]]:
    """{instance: (first clock, last clock)} since the raw sample, from the declared latencies alone."""
    times: dict[str, tuple[int, int]] = {}
    for instance, (module, awaited) in WIRING.items():
        first = max((times[name][1] for name in awaited), default=0)
        times[instance] = (first, first + module.BLOCK.latency)
    return times


SAMPLE_TO_DUTY = schedule()["modulator"][1]
SAMPLE_INTERVAL = max(last for _, last in schedule().values()) + 1  # no sample enters while one is in flight

REGISTERS = {p.name: p for module in MODULES for p in module.BLOCK.registers}
Registers = namedtuple("Registers", list(REGISTERS))


class Config(NamedTuple):
    """The generics of the top entity."""

    adc_bits: int = 16
    position_bits: int = 16
    carrier_half: int = 10000


class Sample(NamedTuple):
    """What the core takes in at one sampling instant; formats as in io/sample_latch."""

    adc_a: int
    adc_b: int
    adc_c: int
    adc_u_dc: int
    position_code: int
    omega_ref: int
    i_d_ref: int
    i_q_ext: int
    speed_mode: int
    run: int


class State(NamedTuple):
    of_speed: speed.State = speed.State()
    of_speed_pi: speed_pi.State = speed_pi.State()
    of_current_pi: current_pi.State = current_pi.State()
    of_voltage_limit: voltage_limit.State = voltage_limit.State()
    sat_d: int = 0
    sat_q: int = 0


class Observed(NamedTuple):
    """Every intermediate value that the top entity shows, in the order of its ports."""

    i_a: int
    i_b: int
    i_c: int
    current_at_rail: int
    u_dc: int
    u_max: int
    u_dc_at_rail: int
    u_dc_low: int
    theta_me: int
    omega_me: int
    i_d: int
    i_q: int
    i_q_ref: int
    speed_limited: int
    lambda_d: int
    lambda_q: int
    u_dec_d: int
    u_dec_q: int
    u_int_d: int
    u_int_q: int
    u_d: int
    u_q: int
    sat_d: int
    sat_q: int
    u_alpha: int
    u_beta: int
    duty_a: int
    duty_b: int
    duty_c: int
    compare_a: int
    compare_b: int
    compare_c: int


@kernel
def step(state, sample, regs, config):
    """One control period: (next state, Observed)."""
    x, r, c = sample, regs, config
    i_a, i_b, i_c, current_at_rail = current_conditioning.step(
        x.adc_a,
        x.adc_b,
        x.adc_c,
        r.offset_a,
        r.offset_b,
        r.offset_c,
        r.gain_a,
        r.gain_b,
        r.gain_c,
        c.adc_bits,
    )
    (theta_me,) = position.step(x.position_code, r.reverse, r.pole_pairs, r.theta_offset, c.position_bits)
    speed_state, (omega_me,) = speed.step(
        state.of_speed, x.position_code, r.reverse, r.k_speed, r.k_filter, c.position_bits
    )
    u_dc, u_max, u_dc_at_rail = u_dc_conditioning.step(
        x.adc_u_dc, r.u_dc_offset, r.u_dc_gain, r.k_u_max, c.adc_bits
    )
    m, m_beta, n, u_dc_low = u_dc_processing.step(u_dc)

    i_alpha, i_beta = clarke.step(i_a, i_b, i_c)
    cos_theta, sin_theta = sincos.step(theta_me)
    i_d, i_q = park.step(i_alpha, i_beta, cos_theta, sin_theta)

    speed_pi_state, (i_q_ref, speed_limited) = speed_pi.step(
        state.of_speed_pi,
        x.omega_ref,
        omega_me,
        x.i_q_ext,
        x.speed_mode,
        x.run,
        r.speed_kp,
        r.speed_ki,
        r.i_max,
    )
    current_pi_state, (u_pi_d, u_pi_q, u_int_d, u_int_q) = current_pi.step(
        state.of_current_pi,
        i_d,
        i_q,
        x.i_d_ref,
        i_q_ref,
        state.sat_d,
        state.sat_q,
        x.run,
        r.kp_d,
        r.ki_d,
        r.kp_q,
        r.ki_q,
    )
    lambda_d, lambda_q = current_model.step(i_d, i_q, r.l_d, r.l_q, r.lambda_mg)
    u_dec_d, u_dec_q = decoupling.step(omega_me, lambda_d, lambda_q)
    voltage_limit_state, (u_d, u_q, sat_d, sat_q) = voltage_limit.step(
        state.of_voltage_limit, u_pi_d, u_pi_q, u_dec_d, u_dec_q, u_max
    )

    (theta_out,) = svm_delay_compensation.step(theta_me, omega_me, r.k_delay)
    cos_out, sin_out = sincos.step(theta_out)
    u_alpha, u_beta = inverse_park.step(u_d, u_q, cos_out, sin_out)
    duty_a, duty_b, duty_c = svm.step(u_alpha, u_beta, m, m_beta, n)
    compare_a, compare_b, compare_c = pwm_compare.step(duty_a, duty_b, duty_c, r.min_pulse, c.carrier_half)

    following = State(speed_state, speed_pi_state, current_pi_state, voltage_limit_state, sat_d, sat_q)
    return following, Observed(
        i_a, i_b, i_c, current_at_rail, u_dc, u_max, u_dc_at_rail, u_dc_low, theta_me, omega_me, i_d, i_q,
        i_q_ref, speed_limited, lambda_d, lambda_q, u_dec_d, u_dec_q, u_int_d, u_int_q, u_d, u_q, sat_d, sat_q,
        u_alpha, u_beta, duty_a, duty_b, duty_c, compare_a, compare_b, compare_c,
    )  # fmt: skip


OBSERVED = {
    p.name: p
    for module in (sample_latch, *MODULES)
    for p in module.BLOCK.outputs
    if p.name in Observed._fields
}
