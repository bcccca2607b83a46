# SPDX-License-Identifier: BSD-3-Clause
"""The wiring of fluxproof_axi: mutants of the top's own cells and connections, judged by the golden fluxproof_axi.

The run is that of A/B/Z edges through fluxproof_board (board.py): its samples, writes, reads and trip pin.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from fluxproof.cosim.axi_clock import NAMES, SEEN, AxiClock, accesses, writes_in
from fluxproof.cosim.fault_run import FaultRun, edges_run, words
from fluxproof.cosim.verilog import VerilogPort
from golden_model.generated.register_names import ADDRESSES
from scripts.mutate.board import schedule
from scripts.mutate.harness import Trial

TOP = "fluxproof_axi"
DRAWN = 1500
# As in board.py: what decides about the gates, without what this run never has.
_DECIDES = r"-cell (?:stage|cause) |-port (?:trip|tripped|enable|clear_trip|host_write|running|setting_refused"
_DECIDES += r"|fault_flags|first_fault|irq_mask|irq_clear|irq_cause|brake|brake_next|gate_high|gate_low|sample_valid"
_DECIDES += r"|sample_busy|adc_\w+|position_code) "
_NEVER = r"-cell (?:stream|ring) |-port irq_\w+ -portbit 4|-mode cnot1 .*-port irq_cause .*-ctrlbit 4$"
_NEVER += r"|-mode const0 .*-port (fault_flags|first_fault) -portbit (8|12)$"
_NEVER += r"|-mode cnot1 .*-port (fault_flags|first_fault) .*-ctrlbit (8|12)$"
NO_CHANGE = re.compile(rf"^(?!.*(?:{_DECIDES}))|{_NEVER}")


def chunks(run: FaultRun, golden: AxiClock) -> Iterator:
    """The run's periods as fluxproof_axi has them."""
    for chunk in run.run(run.with_reads):
        given, length = chunk.inputs, len(chunk.seen)
        before = words(golden, {})
        inputs, seen = golden.beside(run.golden, writes_in(given), given["trip"])
        after = words(golden, {})
        read = [(k, NAMES[int(given["s_axi_araddr"][k])]) for k in accesses(given, "ar")]
        reads = [(k, after[n]) for k, n in read if n in after and after[n] == before.get(n)]
        bus = {f"s_axi_{n}": np.zeros(length, np.int64) for n in ("araddr", "arvalid")}
        for k, name in read:
            if name in golden.registers.map:
                bus["s_axi_arvalid"][k : k + 2], bus["s_axi_araddr"][k : k + 2] = 1, ADDRESSES[name]
        yield replace(chunk, inputs=inputs | bus, seen=seen, reads=reads)


def clock() -> tuple[FaultRun, AxiClock]:
    """The run and a golden fluxproof_axi at its reset."""
    run = edges_run()
    return run, AxiClock(run.blocks, run.clock_hz)


def trial(ports: Iterable[VerilogPort]) -> Trial:
    """The run as a schedule for the ports of the converted top."""
    return schedule(chunks(*clock()), ports, SEEN)
