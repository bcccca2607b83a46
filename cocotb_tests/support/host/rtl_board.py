# SPDX-License-Identifier: BSD-3-Clause
"""A board with the AXI top on it, converted to Verilog and compiled: software's accesses are AXI4-Lite transfers."""

from __future__ import annotations

from cocotb_tests.support.host.piped_board import Board
from fluxproof.cosim.closed_loop import SAMPLE_DELAY
from fluxproof.cosim.sleeping import with_sleep
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.registers import registers

PATIENCE = 1000  # clocks that an access may take


class RtlBoard(Board):
    """From the end of aresetn.  An access takes its clocks out of the period in which it falls."""

    top = "fluxproof_axi"

    def __init__(self, drive, trip_at: float | None = None):
        super().__init__(drive, trip_at)
        config = registers(drive).config
        generics = {**config._asdict(), "clock_hz": round(drive.core.clock_hz), "ring_rows": drive.core.ring_rows}
        self.core = VerilatedCore({n.upper(): v for n, v in generics.items()}, top=self.top, rewrite=with_sleep)
        self.core.set_many({"m_axis_tready": 1, "s_axi_wstrb": 15, "s_axi_bready": 1, "s_axi_rready": 1})
        self.core.reset()
        self.clock_s = 1.0 / drive.core.clock_hz
        self.limit = 4 * config.carrier_half
        self.core.run_period(self.limit)
        self.began = self.core.clock

    def _transfer(self, requests: dict[str, dict[str, int]], answer: str) -> dict[str, int]:
        """Keep each valid until its ready, then wait for the response; returns the response channel."""
        core = self.core
        for channel, payload in requests.items():
            core.set_many({f"s_axi_{name}": value for name, value in payload.items()})
            core.set(f"s_axi_{channel}valid", 1)
        waiting = set(requests)
        for _ in range(PATIENCE):
            core.settle()
            taken = {channel for channel in waiting if core.get(f"s_axi_{channel}ready")}
            if core.get(f"s_axi_{answer}valid"):
                names = [n for n in core.outputs if n in (f"s_axi_{answer}resp", f"s_axi_{answer}data")]
                seen = core.get_many(names)
                core.tick()
                return seen
            core.tick()
            for channel in taken:
                core.set(f"s_axi_{channel}valid", 0)
            waiting -= taken
        raise TimeoutError(f"no answer on channel {answer} in {PATIENCE} clocks")

    def write(self, address: int, word: int) -> int:
        requests = {"aw": {"awaddr": address}, "w": {"wdata": word}}
        return self._transfer(requests, "b")["s_axi_bresp"]

    def read(self, address: int) -> tuple[int, int]:
        seen = self._transfer({"ar": {"araddr": address}}, "r")
        return seen["s_axi_rresp"], seen["s_axi_rdata"]

    def period(self, codes: dict[str, int], tripping: bool) -> None:
        self.core.set("trip", int(tripping))
        spent = self.core.clock - self.began
        clocks, edges, words = self.core.run_period(self.limit, sample=codes, sample_at=SAMPLE_DELAY)
        self.began = self.core.clock
        self.advance((spent + edges) * self.clock_s, words, (spent + clocks) * self.clock_s)
        self.gate_word = self.core.gate_word
