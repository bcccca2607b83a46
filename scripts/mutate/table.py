"""Mutants that no bench notices, that are not proved equivalent, and why they cannot matter.

A key is the block and a pattern of the mutation as Yosys writes it, without numbers of lines: it stays valid where the
converted Verilog moves.  No reason here: a hole in the bench, and `make mutate` fails.
"""

from __future__ import annotations

import re

# (block, pattern of the mutation, reason)
_LATE = "no run of the core waits 2**14 clocks for a sample: a watchdog with one of these bits never expires"
REASONS: tuple[tuple[str, str, str], ...] = (
    ("fluxproof", r"-mode cnot1 .*-port settings_watchdog -portbit \d+ -ctrlbit 1[4-9]$", _LATE),
)


def reason(block: str, mutation: str) -> str:
    """Why this mutant cannot matter; empty where nobody knows."""
    for name, pattern, words in REASONS:
        if name == block and re.search(pattern, mutation):
            return words
    return ""
