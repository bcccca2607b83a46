"""Every block of the core, one line each: add yours here and the bench finds it."""

from golden_model.common import sqrt
from golden_model.control import current_model, current_pi, decoupling, speed_pi, voltage_limit
from golden_model.io import (
    current_conditioning,
    position,
    sample_latch,
    speed,
    u_dc_conditioning,
    u_dc_processing,
)
from golden_model.modulation import gate_generation, pwm_compare, svm, svm_delay_compensation
from golden_model.transforms import clarke, inverse_park, park, rotate, sincos

BLOCKS = {
    module.BLOCK.name: module.BLOCK
    for module in (
        sqrt,
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
        current_model,
        decoupling,
        voltage_limit,
        svm_delay_compensation,
        inverse_park,
        svm,
        pwm_compare,
        gate_generation,
    )
}
