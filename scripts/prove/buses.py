# SPDX-License-Identifier: BSD-3-Clause
"""AXI4-Lite and AXI4-Stream: the handshake rules, for every master and every sink that follows the protocol."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

SLAVE = "io/axi_lite_slave.vhd"
QUEUE = "common/packet_fifo.vhd"
RING = "io/telemetry_ring.vhd"
MASTER = "the master keeps valid, address and data until ready"


def slave_proof(name: str, says: str, macro: str, *faults: Fault, assumed: str = MASTER) -> Proof:
    return Proof(
        name=f"axi_lite_{name}",
        says=says,
        entity="axi_lite_slave",
        harness=committed("axi_lite_slave.sv"),
        faults=faults,
        method="pdr",
        generics={"ADDRESS_BITS": 12},
        macros=(macro,),
        assumed=assumed,
        search_depth=24,
    )


def queue_proof(name: str, says: str, macro: str, *faults: Fault, method: str = "pdr", assumed: str = "") -> Proof:
    small = {"WIDTH": 2, "DEPTH_BITS": 3, "PACKET": 4}
    return Proof(
        name=f"axi_stream_{name}",
        says=says,
        entity="packet_fifo",
        harness=committed("packet_fifo.sv"),
        faults=faults,
        method=method,
        depth=14,  # the ninth word overwrites the first; beyond, the solvers take too long
        generics=small,
        macros=(macro,),
        assumed=f"a queue of 8 words of 2 bits, packets of 4{assumed}",
        search_depth=24,
    )


PROOFS = (
    slave_proof(
        "stable",
        "bvalid and rvalid stay until ready, response and data with them",
        "STABLE",
        Fault(
            "response falls by itself",
            SLAVE,
            " or (b_valid and not s_axi_bready);",
            ";",
        ),
        Fault("data change while they wait", SLAVE, "answering = '1' and writing = '0'", "writing = '0'"),
    ),
    slave_proof(
        "one_answer",
        "one answer to each request, none without a request; a write is taken with its data",
        "ONE_ANSWER",
        Fault(
            "address taken without data",
            SLAVE,
            "s_axi_awvalid and s_axi_wvalid and not b_valid",
            "s_axi_awvalid and not b_valid",
        ),
        Fault(
            "read taken before the last answer has gone",
            SLAVE,
            "s_axi_arvalid and not r_valid",
            "s_axi_arvalid",
        ),
        Fault(
            "a write answers as a read",
            SLAVE,
            "(answered and writing)",
            "(answered and write_data(0))",
        ),
    ),
    slave_proof(
        "request",
        "a request carries what the bus has handed over, stays until answered, and its answer goes to the bus",
        "REQUEST",
        Fault("address of the other channel", SLAVE, "unsigned(s_axi_araddr)", "unsigned(s_axi_awaddr)"),
        Fault("a read always succeeds", SLAVE, "s_axi_rresp <= response;", 's_axi_rresp <= "00";'),
    ),
    slave_proof(
        "progress",
        "neither reads nor writes starve: taken within 18 clocks",
        "PROGRESS",
        Fault(
            "reads wait for the master to take a write's answer",
            SLAVE,
            "s_axi_arvalid and not r_valid",
            "s_axi_arvalid and not r_valid and not b_valid",
        ),
        assumed=f"{MASTER} and takes answers of this direction at once; the registers answer within 6 clocks",
    ),
    slave_proof(
        "in_reset",
        "a reset ends every transfer: nothing valid, ready or requested in the clock after it",
        "IN_RESET",
        Fault(
            "response survives reset",
            SLAVE,
            "        b_valid    <= '0';\n        r_valid    <= '0';\n",
            "        r_valid    <= '0';\n",
        ),
    ),
    queue_proof(
        "stable",
        "tvalid stays until tready, data and tlast with it",
        "STABLE",
        Fault("word moved over one that waits", QUEUE, "read_valid and (out_ready or not shown)", "read_valid"),
        Fault("valid falls by itself", QUEUE, "move or (shown and not out_ready)", "move"),
    ),
    queue_proof(
        "whole",
        "no word of a packet begun with room is lost, doubled or out of order",
        "WHOLE",
        Fault("room a word too early", QUEUE, "used < DEPTH - PACKET or", "used < DEPTH - PACKET + 3 or"),
        Fault("count wrong when both move", QUEUE, "take /= fetch", "take /= fetch or fetch = '1'"),
        method="bmc",
        assumed="; the writer begins a packet where there is room",
    ),
    Proof(
        name="telemetry_ring",
        says="once ended, the ring holds each row once, whole and in order, and as many after a stop as asked for",
        entity="telemetry_ring",
        harness=committed("telemetry_ring.sv"),
        faults=(
            Fault(
                "recording begins inside a row",
                RING,
                "(waiting and not inside and not valid_1)",
                "(waiting and not valid_1)",
            ),
            Fault("the oldest word is lost", RING, "+ 2 ** ADDRESS_W - 1) mod", "+ 2 ** ADDRESS_W - 2) mod"),
            Fault(
                "the last word enters twice",
                RING,
                "live = '1' and valid_1 = '1'",
                "live = '1' and (valid_1 or end_2) = '1'",
            ),
            Fault(
                "a row after the end",
                RING,
                "hit = '1' and end_2 = '1'",
                "hit = '1' and (valid_1 and final_1) = '1' and left /= 1",
            ),
            Fault(
                "arming keeps the place",
                RING,
                "        full     <= '0';\n        write_at <= (others => '0');\n        cause",
                "        full     <= '0';\n        cause",
            ),
        ),
        depth=6,
        spies=(
            "index",
            "write_at",
            "left",
            "word_1",
            "ram",
            "waiting",
            "live",
            "hit",
            "ended",
            "wrapped",
            "full",
            "inside",
            "valid_1",
            "final_1",
            "stop_1",
            "end_2",
        ),
        generics={"RING_ROWS": 3, "ROW_WORDS": 3},
        search_generics={"RING_ROWS": 2, "ROW_WORDS": 2},
        assumed="a ring of 3 rows of 3 words of 1 bit, up to 3 rows after a write that stops it",
        search_depth=17,
        patience=300,
    ),
)
