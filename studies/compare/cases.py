"""The cases of a comparison: healthy drives, single effects and pairs of a sealed benchmark.

Where the blind benchmark of the seed is there already (build/blind/seedN), its cases are taken; else cases of
the same generator are made in build/compare.  The truth is opened here for the stratum of each case, which
no method gets to see, and for the scores afterwards.
"""

from __future__ import annotations

from pathlib import Path

from fluxproof.checkout import BUILD
from studies.blind.generate import generate
from studies.blind.seal import unseal

STRATA = ("single", "pair", "healthy")


def folder_of(seed: int, count: int, jobs: int = 2) -> Path:
    """Folder with the sealed cases of a seed, generated where there is none.

    count: size of the whole benchmark they are a part of (about half are of STRATA).
    """
    there = BUILD / "blind" / f"seed{seed}"
    if (there / "sealed.sha256").exists():
        return there
    made = BUILD / "compare" / f"seed{seed}_{count}"
    if not (made / "sealed.sha256").exists():
        generate(seed, made, count, list(STRATA), jobs)
    return made


def cases_of(folder: Path) -> list[dict]:
    """Truths of the cases that count; SealError where they were changed after sealing."""
    return [truth for truth in unseal(folder)["cases"] if truth["stratum"] in STRATA]
