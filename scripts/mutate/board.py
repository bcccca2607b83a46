# SPDX-License-Identifier: BSD-3-Clause
"""The wiring of fluxproof_board: mutants of the top's own cells and connections, judged by the golden board.

Two runs through the pins (fluxproof/cosim/fault_run.py): every register written, each front end's faults, ignored and
not, a silent host, the trip pin; then every register read.  Pins at each clock and the words on the bus are compared.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from fluxproof.cosim.board_clock import SEEN
from fluxproof.cosim.fault_run import FaultRun, edges_run, serial_run
from fluxproof.cosim.verilog import VerilogPort
from scripts.mutate.harness import Trial

TOP = "fluxproof_board"
RUNS: tuple[Callable[[], FaultRun], ...] = (serial_run, edges_run)
MUTANTS = 60
IN_RESET = 8  # clocks of aresetn = 0 before the first, of which the last two pass its registers
CONSTANT = {"s_axi_wstrb": 15, "s_axi_bready": 1, "s_axi_rready": 1, "m_axis_tready": 1}
ANSWER = 8  # clocks from a read on the bus to its word


def trial(run: FaultRun, ports: Iterable[VerilogPort]) -> Trial:
    """The run as a schedule for the ports of the converted top."""
    ports = tuple(ports)
    number = {p.name: k for k, p in enumerate(ports)}
    writes = [(-IN_RESET, number[name], value) for name, value in CONSTANT.items()]
    writes.append((-2, number["aresetn"], 1))
    checks, held, at = [], {}, 0
    for chunk in run.run(run.with_reads):
        for name, values in chunk.inputs.items():
            for k in np.flatnonzero(np.diff(values, prepend=held.get(name, 0))):
                writes.append((at + int(k), number[name], int(values[k])))
            held[name] = int(values[-1])
        for name, column in zip(SEEN, chunk.seen.T, strict=True):
            checks += [(at + 1 + k, number[name], int(value)) for k, value in enumerate(column)]
        for k, word in chunk.reads:
            checks.append((at + k + ANSWER, number["s_axi_rvalid"], 1))
            checks.append((at + k + ANSWER, number["s_axi_rdata"], word))
        at += len(chunk.seen)
    tables = [np.array(sorted(rows), np.int64) for rows in (writes, checks)]
    return Trial(ports, IN_RESET, at, *tables, np.empty(0, np.int64), np.empty(0, np.int64))
