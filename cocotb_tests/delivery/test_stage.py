# SPDX-License-Identifier: BSD-3-Clause
"""Results enter their folder together or not at all: exceptions, full disks, signals, killed and simultaneous runs."""

from __future__ import annotations

import errno
import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from cocotb_tests.support.processes.moments import Moment, contents, run
from fluxproof.checkout import ROOT
from fluxproof.files import refuse_overwriting, stem_of, write_bytes, write_text
from fluxproof.stage import DONE, NEW, PLAN, alone, check, together

NAMES = ("a", "b", "gone")
EARLIER = {"a": b"1", "b": b"1", "gone": b"1", "mine": b"mine"}
LATER = {"a": b"2", "b": b"2", "mine": b"mine"}
RUN = """
import sys
from fluxproof.files import write_text
from fluxproof.stage import together
for number in sys.argv[2:]:
    with together(sys.argv[1], ("a", "b", "gone")) as stage:
        for name in "ab":
            write_text(stage / name, number)
"""


@pytest.fixture
def out(tmp_path):
    """A folder with an earlier result and a file of the user."""
    for name, data in EARLIER.items():
        write_bytes(tmp_path / "out" / name, data)
    return tmp_path / "out"


def write(folder, number="2"):
    with together(folder, NAMES) as stage:
        for name in "ab":
            write_text(stage / name, number)


def test_a_result_replaces_the_earlier_one(out):
    write(out)
    assert contents(out) == LATER and (out / "a").stat().st_mode & 0o777 == 0o666 & ~umask()


def umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit, MemoryError])
def test_an_exception_leaves_the_folder_as_it_was(out, tmp_path, error):
    for folder in (out, tmp_path / "new" / "deep"):
        before = contents(folder)
        with pytest.raises(error), together(folder, NAMES) as stage:
            write_text(stage / "a", "2")
            raise error
        assert contents(folder) == before
    assert not (tmp_path / "new").exists()


# Six moments: before the decision, at it, before the removal, each move, and the removal of the hidden folder.
KILLED = [
    (Moment("open", re.escape(PLAN), after=1), EARLIER),
    (Moment("os.rename", re.escape(DONE)), EARLIER),
    (Moment("os.remove", "out/gone"), LATER),
    (Moment("os.rename", rf"{DONE}\w+/a$"), LATER),
    (Moment("os.rename", rf"{DONE}\w+/b$"), LATER),
    (Moment("shutil.rmtree", re.escape(DONE)), LATER),
]


@pytest.mark.parametrize(("moment", "result"), KILLED)
def test_the_next_run_finishes_or_removes_what_a_killed_one_left(out, tmp_path, moment, result):
    moment = moment._replace(number=signal.SIGKILL)
    done = run(tmp_path / "hook", [out, "2"], moment, [sys.executable, "-c", RUN])
    assert done.returncode == -signal.SIGKILL
    assert any(name.startswith((NEW, DONE)) for name in os.listdir(out)), "nothing was interrupted"
    with pytest.raises(ValueError), together(out, NAMES):
        assert {n: d for n, d in contents(out).items() if not n.startswith((NEW, DONE))} == result
        raise ValueError
    assert contents(out) == result


@pytest.mark.parametrize("moment", [moment for moment, _ in KILLED[1:]])
def test_ctrl_c_waits_for_the_end_of_the_moves(out, tmp_path, moment):
    done = run(tmp_path / "hook", [out, "2", "3"], moment, [sys.executable, "-c", RUN])
    assert "KeyboardInterrupt" in done.stderr and contents(out) == LATER


