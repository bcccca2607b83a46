# SPDX-License-Identifier: BSD-3-Clause
"""The golden models of the front ends over many clocks, compiled: arrays in, arrays out."""

from __future__ import annotations

import numpy as np

from golden_model.converters import sinc3, spi_converter, xadc_reader
from golden_model.kernel import kernel


@kernel
def spi(state, trigger, miso, busy, r, adc_bits, lines):
    """``r``: spi_converter.Registers; one row of outputs for each clock."""
    out = np.empty((trigger.size, 14), np.int64)
    for n in range(trigger.size):
        inputs = spi_converter.Inputs(sample_trigger=trigger[n], miso=miso[n], busy=busy[n])
        state, y = spi_converter.step(state, inputs, r, adc_bits, lines)
        out[n, :] = np.array(y)
    return out


@kernel
def xadc(state, inputs, r, adc_bits):
    """``inputs``: columns in the order of the declaration; ``r``: xadc_reader.Registers; one row of outputs a clock."""
    out = np.empty((len(inputs), 9), np.int64)
    for n in range(len(inputs)):
        x = inputs[n]
        now = xadc_reader.Inputs(sample_trigger=x[0], busy=x[1], eoc=x[2], drdy=x[3], drp_do=x[4])
        state, y = xadc_reader.step(state, now, r, adc_bits)
        out[n, :] = np.array(y)
    return out


@kernel
def sinc(state, trigger, bits, valid, oversampling, gain, start_clocks, adc_bits):
    """One row (code, code_valid, window_error) for each clock."""
    out = np.empty((trigger.size, 3), np.int64)
    for n in range(trigger.size):
        state, y = sinc3.step(state, trigger[n], bits[n], valid[n], oversampling, gain, start_clocks, adc_bits)
        out[n, :] = np.array(y)
    return out
