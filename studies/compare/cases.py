# SPDX-License-Identifier: BSD-3-Clause
"""The cases of a comparison: healthy drives, single effects and pairs of a sealed benchmark.

If the blind benchmark of the seed exists (build/blind/own/seedN), its cases are used; otherwise the same generator
makes cases in build/compare.  The truth is opened here for the stratum of each case, which no method receives, and
for the scores afterwards.
"""

from __future__ import annotations

from pathlib import Path

from fluxproof.checkout import BUILD
from studies.blind.generate import generate
from studies.blind.seal import unseal

STRATA = ("single", "pair", "healthy")


def folder_of(seed: int, count: int, jobs: int = 2) -> Path:
    """Folder with the sealed cases of a seed, generated if it does not exist.

    count: size of the whole benchmark they are a part of (about half are of STRATA).
    """
    there = BUILD / "blind" / "own" / f"seed{seed}"
    if (there / "sealed.sha256").exists():
        return there
    made = BUILD / "compare" / f"seed{seed}_{count}"
    if not (made / "sealed.sha256").exists():
        generate(seed, made, count, list(STRATA), jobs)
    return made


def cases_of(folder: Path) -> list[dict]:
    """Truths of the cases that count; SealError if they were changed after sealing."""
    return [truth for truth in unseal(folder)["cases"] if truth["stratum"] in STRATA]
