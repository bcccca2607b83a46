# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the fault latch and the sample guard: stop of the gates, its duration, distance of samples."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

LATCH = "io/fault_latch.vhd"
GUARD = "io/sample_guard.vhd"


def proof(name: str, says: str, entity: str, macros: tuple[str, ...], *faults: Fault, **more) -> Proof:
    return Proof(
        name=f"protection_{name}",
        says=says,
        entity=entity,
        harness=committed(f"{entity}.sv"),
        faults=faults,
        method="pdr",
        macros=macros,
        search_depth=40,
        **more,
    )


PROOFS = (
    proof(
        "stop",
        "trip, and any other cause that is not ignored, stops in the next clock; only clear_trip clears it",
        "fault_latch",
        ("STOP",),
        Fault("trip needs enable", LATCH, "now_0(k) when k = FAULT_LATCH_TRIP else now_0(k) and enable",
              "now_0(k) and enable"),
        Fault("cleared without clear_trip", LATCH, "(now_0(k) or not clear_0)", "now_0(k)"),
    ),
    proof(
        "clear",
        "a trip beats a clear: for 16 clocks after trip has become 1 no clear_trip clears it",
        "fault_latch",
        ("CLEAR",),
        Fault("cleared unseen", LATCH, "clear_trip and not caused_0 and nor held", "clear_trip"),
    ),
    proof(
        "first_fault",
        "the first fault that stopped is reported until no fault stops any more",
        "fault_latch",
        ("FIRST",),
        Fault("last fault reported", LATCH, "      if stop = '0' then\n        first <= tripping_0;\n      end if;",
              "      first <= tripping_0;"),
    ),
    proof(
        "distance",
        "samples enter at least INTERVAL clocks apart for any strobes; a rejected one is reported",
        "sample_guard",
        ("DISTANCE",),
        Fault("a clock too early", GUARD, "to_unsigned(INTERVAL - 1, 8)", "to_unsigned(INTERVAL - 2, 8)"),
        Fault("early not reported", GUARD, "sample_early <= early;", "sample_early <= '0';"),
        generics={"INTERVAL": 12},
        assumed="INTERVAL is 12 here",
    ),
    proof(
        "watchdog",
        "no sample for watchdog clocks: late at the latest two clocks after, never in the clock after a sample",
        "sample_guard",
        ("WATCHDOG",),
        Fault("age does not count", GUARD, "if expired = '0' then", "if busy = '1' then"),
        generics={"INTERVAL": 12},
        assumed="watchdog below 40 and constant, INTERVAL 12",
    ),
)  # fmt: skip
