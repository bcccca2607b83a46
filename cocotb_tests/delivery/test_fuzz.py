# SPDX-License-Identifier: BSD-3-Clause
"""`make fuzz`: a fixed number of cases of each target without a find, and planted faults that the judge must notice."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from fluxproof.diagnosis.readers import read_table

hypothesis = pytest.importorskip("hypothesis", reason="hypothesis is not installed")

from cocotb_tests.support.untrusted import planted_faults  # noqa: E402
from scripts.fuzz import corpus, finds  # noqa: E402
from scripts.fuzz.__main__ import again, main  # noqa: E402
from scripts.fuzz.case import Case, Verdict  # noqa: E402
from scripts.fuzz.search import Search  # noqa: E402
from scripts.fuzz.smaller import smaller  # noqa: E402
from scripts.fuzz.targets import by_name, names  # noqa: E402
from scripts.fuzz.worker import Worker  # noqa: E402

SEED = 46
# Of each target but diagnose, which takes seconds a case.
CASES = {"readers": 150, "drives": 150, "manifests": 60, "dumps": 40, "project": 40, "scenes": 5}


@pytest.fixture(scope="module")
def worker():
    made = Worker()
    yield made
    made.close()


def test_every_target_has_its_cases():
    assert set(CASES) == set(names()) - {"diagnose"}


@pytest.mark.parametrize("name", sorted(CASES))
def test_no_find_among_the_fixed_cases(name, worker, tmp_path):
    search = Search(by_name(name), SEED, worker, shrinking=5.0)
    found = search.turn(CASES[name])
    assert not found, "\n".join(f"{finds.line(f, finds.write(f, SEED))}\n{f.verdict.text}" for f in found)
    assert search.cases >= CASES[name] // 2


def test_the_same_seed_draws_the_same_cases():
    class Recorded:
        def __init__(self):
            self.cases = []

        def verdict(self, target, case):
            self.cases.append(case)
            return Verdict()

    drawn = []
    for seed in (1, 1, 2):
        recorded = Recorded()
        Search(by_name("drives"), seed, recorded).turn(20)
        drawn.append(recorded.cases)
    assert drawn[0] == drawn[1] != drawn[2] and len(drawn[0]) > 10


def test_valid_files_are_read(tmp_path):
    """Damage to files that no reader takes would show nothing."""
    for number, (suffix, content) in enumerate(corpus.recordings()):
        path = tmp_path / f"valid{number}{suffix}"
        path.write_bytes(content)
        assert len(read_table(path).columns) >= 2, path


@pytest.mark.parametrize("letter", sorted(planted_faults.FAULTS))
def test_planted_fault_is_noticed(letter, worker):
    verdict = worker.verdict(planted_faults, Case(".bin", f"..{letter}".encode()))
    assert verdict.kind.startswith(planted_faults.EXPECTED[letter]), verdict
    assert letter in "mcqh" or "planted_faults.py" in verdict.kind, verdict
    assert not Path(planted_faults.ELSEWHERE).exists()


def test_what_is_right_is_no_find(worker):
    assert not worker.verdict(planted_faults, Case(".bin", b"...")).kind


def test_search_finds_faults_of_several_kinds_and_makes_them_small(worker, tmp_path):
    search = Search(planted_faults, 1, worker, shrinking=5.0)
    while len(search.finds) < 3 and search.turns < 12:
        search.turn(300)
    assert len(search.finds) >= 3, search.finds
    for found in search.finds.values():
        assert len(found.case.content) == 1 and chr(found.case.content[0]) in planted_faults.FAULTS
    path = finds.write(found, 1, tmp_path)
    assert path.read_bytes() == found.case.content
    said = path.with_name(f"{path.name}.txt").read_text()
    assert found.verdict.kind in said and "seed 1" in said and f"--file {path}" in said


def test_lines_and_blocks_are_left_out():
    text = b"".join(b"line %d\n" % k for k in range(200))
    assert smaller(text, lambda c: b"line 77\n" in c and b"line 150\n" in c, 10.0) == b"line 77\nline 150\n"
    content = bytearray(random.Random(1).randbytes(4000))
    content[2000:2004] = b"\0EVL"
    assert len(smaller(bytes(content), lambda c: b"\0EVL" in c, 10.0)) <= 16


def test_a_file_is_judged_again_by_the_command(worker, tmp_path, capsys, monkeypatch):
    """By its target; a harmless one has status 0, a find status 1."""
    path = tmp_path / "drives-0123.toml"
    path.write_bytes(corpus.drives()[1])
    assert again("drives", path, worker) == 0
    assert capsys.readouterr().out == "drives: nothing wrong\n"
    monkeypatch.setattr("scripts.fuzz.__main__.by_name", lambda name: planted_faults)
    path.write_bytes(b"k")
    assert again("planted", path, worker) == 1
    assert "KeyError" in capsys.readouterr().out


def test_ctrl_c_keeps_what_was_found():
    """Also what the interrupted turn has not made small yet."""

    class Interrupted:
        failed = False

        def verdict(self, target, case):
            if self.failed:
                raise KeyboardInterrupt
            self.failed = b"k" in case.content
            return Verdict("KeyError" if self.failed else "")

    search = Search(planted_faults, 1, Interrupted())
    with pytest.raises(KeyboardInterrupt):
        search.turn(300)
    assert list(search.finds) == ["KeyError"] and search.turns == 1


def test_a_run_without_a_case_is_no_success(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["fuzz", "--minutes", "0", "--only", "drives,manifests"])
    assert main() == 1
    assert "no case of drives, manifests" in capsys.readouterr().out
