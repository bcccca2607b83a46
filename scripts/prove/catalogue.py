"""Every property that `make prove` proves."""

from __future__ import annotations

from scripts.prove import buses, gates, narrowing, pipeline
from scripts.prove.proof import Proof


def catalogue() -> tuple[Proof, ...]:
    return (*gates.PROOFS, *buses.PROOFS, *narrowing.proofs(), *pipeline.proofs())
