# SPDX-License-Identifier: BSD-3-Clause
"""Masters in a closed loop with the models of their encoders, over cables of any length, recorded clock by clock."""

from __future__ import annotations

import numba
import numpy as np

from cocotb_tests.support.peripherals import absolute_model as models
from golden_model.encoders import biss_master, endat_master, ssi_master

biss_step, ssi_step, endat_step = biss_master.step, ssi_master.step, endat_master.step
BITS = 18
CABLE = 64  # longest cable in clocks, there and back
BEGIN = 8  # clock of the start in each frame's time
VALID, ERROR, CODE = range(3)


@numba.njit
def run_biss(state, frames, regs, acknowledge, cable, timeout, spacing, line, starts, result):
    memory, far = np.zeros(models.MEMORY, np.int64), np.ones(CABLE, np.int64)
    models.reset(memory)
    master, level = 1, 1
    for n in range(len(frames)):
        for k in range(spacing):
            at = n * spacing + k
            far[at % CABLE] = models.biss(memory, master, frames[n], frames.shape[1], acknowledge, timeout)
            level = far[(at - cable) % CABLE]
            start = 1 if k == BEGIN else 0
            line[at], starts[at] = level, start
            state, out = biss_step(state, level, start, regs[0], regs[1], regs[2], regs[3], regs[4], BITS)
            master = out[0]
            result[n, VALID] += out[2]
            result[n, ERROR] += out[3]
            if out[2]:
                result[n, CODE] = out[1]


@numba.njit
def run_ssi(state, frames, regs, _acknowledge, cable, timeout, spacing, line, starts, result):
    memory, far = np.zeros(models.MEMORY, np.int64), np.ones(CABLE, np.int64)
    models.reset(memory)
    master, level = 1, 1
    for n in range(len(frames)):
        for k in range(spacing):
            at = n * spacing + k
            far[at % CABLE] = models.ssi(memory, master, frames[n], frames.shape[1], 0, timeout)
            level = far[(at - cable) % CABLE]
            start = 1 if k == BEGIN else 0
            line[at], starts[at] = level, start
            state, out = ssi_step(state, level, start, regs[0], regs[1], regs[2], regs[3], regs[4], BITS)
            master = out[0]
            result[n, VALID] += out[2]
            result[n, ERROR] += out[3]
            if out[2]:
                result[n, CODE] = out[1]


@numba.njit
def run_endat(state, frames, regs, calculation, cable, timeout, spacing, line, starts, result):
    memory, far = np.zeros(models.MEMORY, np.int64), np.ones(CABLE, np.int64)
    models.reset(memory)
    master, data_out, drive = 1, 0, 0
    for n in range(len(frames)):
        for k in range(spacing):
            at = n * spacing + k
            sent, sends = models.endat(
                memory, master, data_out, frames[n], frames.shape[1], calculation, timeout, regs[1]
            )
            far[at % CABLE] = sent if sends else 1  # a line that nobody drives reads 1
            level = data_out if drive else far[(at - cable) % CABLE]
            start = 1 if k == BEGIN else 0
            line[at], starts[at] = level, start
            state, out = endat_step(
                state, level, start, regs[0], regs[1], regs[2], regs[3], regs[4], regs[5], regs[6], BITS
            )
            master, data_out, drive = out[0], out[1], out[2]
            result[n, VALID] += out[4]
            result[n, ERROR] += out[5]
            if out[4]:
                result[n, CODE] = out[3]


RUNS = {
    "biss_master": (run_biss, biss_master),
    "ssi_master": (run_ssi, ssi_master),
    "endat_master": (run_endat, endat_master),
}


def run(name: str, frames: np.ndarray, registers: dict[str, int], answer: int, cable: int, timeout: int, spacing: int):
    """Frame after frame: (result per frame: valid strobes, error strobes, code; line and starts per clock).

    ``answer``: periods of acknowledge or calculation; ``cable``: clocks there and back; ``timeout``: of the encoder.
    """
    kernel, module = RUNS[name]
    regs = np.array([registers[p.name] for p in module.BLOCK.registers], np.int64)
    clocks = len(frames) * spacing
    line, starts = np.empty(clocks, np.int8), np.empty(clocks, np.int8)
    result = np.zeros((len(frames), 3), np.int64)
    kernel(module.State(), frames, regs, answer, cable, timeout, spacing, line, starts, result)
    return result, line, starts