def test_two_runs_into_one_folder(tmp_path):
    """The files are always of one run, none is lost, and no hidden folder stays."""
    out = tmp_path / "out"
    counts = [[str(n + 2 * k) for k in range(40)] for n in range(2)]
    options = dict(env={**os.environ, "PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE)
    processes = [subprocess.Popen([sys.executable, "-c", RUN, str(out), *own], **options) for own in counts]
    for process in processes:
        assert process.wait(120) == 0, process.stderr.read()
    found = contents(out)
    assert set(found) == {"a", "b"} and found["a"] == found["b"]
    assert found["a"].decode() in (counts[0][-1], counts[1][-1])


def test_the_folder_of_a_running_process_stays(out):
    with together(out, NAMES) as stage:
        write_text(stage / "a", "3")
        write(out)
        assert stage.exists() and (stage / "a").read_bytes() == b"3"
    assert contents(out) == {"a": b"3", "mine": b"mine"}


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 64 KiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(folder)]
    try:
        made = subprocess.run(mount, capture_output=True).returncode == 0
    except FileNotFoundError:
        made = False
    if not made:
        pytest.skip("only root can mount a small disk")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_is_named_and_leaves_the_earlier_result(small_disk):
    out = small_disk / "out"
    write(out, "1")
    before = contents(small_disk)
    with pytest.raises(OSError) as full, together(out, NAMES) as stage:
        write_text(stage / "a", "2")
        write_bytes(stage / "b", bytes(100_000))
    assert full.value.errno == errno.ENOSPC and full.value.filename == str(out / "b")
    with pytest.raises(OSError) as full:
        write_bytes(out / "b", bytes(100_000))
    assert full.value.errno == errno.ENOSPC and full.value.filename == str(out / "b")
    assert contents(small_disk) == before


def test_a_file_that_becomes_too_long_is_named(out):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(OSError) as long, alone(out / "a") as file:
            write_bytes(file, bytes(10_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert long.value.errno == errno.EFBIG and long.value.filename == str(out / "a")
    assert contents(out) == EARLIER


@pytest.mark.parametrize("write_it", [lambda out: write(out), lambda out: write_bytes(out / "a", b"2")])
def test_a_folder_in_the_place_of_a_file_is_named(tmp_path, write_it):
    (tmp_path / "out" / "a").mkdir(parents=True)
    with pytest.raises(OSError) as found:
        write_it(tmp_path / "out")
    assert found.value.filename == str(tmp_path / "out" / "a") and contents(tmp_path / "out") == {}
    assert os.listdir(tmp_path / "out") == ["a"]


def test_devices_and_pipes_are_written_and_not_replaced(tmp_path):
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    with alone(pipe) as file:
        write_text(file, "text")
    reader.join(10)
    assert read == [b"text"] and pipe.is_fifo()
    write_text(Path("/dev/null"), "text")
    assert Path("/dev/null").is_char_device()


def test_a_link_is_replaced_and_its_target_kept(out):
    (out / "a").unlink()
    (out / "a").symlink_to(out / "mine")
    write(out)
    assert contents(out) == LATER and not (out / "a").is_symlink()


@pytest.mark.parametrize("name", [f"{DONE}x", f"{NEW}x", ".fluxproof-done", ".fluxproof-backup"])
@pytest.mark.parametrize("removes", [["mine"], ["../other"], ["a\0b"], ["\ud800"], ["x" * 300], None])
def test_a_hidden_folder_from_a_stranger_is_left_alone(out, tmp_path, name, removes):
    """It cannot know its place on the disk, without which its plan removes and overwrites nothing."""
    write_text(tmp_path / "other", "other")
    write_text(out / name / "mine", "evil")
    plans = [json.dumps({"place": [1, 2], "remove": removes}), json.dumps(removes), "[" * 100_000, "{"]
    for plan in plans:
        write_text(out / name / PLAN, plan)
        write(out)
        assert (out / "mine").read_text() == "mine" and (tmp_path / "other").read_text() == "other"
        assert (out / name / "mine").read_text() == "evil" and (out / "a").read_bytes() == b"2"


def test_a_file_or_a_link_with_a_hidden_name_is_no_obstacle(out, tmp_path):
    write_text(tmp_path / "elsewhere" / PLAN, "[]")
    (out / f"{DONE}x").symlink_to(tmp_path / "elsewhere")
    write_text(out / f"{NEW}x", "text")
    write_text(out / ".fluxproof-done", "text")
    write(out)
    assert contents(tmp_path / "elsewhere") == {PLAN: b"[]"} and (out / "a").read_bytes() == b"2"


def test_an_input_is_no_output(tmp_path):
    drive, other = tmp_path / "drive.toml", tmp_path / "other.toml"
    write_text(drive, "drive")
    write_text(other, "other")
    (tmp_path / "link").symlink_to(drive)
    os.link(drive, tmp_path / "hard")
    (tmp_path / "folder").mkdir()
    refuse_overwriting([other, tmp_path / "new"], [drive, None, "", tmp_path / "none", "s3://bucket/key"])
    for target in (drive, tmp_path / "link", tmp_path / "hard", tmp_path / "folder" / ".." / "drive.toml"):
        with pytest.raises(OSError, match="would be overwritten") as refused:
            refuse_overwriting([other, target], [str(drive)])
        assert refused.value.filename == str(target)


def test_a_folder_is_tried_before_the_work(out, tmp_path):
    before = contents(out)
    check(out, NAMES)
    check(tmp_path / "new" / "deep", NAMES)
    assert contents(out) == before and not (tmp_path / "new").exists()
    with pytest.raises(OSError, match="mine"):
        check(out / "mine", NAMES)
    assert contents(out) == before


@pytest.mark.parametrize(
    ("name", "stem"), [("...csv", "recording"), ("a.b.csv", "a.b"), ("..", "recording"), (".x", "x")]
)
def test_a_name_of_a_file_stays_in_its_folder(name, stem):
    assert stem_of(f"folder/{name}") == stem
