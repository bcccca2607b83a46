# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of a simulation: one file, no script, nothing loaded; the style is the diagnosis' report's."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from fluxproof.diagnosis.report import page as diagnosis_page
from fluxproof.quote import pages
from golden_model.drive import SECTIONS, Drive
from golden_model.drive_keys import key_of

FOLDER = Path(__file__).resolve().parent
ATTRIBUTE = {"bases": "base_choice"}  # section -> attribute of Drive, where the names differ


def render(data: dict, drive: Drive, pictures: dict) -> str:
    """The page as one string; ``data`` is that of simulation.json."""
    context = {
        **data,
        "mood": "good" if data["status"] == "ok" else "bad",
        "seconds": f"{data['scene'][-1]['to_s']:.3g}",
        "unit": data["reference_unit"],
        "pictures": pictures,
        "sections": described(drive),
        "shown": lambda value: "–" if value is None else f"{value:.5g}",
    }
    return pages(FOLDER, diagnosis_page.FOLDER).get_template("simulate.html").render(context)


def described(drive: Drive) -> dict[str, list[dict]]:
    """{section: rows of key, value, unit} of what the file gives, defaults left out."""
    sections = {}
    for name in SECTIONS:
        section = getattr(drive, ATTRIBUTE.get(name, name))
        rows = []
        for field in dataclasses.fields(section):
            value, unit = getattr(section, field.name), key_of(field).unit
            if value is not None and value != field.default:
                rows.append({"key": field.name, "value": value, "unit": "" if unit == "1" else unit})
        if rows:
            sections[name] = rows
    return sections
