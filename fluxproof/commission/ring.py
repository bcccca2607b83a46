# SPDX-License-Identifier: BSD-3-Clause
"""The rows that the core's ring (golden_model/io/telemetry_ring.py) holds after its end, read over the registers."""

from __future__ import annotations

from fluxproof.commission.bus import Bus, BusError
from golden_model.io.register_map import registers
from golden_model.io.telemetry_words import COUNT

STATE = {field.name: field for field in registers()["ring_state"].fields}


def ring_state(bus: Bus) -> dict[str, int]:
    """The fields of ring_state."""
    word = bus.read("ring_state")
    return {name: word >> field.bit & ((1 << field.width) - 1) for name, field in STATE.items()}


def read_ring(bus: Bus) -> bytes:
    """The rows, the oldest first, as a DMA would have stored them; BusError while the ring has not ended."""
    depth, state = bus.read("ring_depth") * COUNT, ring_state(bus)
    if not depth:
        raise BusError("this core has no ring: its generic RING_ROWS is 0")
    if not state["ring_ended"]:
        raise BusError(
            "the ring still records: write ring_stop" if state["ring_recording"] else "the ring is not armed"
        )
    behind = bus.read("ring_next")
    words = []
    for k in range(depth if state["ring_full"] else behind):
        bus.write("ring_address", (behind + k) % depth if state["ring_full"] else k)
        words.append(bus.read("ring_data").to_bytes(4, "little"))
    return b"".join(words)
