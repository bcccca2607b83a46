# SPDX-License-Identifier: BSD-3-Clause
"""Every property that `make prove` proves."""

from __future__ import annotations

from fluxproof.checkout import RTL
from fluxproof.cosim.flat import FLAT
from scripts.prove import (
    buses,
    cells,
    converters,
    core,
    current,
    encoders,
    gates,
    motor,
    narrowing,
    pipeline,
    protection,
    residual,
    weakening,
)
from scripts.prove.proof import Proof


def every_proof() -> tuple[Proof, ...]:
    """The whole catalogue."""
    written = (*gates.PROOFS, *core.PROOFS, *protection.PROOFS, *buses.PROOFS, *converters.PROOFS, *encoders.PROOFS)
    written += (*cells.PROOFS, *current.PROOFS, *residual.PROOFS, *motor.PROOFS, *weakening.PROOFS)
    return (*written, *narrowing.proofs(), *pipeline.proofs())


def catalogue() -> tuple[Proof, ...]:
    """The proofs whose entity is in rtl/ or generated."""
    entities = {path.stem for path in RTL.rglob("*.vhd")}
    return tuple(p for p in every_proof() if p.vhdl is not None or p.entity.removesuffix(FLAT) in entities)


def left_out() -> tuple[str, ...]:
    """The entities of proofs that are missing in rtl/."""
    here = {proof.name for proof in catalogue()}
    return tuple(dict.fromkeys(proof.entity for proof in every_proof() if proof.name not in here))
