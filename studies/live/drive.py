# SPDX-License-Identifier: BSD-3-Clause
"""A running drive: the packets of closed loops of the golden core, at a rate, to the standard output.

    python -m studies.live.drive --rate 20000 --rows 100000 | telemetry_server - 5555

The inputs of one closed loop again and again, over which the state of the core runs on from its reset: a plant would
need more of the processor than `watch`, which is to be measured.  Where the processor is too slow for the rate the
drive stands still, and the last line on stderr says for how long: only rows that were written can be lost.
"""

from __future__ import annotations

import argparse
import json
import queue
import sys
import threading
import time
from collections.abc import Iterator

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.scenarios import everything
from fluxproof.diagnosis.replay.capture import capture, packets
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.io.telemetry_words import LAYOUT
from golden_model.kernel import kernel
from golden_model.registers import registers

DRIVE_FILE = DRIVES / "paper001.toml"
WRONG_SIGNAL, WRONG_BIT = "i_q", 3
AHEAD, STEP_S = 20, 0.01  # loops that wait to be sent; between two writes


@kernel
def _results(state, samples, registers, config, observed):
    """The core over the samples: its results, its state behind them."""
    for k in range(samples.shape[0]):
        x = samples[k]
        sample = fluxproof.Sample(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12])
        state, seen = fluxproof.step(state, sample, registers, config)
        for n, value in enumerate(seen):
            observed[k, n] = value
    return state


def loops(count: int) -> Iterator[np.ndarray]:
    """(n, COUNT) uint32, one loop after the other, ``count`` rows in all."""
    drive = drives.load(DRIVE_FILE)
    register_set, state, done = registers(drive), fluxproof.State(), 0
    samples, _, _ = capture(drive, register_set, everything(drive))
    observed = np.zeros((len(samples), len(fluxproof.Observed._fields)), np.int64)
    while done < count:
        state = _results(state, samples, register_set.values, register_set.config, observed)
        named = dict(zip(fluxproof.Observed._fields, observed.T, strict=True))
        yield packets(samples, named, done)[: count - done]
        done += len(samples)


def with_wrong_bit(parts: Iterator[np.ndarray], at: int) -> Iterator[np.ndarray]:
    """The same rows, a bit of row ``at`` turned over."""
    done = 0
    for rows in parts:
        if done <= at < done + len(rows):
            rows[at - done, LAYOUT[WRONG_SIGNAL].word] ^= np.uint32(1 << WRONG_BIT)
        yield rows
        done += len(rows)


def send(parts: Iterator[np.ndarray], rate: float, out) -> dict[str, float]:
    """Write all rows at ``rate``; rows, seconds that it took, seconds that no row was ready."""
    ready: queue.Queue[np.ndarray | None] = queue.Queue(AHEAD)

    def make() -> None:
        for rows in parts:
            ready.put(rows)
        ready.put(None)

    threading.Thread(target=make, daemon=True).start()
    rows, total, at = ready.get(), 0, 0  # the first includes the compilation
    begin = start = time.monotonic()
    stood = 0.0
    while rows is not None:
        due = int((time.monotonic() - start) * rate) - total
        if due > 0:
            out.write(rows[at : at + due].astype("<u4").tobytes())
            sent = min(due, len(rows) - at)
            at, total = at + sent, total + sent
        if at == len(rows):
            waited = time.monotonic()
            rows, at = ready.get(), 0
            stood += time.monotonic() - waited
            start += time.monotonic() - waited
        else:
            out.flush()
            time.sleep(STEP_S)
    out.flush()
    return {"rows": total, "seconds": time.monotonic() - begin, "stood": stood}


def main() -> int:
    """Send and say what was sent."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--rate", type=float, required=True, help="rows a second")
    parser.add_argument("--rows", type=int, required=True)
    parser.add_argument("--wrong-at", type=int, default=-1, help=f"turn bit {WRONG_BIT} of {WRONG_SIGNAL} in this row")
    args = parser.parse_args()
    print(
        json.dumps(send(with_wrong_bit(loops(args.rows), args.wrong_at), args.rate, sys.stdout.buffer)), file=sys.stderr
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
