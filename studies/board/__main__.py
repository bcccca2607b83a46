# SPDX-License-Identifier: BSD-3-Clause
"""Runs the tests that measure figures of a board and writes them to build/studies/board.json.

    make board                              all of them, some minutes
    make board ARGS='-k closed_loop'        those that pytest selects

A figure comes from a test with the marker `study` that calls the fixture `figure` (cocotb_tests/conftest.py); a new
one is a file of its own below FOLDERS.  A test that fails is a line with ``pass`` false under its own name, beside
what it had measured by then.  Exit status 1 where one fails.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_json

FOLDERS = ("board", "encoders", "blocks")  # below cocotb_tests
OUT = BUILD / "studies" / "board.json"


def figures(report: Path) -> list[dict]:
    """The lines of a JUnit report: what each test has measured; a failed test besides under its own name."""
    rows = []
    for case in ElementTree.parse(report).iter("testcase"):
        found = [p.get("value") for p in case.iter("property") if p.get("name") == "figure"]
        rows += [json.loads(text) for text in found]
        if any(case.find(kind) is not None for kind in ("failure", "error")):
            rows.append({"figure": case.get("name"), "ours": None, "target": None, "unit": "test", "pass": False})
    return rows


def merged(old: list[dict], new: list[dict]) -> list[dict]:
    """New lines in place of old ones of the same name."""
    names = {row["figure"] for row in new}
    return [row for row in old if row["figure"] not in names] + new


def main(arguments: list[str]) -> int:
    with tempfile.TemporaryDirectory() as scratch:
        report = Path(scratch) / "report.xml"
        folders = [str(ROOT / "cocotb_tests" / name) for name in FOLDERS]
        command = [sys.executable, "-m", "pytest", "-q", "-m", "study", f"--junitxml={report}"]
        command += ["-o", "junit_family=xunit1", *folders, *arguments]  # the family that has properties of a test
        status = subprocess.run(command, cwd=ROOT).returncode
        if not report.exists():
            return status
        rows = figures(report)
    before = json.loads(OUT.read_text()) if OUT.exists() and arguments else []
    write_json(OUT, merged(before, rows))
    for row in rows:
        print(f"{'pass' if row['pass'] else 'MISSED':7}{row['figure']}: {row['ours']} {row['unit']} ({row['target']})")
    print(f"{len(rows)} figures in {OUT.relative_to(ROOT)}")
    return 0 if rows and all(row["pass"] for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
