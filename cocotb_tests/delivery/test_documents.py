# SPDX-License-Identifier: BSD-3-Clause
"""The texts beside the code: links lead somewhere, section numbers are those of the headings, lists are complete.

Commands that select tests select at least one, paths exist, and tests that are named exist.
"""

from __future__ import annotations

import re
import subprocess

import pytest
from _pytest.mark import KeywordMatcher  # what -k itself uses; there is no public name
from _pytest.mark.expression import Expression

from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import ROOT
from fluxproof.diagnosis.conventions.table import READINGS, readings_for
from fluxproof.diagnosis.ground.nominal import load_nominal

CODE = re.compile(r"^```.*?^```", re.S | re.M)
COMMAND = re.compile(r"""(?:make (\w+) )?(?:ARGS=['"])?-k ("[^"]+"|'[^']+'|\w+)""")
FOLDERS = ("cocotb_tests", "fluxproof", "golden_model", "rtl", "scripts", "studies", "tb")
PATH = re.compile(rf"`((?:{'|'.join(FOLDERS)})/[\w/.-]+)`")
RUNS = {  # what a target runs, by the markers of a test
    "test": lambda marks: not marks & {"slow", "study"},
    "slow": lambda marks: "slow" in marks,
    "board": lambda marks: "study" in marks,
    "": lambda marks: True,
}
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
    drive = load_nominal(PAPER)
    assert sorted(listed) == sorted([r.code for r in readings_for(drive)] + ["pole_pairs", "sample_time_s"])
    more = ("no", "one", "two", "three", "four", "five", "six")[len(readings_for(drive)) - len(READINGS)]
    assert f"{len(READINGS)}, and {more} more" in section


def selections(text: str) -> list[tuple[str, str]]:
    """(make target or "", expression) of each ``-k EXPRESSION`` of a text; capitals stand for any name."""
    found = COMMAND.findall(" ".join(text.split()))
    return [(target, word.strip("\"'")) for target, word in found if not word.isupper()]


def selected(target: str, expression: str, tests) -> bool:
    """Whether ``-k expression`` leaves a test of the target."""
    wanted = Expression.compile(expression)
    return any(
        RUNS[target]({mark.name for mark in test.iter_markers()}) and wanted.evaluate(KeywordMatcher.from_item(test))
        for test in tests
    )


def test_every_command_selects_a_test(all_tests):
    texts = [*documents(), "Makefile", "studies/board/__main__.py", "fluxproof/cosim/bench_plan.py"]
    commands = {(name, *found) for name in texts for found in selections((ROOT / name).read_text())}
    assert len(commands) > 30
    missed = [command for command in sorted(commands) if not selected(*command[1:], all_tests)]
    assert not missed, missed


def test_a_command_that_selects_nothing_is_noticed(all_tests):
    text = "`make\nslow ARGS='-k test_documents'`, `make test ARGS='-k \"no_such or test_documents\"'`, "
    found = selections(text + "`-k no_such`, `-k NAME`")
    assert found == [("slow", "test_documents"), ("test", "no_such or test_documents"), ("", "no_such")]
    assert [selected(*command, all_tests) for command in found] == [False, True, False]


@pytest.mark.parametrize("name", sorted(set(documents()) - {"CHANGELOG.md"}))  # which names files of earlier versions
def test_paths_exist(name):
    named = [path for path in PATH.findall((ROOT / name).read_text()) if not re.search("[A-Z]{4}", path)]
    gone = [path for path in named if not (ROOT / path).exists()]
    assert not gone, gone


def test_tests_that_are_named_exist(all_tests):
    known = {test.name.partition("[")[0] for test in all_tests} | {test.path.stem for test in all_tests}
    texts = [name for name in documents() if name != "CHANGELOG.md"]
    named = {word for name in texts for word in re.findall(r"`(test_\w+)(?:\.py)?`", (ROOT / name).read_text())}
    assert named and not named - known, named - known


@pytest.mark.parametrize(("name", "most"), [("README.md", 150), ("docs/diagnosis.md", 300)])
def test_a_document_that_is_read_whole_stays_short(name, most):
    assert len((ROOT / name).read_text().splitlines()) <= most
