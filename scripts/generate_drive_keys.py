# SPDX-License-Identifier: BSD-3-Clause
"""docs/drive_file.md: every key of a drive file with its unit, range and default, from its declaration.

``make generate`` writes it (scripts/generate.py); a test compares the committed file.
"""

from __future__ import annotations

import dataclasses
import inspect
from pathlib import Path

from golden_model.drive import SECTIONS
from golden_model.drive_keys import RANGES, Key, key_of

DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "drive_file.md"

HEADER = """\
<!-- Written by `make generate` from golden_model/drive.py and the files it imports; a test compares it. -->
# Keys of a drive file

A drive is one TOML file in SI units: peak values, amplitude-invariant dq frames, electrical angles and speeds unless a
key says otherwise. [docs/drives](drives) has complete examples. A key that is missing, misspelt, of a wrong type or out
of range is refused with its section and what is allowed; `fluxproof registers drive.toml` prints the integers that the
core gets.

"allowed" leaves room for every drive from a vibration motor to a generator of 50 MW, so that "any", "above 0" and
"0 or more" are bounded too. "default" is what a file without the key means: **required** keys have none, and "-" is
calculated from the other keys unless the last column says what it means. Keys for recordings and for physics beyond the
core's model (`[columns]`, `[constants]`, `[plant.*]`) belong to the diagnosis: [recordings.md](recordings.md),
[diagnosis.md](diagnosis.md).
"""


def allowed(key: Key) -> str:
    """The range in the words of the error messages."""
    if key.kind == "bool":
        return "true, false"
    several = f"{key.count} values, each " if key.count else ""
    if key.kind == "float" and key.hi == RANGES[key.unit][1]:  # as wide as its unit
        return several + ("0 or more" if key.lo == 0.0 else "above 0" if key.lo > 0.0 else "any")
    return several + key.allowed.removesuffix("" if key.unit == "1" else f" {key.unit}")


def default(field: dataclasses.Field) -> str:
    """The value that a file without the key means."""
    value = field.default
    if value is dataclasses.MISSING:
        return "**required**"
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(f"{v:.4g}" for v in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def section(name: str, kind: type) -> list[str]:
    """The table of one section, under what its class says of it."""
    said = inspect.cleandoc(kind.__doc__ or "").split("]", 1)[1].strip(" ,;:.\n").replace("``", "`")
    lines = [f"\n## [{name}]\n"]
    if said:
        lines += [said[0].upper() + said[1:] + ("" if said.endswith(".") else "."), ""]
    lines += ["| key | unit | allowed | default | |", "|---|---|---|---|---|"]
    for field in dataclasses.fields(kind):
        key = key_of(field)
        unit = "" if key.unit == "1" else key.unit
        lines.append(f"| `{field.name}` | {unit} | {allowed(key)} | {default(field)} | {key.doc} |")
    return lines


def document() -> str:
    """The whole page."""
    lines = [line for name, kind in SECTIONS.items() for line in section(name, kind)]
    return HEADER + "\n".join(lines) + "\n"
