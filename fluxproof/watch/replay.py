# SPDX-License-Identifier: BSD-3-Clause
"""The golden model beside the stream: how many samples are equal in every bit, or block, signal and bit of the first
that is not.

As in diagnosis/replay/digital.py: after a reset the state is known.  A stretch that begins otherwise counts from the
row on after which CONVERGED rows agree.  A core that ran before it may never agree, as its integrals stay apart:
until then the blocks without state are compared, which also shows the registers of another drive.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.replay.cause import golden_value, lowest_bit
from fluxproof.diagnosis.replay.chain import run_of
from fluxproof.diagnosis.replay.digital import CONVERGED, hexadecimal
from fluxproof.diagnosis.replay.flow import OWNER, block_name, first_in_flow
from fluxproof.diagnosis.replay.local import check_rows
from golden_model import fluxproof
from golden_model.io.telemetry_words import FIELDS, PACKET
from golden_model.registers import RegisterSet


class LiveReplay:
    """Takes the rows in their order; holds a state, no rows."""

    def __init__(self, register_set: RegisterSet) -> None:
        self.registers, self.config = register_set.values._asdict(), register_set.config._asdict()
        self.state, self.known, self.agreed = fluxproof.State(), False, 0
        self.equal = self.local = 0  # ``local``: rows since the last cut whose blocks without state are equal
        self.difference: str | None = None

    def compile(self) -> None:
        """Before the first row comes: numba needs half a minute the first time, and a server waits for two seconds."""
        row = np.zeros(1, np.int64)
        for self.known in (False, True):
            self.take(row, dict.fromkeys(FIELDS, row))
        self.cut(False)
        self.equal, self.difference = 0, None

    def cut(self, after_reset: bool) -> None:
        """Rows are missing before the next one, or the core was reset."""
        self.state, self.known, self.agreed = fluxproof.State(), after_reset, 0
        self.local = 0

    def take(self, counter: np.ndarray, fields: dict[str, np.ndarray]) -> None:
        """Rows that follow each other without a gap."""
        n = len(counter)
        if self.difference is not None or not n:
            return
        samples = np.stack([fields[name] for name in fluxproof.Sample._fields], axis=1)
        run = run_of(samples, {name: fields[name] for name in PACKET}, self.registers, self.config)
        if not self.known:
            row, names, golden = check_rows(run, 0, n)
            if row < n:
                signal = first_in_flow(names)
                self._differs(counter[row], signal, int(fields[signal][row]), golden[signal])
                return
            _, last = run.differences(self.state, 0, n)
            self.local += n
            self.state = run.state_at(self.state, 0, n)
            self.agreed = n - 1 - last if last >= 0 else self.agreed + n
            if self.agreed >= CONVERGED:
                self.known, self.equal = True, self.equal + self.agreed
            return
        row, self.state, names = run.until_different(self.state, 0, n)
        self.equal += row
        if row < n:
            signal = first_in_flow(names)
            value = golden_value(run, self.state, row, signal)
            self._differs(counter[row], signal, int(fields[signal][row]), value)

    def _differs(self, counter, signal: str, found: int, golden: int) -> None:
        self.difference = (
            f"block {block_name(OWNER[signal])}, sample {int(counter)}, signal {signal}, bit "
            f"{lowest_bit(found, golden)}: recorded {hexadecimal(found)}, golden {hexadecimal(golden)}"
        )

    def told(self) -> str:
        """The line beside the curves."""
        if self.difference is not None:
            return f"digital: {self.difference}; {self.equal:,} samples before it are equal"
        if self.known:
            return f"digital: equal over {self.equal:,} samples"
        said = f"digital: {self.equal:,} samples compared; the state is not known since the last gap or the begin"
        return f"{said}: of {self.local:,} samples only blocks without state, which are equal" if self.local else said
