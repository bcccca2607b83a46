"""Every block of the core, one line each: add yours here and the bench finds it."""

from golden_model.common import packet_fifo, reciprocal, sqrt
from golden_model.control import (
    chord_speed,
    current_pi,
    dead_time_compensation,
    decoupling,
    speed_pi,
    voltage_limit,
)
from golden_model.estimators import (
    applied_voltage,
    clean_voltage,
    current_model,
    current_directions,
    delta_lambda,
    flux_compensation,
    flux_estimate,
    flux_merge,
    flux_monitor,
    psi_adaline,
    speed_reciprocal,
    torque,
    v_dead_adaline,
    winding_resistance,
)
from golden_model.io import (
    current_conditioning,
    position,
    sample_latch,
    speed,
    telemetry,
    telemetry_words,
    u_dc_conditioning,
    u_dc_processing,
)
from golden_model.modulation import gate_generation, pwm_compare, svm, svm_delay_compensation
from golden_model.protection import fault_latch, sample_checks, sample_guard
from golden_model.transforms import clarke, flux_inverse_park, flux_park, inverse_park, park, rotate, sincos

BLOCKS = {
    module.BLOCK.name: module.BLOCK
    for module in (
        sqrt,
        reciprocal,
        sample_latch,
        current_conditioning,
        position,
        speed,
        u_dc_conditioning,
        u_dc_processing,
        clarke,
        sincos,
        rotate,
        park,
        speed_pi,
        current_pi,
        chord_speed,
        decoupling,
        voltage_limit,
        svm_delay_compensation,
        inverse_park,
        svm,
        pwm_compare,
        gate_generation,
        winding_resistance,
        applied_voltage,
        current_model,
        flux_inverse_park,
        flux_merge,
        flux_park,
        flux_estimate,
        speed_reciprocal,
        delta_lambda,
        flux_compensation,
        torque,
        flux_monitor,
        current_directions,
        dead_time_compensation,
        clean_voltage,
        v_dead_adaline,
        psi_adaline,
        packet_fifo,
        telemetry_words,
        telemetry,
        sample_guard,
        sample_checks,
        fault_latch,
    )
}
