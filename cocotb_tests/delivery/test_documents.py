# SPDX-License-Identifier: BSD-3-Clause
"""The texts beside the code: links lead somewhere, section numbers are those of the headings, lists are complete."""

from __future__ import annotations

import re
import subprocess

import pytest

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.conventions.table import READINGS, readings_for
from fluxproof.diagnosis.ground.nominal import load_nominal

CODE = re.compile(r"^```.*?^```", re.S | re.M)
LINK = re.compile(r"\[([^\]]*)\]\(([^)\s]+)\)(?:, section (\d+))?")


def documents():
    """All Markdown files of the repository; without Git, those where most are."""
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True).stdout.split()
    return listed or ["README.md", *(str(p.relative_to(ROOT)) for p in sorted((ROOT / "docs").glob("*.md")))]


def headings(path) -> list[str]:
    return re.findall(r"^#+ +(.*)$", CODE.sub("", path.read_text()), re.M)


def anchor(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("name", documents())
def test_links_and_section_numbers(name):
    path, wrong = ROOT / name, []
    for text, target, section in LINK.findall(CODE.sub("", path.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, place = target.partition("#")
        aim = path.parent / file if file else path
        if not aim.exists():
            wrong.append(f"{target}: no such file")
        elif place and place not in {anchor(h) for h in headings(aim)}:
            wrong.append(f"{target}: no such heading")
        elif section and not any(h.startswith(f"{section}. ") for h in headings(aim)):
            wrong.append(f"{target} has no section {section}")
        number = re.fullmatch(r"section (\d+)", text)
        if number and not place.startswith(f"{number[1]}-"):
            wrong.append(f"[{text}] leads to {target}")
    assert not wrong, "\n".join(wrong)


def test_every_code_of_a_convention_is_listed():
    text = (ROOT / "docs" / "diagnosis.md").read_text()
    section = text[text.index("## 8. ") : text.index("## 9. ")]
    listed = re.findall(r"`(\w+)`", "".join(re.findall(r"^\|.*$", section, re.M)))
    listed.remove("conventions"), listed.remove("rivals")  # the head of the table
    drive = load_nominal(ROOT / "docs" / "drives" / "paper001.toml")
    assert sorted(listed) == sorted([r.code for r in readings_for(drive)] + ["pole_pairs", "sample_time_s"])
    more = ("no", "one", "two", "three", "four", "five", "six")[len(readings_for(drive)) - len(READINGS)]
    assert f"{len(READINGS)}, and {more} more" in section
