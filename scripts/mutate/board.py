# SPDX-License-Identifier: BSD-3-Clause
"""The wiring of fluxproof_board: mutants of the top's own cells and connections, judged by the golden board.

Two runs through the pins (fluxproof/cosim/fault_run.py): every register written, each front end's faults, ignored and
not, a silent host, the trip pin; then every register read.  Pins at each clock and the words on the bus are compared.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

import numpy as np

from fluxproof.cosim.board_clock import SEEN
from fluxproof.cosim.fault_run import Chunk, FaultRun, edges_run, serial_run
from fluxproof.cosim.verilog import VerilogPort
from scripts.mutate.harness import Trial

TOP = "fluxproof_board"
RUNS: tuple[Callable[[], FaultRun], ...] = (serial_run, edges_run)
# Most connections carry bits that a run of some ten thousand clocks cannot show (settings, telemetry, estimators that
# are not built): drawn is the wiring that decides about the gates, of as many draws of all.
DRAWN = 1500
_CELLS = r"-cell (?:faults|stage|joining|cause) "
_PORTS = r"-port (?:index_wrong|position_lost|converter_over|board_ignore|board_stop|limit_high|limit_low|trip|tripped"
_PORTS += r"|enable|clear_trip|host_write|running|setting_refused|fault_flags|first_fault|irq_mask|irq_clear|irq_cause"
_PORTS += r"|brake|brake_next|gate_high|gate_low|sample_valid|codes_done|position_done) "
# What a run's front ends do not have is never there, so that nothing ignores it, no limit makes it, and no bit of it is
# ever 1: the faults of other encoders and converters, in both runs the residual, samples that come too early (8), an
# open load (12).  An SSI encoder's position follows the codes, so that neither is ever missing alone.
_NEVER = r"-port irq_\w+ -portbit 4|-mode cnot1 .*-port irq_cause .*-ctrlbit 4$"
_NEVER += r"|-mode const0 .*-port (fault_flags|first_fault) -portbit (8|12)$"
_NEVER += r"|-mode cnot1 .*-port (fault_flags|first_fault) .*-ctrlbit (8|12)$|-mode const0 .*-cell joining -port rst "


def _without(bits: str, wires: str) -> str:
    """Mutations of the faults of front ends that are not there: their bits of the board's words, their wires."""
    words = "board_(flags|first)"
    found = rf"-port board_ignore -portbit [{bits}]|-mode const0 .*-port {words} -portbit [{bits}]$"
    return found + rf"|-mode cnot1 .*-port {words} .*-ctrlbit [{bits}]$|-mode const0 .*-port ({wires}) "


ABSENT = (
    rf"{_NEVER}|{_without('034', 'index_wrong|angle_unknown|hall_wrong')}|-mode const1 .*-port forced "
    r"|-mode (inv|const1) .*-cell joining -port codes_valid |-mode const0 .*-cell joining -port sample_trigger ",
    rf"{_NEVER}|{_without('124', 'converter_over|position_lost|hall_wrong')}|-port limit_(high|low) ",
)
IN_RESET = 8  # clocks of aresetn = 0 before the first, of which the last two pass its registers
CONSTANT = {"s_axi_wstrb": 15, "s_axi_bready": 1, "s_axi_rready": 1, "m_axis_tready": 1}
ANSWER = 8  # clocks from a read on the bus to its word


def no_change(index: int) -> re.Pattern[str]:
    """What is not drawn of a run."""
    return re.compile(rf"^(?!.*(?:{_CELLS}|{_PORTS}))|-cell stream |{ABSENT[index]}")


def trial(run: FaultRun, ports: Iterable[VerilogPort]) -> Trial:
    """The run as a schedule for the ports of the converted top."""
    return schedule(run.run(run.with_reads), ports, SEEN)


def schedule(chunks: Iterable[Chunk], ports: Iterable[VerilogPort], seen: tuple[str, ...]) -> Trial:
    """Chunks, whose columns are ``seen``, as a schedule for the ports of a converted top."""
    ports = tuple(ports)
    number = {p.name: k for k, p in enumerate(ports)}
    writes = [(-IN_RESET, number[name], value) for name, value in CONSTANT.items()]
    writes.append((-2, number["aresetn"], 1))
    checks, held, at = [], {}, 0
    for chunk in chunks:
        for name, values in chunk.inputs.items():
            for k in np.flatnonzero(np.diff(values, prepend=held.get(name, 0))):
                writes.append((at + int(k), number[name], int(values[k])))
            held[name] = int(values[-1])
        for name, column in zip(seen, chunk.seen.T, strict=True):
            checks += [(at + 1 + k, number[name], int(value)) for k, value in enumerate(column)]
        for k, word in chunk.reads:
            checks.append((at + k + ANSWER, number["s_axi_rvalid"], 1))
            checks.append((at + k + ANSWER, number["s_axi_rdata"], word))
        at += len(chunk.seen)
    driven, compared = (np.array(sorted(rows), np.int64) for rows in (writes, checks))
    return Trial(ports, IN_RESET, at, driven, compared, np.empty(0, np.int64), np.empty(0, np.int64))
