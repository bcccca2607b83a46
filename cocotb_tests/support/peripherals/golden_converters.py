# SPDX-License-Identifier: BSD-3-Clause
"""The golden models of the front ends over many clocks, compiled: arrays in, arrays out."""

from __future__ import annotations

import numpy as np

from golden_model.converters import sinc3, spi_converter, xadc_reader
from golden_model.kernel import kernel


@kernel
def spi(state, trigger, miso, busy, r, adc_bits, lines):
    """``r``: the registers in the order of the declaration; one row of outputs for each clock."""
    out = np.empty((trigger.size, 14), np.int64)
    for n in range(trigger.size):
        state, y = spi_converter.step(
            state, trigger[n], miso[n], busy[n], r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9], r[10],
            adc_bits, lines,
        )  # fmt: skip
        out[n, :] = np.array(y)
    return out


@kernel
def xadc(state, inputs, r, adc_bits):
    """``inputs``: columns in the order of the declaration; one row of outputs for each clock."""
    out = np.empty((len(inputs), 9), np.int64)
    for n in range(len(inputs)):
        state, y = xadc_reader.step(
            state, inputs[n, 0], inputs[n, 1], inputs[n, 2], inputs[n, 3], inputs[n, 4],
            r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], adc_bits,
        )  # fmt: skip
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
