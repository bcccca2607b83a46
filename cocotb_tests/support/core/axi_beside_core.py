# SPDX-License-Identifier: BSD-3-Clause
"""The golden fluxproof_axi beside the golden core: python -m cocotb_tests.support.core.axi_beside_core TRIP_AT

Prints as JSON how many values of gates and trigger differ, which come one clock later at the pins, until the pin trip
at this clock, and in how many clocks a gate was on before and after it.
"""

from __future__ import annotations

import json
import sys

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.axi_clock import PINS, SEEN, AxiClock
from fluxproof.cosim.board_clock import GoldenBlocks
from fluxproof.cosim.golden_clock import SEEN as CORE
from fluxproof.cosim.golden_clock import GoldenClock
from golden_model.drive import load, with_carrier
from golden_model.fluxproof import Sample
from golden_model.registers import registers

PERIOD, SAMPLE_AT, PERIODS, CURRENT = 200, 50, 3, 3000
COMPARED = ("gate_high", "gate_low", "sample_trigger")


def compare(trip_at: int) -> dict[str, int]:
    """Differences, and clocks with a gate on before and after the trip."""
    drive = with_carrier(load(DRIVES / "paper001.toml"), PERIOD // 2)
    given = registers(drive)
    axi = AxiClock(GoldenBlocks(given.config), round(drive.core.clock_hz))
    core = GoldenClock(given.values, given.config)
    known = set(axi.registers.values)
    axi.registers.values |= {n: value for n, value in given.values._asdict().items() if n in known}
    axi.registers.values |= {"enable": 1, "i_q_ext": CURRENT}
    axi.inputs = axi.inputs._replace(enable=1)
    pins, rows = np.zeros((PERIOD * PERIODS, len(PINS)), np.int64), []
    for k in range(PERIODS):
        codes = {"adc_a": 33000, "adc_b": 32000, "adc_c": 32900, "adc_u_dc": 30000, "position_code": 100 + k}
        pins[k * PERIOD + SAMPLE_AT] = [1, *codes.values(), 0]
        sample = codes | dict.fromkeys(Sample._fields[len(codes) : -1], 0) | {"i_q_ext": CURRENT}
        rows += [core.advance(SAMPLE_AT, enable=1), core.advance(PERIOD - SAMPLE_AT, sample=sample, enable=1)]
    pins[trip_at, PINS.index("trip")] = 1
    seen, core_seen = axi.advance(pins)[0], np.concatenate(rows)
    ours, cores = (t[:, [names.index(n) for n in COMPARED]] for t, names in ((seen, SEEN), (core_seen, CORE)))
    on = (ours[:, :2] != 0).any(axis=1)
    return {
        "different": int((ours[1:trip_at] != cores[: trip_at - 1]).sum()),
        "on_before": int(on[:trip_at].sum()),
        "on_after": int(on[trip_at:].sum()),
    }


if __name__ == "__main__":
    print(json.dumps(compare(int(sys.argv[1]))))
