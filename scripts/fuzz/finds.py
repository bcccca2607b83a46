# SPDX-License-Identifier: BSD-3-Clause
"""Writes a find as a file that shows the fault and a text that says what it is and how to see it again."""

from __future__ import annotations

from pathlib import Path

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_bytes, write_text
from scripts.fuzz.search import Find

FOLDER = BUILD / "fuzz" / "finds"


def write(found: Find, seed: int, folder: Path = FOLDER) -> Path:
    """The smallest file, and beside it the .txt; returns the former."""
    path = write_bytes(folder / f"{found.target}-{found.case.key}{found.case.suffix}", found.case.content)
    shown = path.relative_to(ROOT) if path.is_relative_to(ROOT) else path
    lines = [
        f"{found.target}: {found.verdict.kind}",
        f"seed {seed}, turn {found.turn}, {len(found.case.content)} bytes",
        f"again: python -m scripts.fuzz --file {shown}",
        "",
        found.verdict.text,
    ]
    write_text(path.with_name(f"{path.name}.txt"), "\n".join(lines) + "\n")
    return path


def line(found: Find, path: Path) -> str:
    """The find in a line."""
    return f"FOUND {found.target}: {found.verdict.kind}: {path}"
