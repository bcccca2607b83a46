# SPDX-License-Identifier: BSD-3-Clause
"""Mutants that no bench notices, that are not proved equivalent, and why they cannot matter.

A key is the block and a pattern of the mutation as Yosys writes it, without numbers of lines: it stays valid where the
converted Verilog moves.  No reason here: a hole in the bench, and `make mutate` fails.
"""

from __future__ import annotations

import re

# (block, pattern of the mutation, reason)
_SLOW = "with these bits of k_edge the speed is in its range only where edges are more than 8,000 clocks apart"
_ONE = "the mantissa is in [1, 2) and m from 2**16 to 2**17 - 1: the highest bit of either is 1"
_SEEN = "seen: until a sample has met an edge its time is the longest there is, so the speed is 0 whatever was counted"
_LATE = "no run of the core waits 2**14 clocks for a sample: a watchdog with one of these bits never expires"
_FAINT = "the bit is at most 1/128 LSB of lambda: no sample of a run that has bit 12 too is so near a rounding"
REASONS: tuple[tuple[str, str, str], ...] = (
    ("fluxproof", r"-mode cnot1 .*-port settings_watchdog -portbit \d+ -ctrlbit 1[4-9]$", _LATE),
    ("fluxproof", r"-mode cnot1 .*-cell inside\.estimation_resistance -port minus_rho -portbit 0 -ctrlbit 12$", _FAINT),
    ("reciprocal", r"-mode const1 .*-cell \$procdff\$\d+ -port [DQ] -portbit 16$", _ONE),
    ("edge_timer", r"-mode const1 .*-cell \$ternary\$design\.v:\d+\$\d+\[0\] -port [AY] -portbit 0$", _SEEN),
    ("incremental_encoder", r"-mode cnot1 .*-cell timer -port k_edge -portbit \d+ -ctrlbit (2[4-9]|3\d)$", _SLOW),
)


def reason(block: str, mutation: str) -> str:
    """Why this mutant cannot matter; empty where nobody knows."""
    for name, pattern, words in REASONS:
        if name == block and re.search(pattern, mutation):
            return words
    return ""
