# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the gates at the pins of the whole core, including its wiring.

Every other block is cut off and its outputs may have any value at any clock, which makes the proof stronger.
"""

from __future__ import annotations

import re

from scripts.prove.gates import SEVERAL_PERIODS, SMALL
from scripts.prove.pipeline import ports
from scripts.prove.proof import HARNESSES, Fault, Proof

CORE, TOP = "fluxproof", "fluxproof_flat"  # the entity, and the top around it with plain ports
OUTPUTS = ("gate_high", "gate_low", "tripped")
KEPT = ("gate_generation", "protection", "fault_latch")  # the blocks between trip and the gates


def harness(verilog: str) -> str:
    """``formal_top``: the core with free inputs, its gates, and the properties of tb/formal/core.sv."""
    found = ports(verilog, TOP)
    inputs = [(width, name) for direction, width, name in found if direction == "input"]
    looked_at = [(width, name) for direction, width, name in found if name in OUTPUTS]
    header = ",\n".join(f"    input {width} {name}" for width, name in inputs)
    wires = "\n".join(f"  wire {width} {name};" for width, name in looked_at)
    wiring = ", ".join(f".{name}({name})" for _, name in [*inputs, *looked_at])
    body = (HARNESSES / "core.sv").read_text()
    return f"module formal_top (\n{header}\n);\n{wires}\n  {TOP} dut ({wiring});\n{body}endmodule\n"


def cut(verilog: str) -> tuple[str, ...]:
    """The modules that are cut off: all but the top and those of KEPT."""
    modules = re.findall(r"^module (\w+)", verilog, re.MULTILINE)
    return tuple(m for m in modules if not m.startswith((CORE, *KEPT)))


def core_proof(name: str, says: str, macro: str, *faults: Fault) -> Proof:
    return Proof(
        name=f"core_{name}",
        says=says,
        entity=TOP,
        harness=harness,
        faults=faults,
        method="pdr",
        generics={"CARRIER_HALF": 10000},
        macros=(macro,),
        search_generics=SMALL,
        search_depth=SEVERAL_PERIODS,
        cut=cut,
    )


PROOFS = (
    core_proof(
        "never_both",
        "at the pins of the core both gates of a leg are never on",
        "NEVER_BOTH",
        Fault(
            "low gates not connected",
            f"{CORE}.vhd",
            "gate_high => gate_high, gate_low => gate_low,",
            "gate_high => gate_high, gate_low => open,",
        ),
    ),
    core_proof(
        "trip",
        "trip to all gates off in one clock, and off until clear_trip without trip",
        "TRIP",
        Fault(
            "clear while it is there",
            "modulation/gate_generation.vhd",
            "trip or (state.tripped and not clear_trip)",
            "(trip or state.tripped) and not clear_trip",
        ),
    ),
    core_proof(
        "enable",
        "enable to all gates off in one clock",
        "ENABLE",
        Fault(
            "enable held high",
            f"{CORE}.vhd",
            "compare_c => compare_c, enable => enable,",
            "compare_c => compare_c, enable => '1',",
        ),
    ),
)
