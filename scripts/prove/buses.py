"""AXI4-Lite and AXI4-Stream: the rules of the handshakes, for every master and every sink that keeps its own."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

SLAVE = "io/axi_lite_slave.vhd"
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


PROOFS = (
    slave_proof(
        "stable",
        "bvalid and rvalid stay until ready, response and data with them",
        "STABLE",
        Fault("response falls by itself", SLAVE, "      if s_axi_bready = '1' then\n        b_valid <= '0';\n      end if;", "      b_valid <= '0';"),
        Fault("read taken before the last answer has gone", SLAVE, "s_axi_arvalid and not r_valid", "s_axi_arvalid"),
    ),
    slave_proof(
        "one_answer",
        "one answer to each request, none without a request; a write is taken with its data",
        "ONE_ANSWER",
        Fault("address taken without data", SLAVE, "s_axi_awvalid and s_axi_wvalid and not b_valid", "s_axi_awvalid and not b_valid"),
        Fault("read taken before the last answer has gone", SLAVE, "s_axi_arvalid and not r_valid", "s_axi_arvalid"),
        Fault("a write answers as a read", SLAVE, "            if writing = '1' then", "            if write_data(0) = '1' then"),
    ),
    slave_proof(
        "request",
        "a request carries what the bus has handed over, stays until answered, and its answer goes to the bus",
        "REQUEST",
        Fault("address of the other channel", SLAVE, "unsigned(s_axi_araddr)", "unsigned(s_axi_awaddr)"),
        Fault("refused read shows data", SLAVE, "if response /= \"00\" then", "if response = \"01\" then"),
    ),
    slave_proof(
        "progress",
        "neither reads nor writes starve: taken within 12 clocks",
        "PROGRESS",
        Fault("reads wait for the master to take a write's answer", SLAVE,
              "s_axi_arvalid and not r_valid", "s_axi_arvalid and not r_valid and not b_valid"),
        assumed=f"{MASTER} and takes answers of this direction at once; the registers answer within 3 clocks",
    ),
    slave_proof(
        "in_reset",
        "a reset ends every transfer: nothing valid, ready or requested in the clock after it",
        "IN_RESET",
        Fault("response survives reset", SLAVE, "        b_valid       <= '0';\n        r_valid       <= '0';\n", "        r_valid       <= '0';\n"),
    ),
)  # fmt: skip
