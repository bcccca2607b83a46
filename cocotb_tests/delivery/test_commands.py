# SPDX-License-Identifier: BSD-3-Clause
"""Every command as a user starts it: one line for any error and signal, outputs together or not at all, inputs kept."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.processes.commands import STOPPED, write_inputs
from cocotb_tests.support.processes.moments import Moment, contents, run
from fluxproof import files
from fluxproof.checkout import ROOT
from fluxproof.command import main

PART = "xc7z020clg484-1"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    return write_inputs(tmp_path_factory.mktemp("inputs"))


@pytest.fixture
def earlier(tmp_path):
    """OUT with the result of an earlier diagnosis, which had found something."""
    for name in ("report.html", "diagnosis.json", "drive_improved.toml", "flux_map.csv"):
        files.write_text(tmp_path / "out" / name, "earlier")
    return tmp_path / "out"


def diagnose(inputs, out, recording="stopped.csv") -> list:
    return ["diagnose", inputs / recording, "--drive", inputs / "drive.toml", "--out", out, "--quiet"]


def one_line(done, status: int = 2) -> str:
    """The line on stderr of a command that ended with this status."""
    assert done.returncode == status and done.stderr.count("\n") == 1, (done.returncode, done.stderr)
    assert done.stderr.startswith("fluxproof: ")
    return done.stderr.removeprefix("fluxproof: ").rstrip()


IMPORTS = ["fluxproof.command", "numba.core.registry", "_umath"]


@pytest.mark.parametrize("module", IMPORTS)
def test_ctrl_c_during_the_imports(module, inputs, tmp_path):
    """The last one: NumPy makes another exception of it."""
    done = run(tmp_path / "hook", ["registers", inputs / "drive.toml"], Moment("import", module))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", STOPPED)


READING = Moment("open", "stopped.csv")
DECIDING = Moment("os.rename", "fluxproof-done-")
MOVING = Moment("os.rename", r"fluxproof-done-\w+/report\.html")


@pytest.mark.parametrize("moment", [READING, pytest.param(DECIDING, marks=pytest.mark.slow), MOVING])
def test_ctrl_c_in_a_diagnosis(moment, inputs, earlier, tmp_path):
    """Before the decision OUT is as it was, after it complete: without the drive file of the earlier result."""
    before = contents(earlier)
    done = run(tmp_path / "hook", diagnose(inputs, earlier), moment)
    assert (done.returncode, done.stderr) == (130, STOPPED)
    after = contents(earlier)
    assert after == before if moment == READING else set(after) == {"report.html", "diagnosis.json"} and after != before


@pytest.mark.slow
@pytest.mark.parametrize("line", ["sets of effects", "the closed loop over the recording"])
def test_ctrl_c_in_the_inference(line, inputs, earlier, tmp_path):
    before = contents(earlier)
    for out, expected in ((earlier, before), (tmp_path / "new" / "out", None)):
        command = [sys.executable, "-m", "fluxproof", *map(str, diagnose(inputs, out, "good.csv")[:-1])]
        with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
            while (said := process.stderr.readline()) and said.strip() != line:
                pass
            time.sleep(0.05)
            process.send_signal(signal.SIGINT)
            _, left = process.communicate(timeout=60)
        assert process.returncode == 130 and left.endswith(STOPPED) and "Traceback" not in left
        assert contents(out) == expected and not (tmp_path / "new").exists()


OTHERS = {
    "simulate": [],
    "commission": [],
    "project": ["--part", PART],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_ctrl_c_and_a_kill_in_other_commands(name, inputs, tmp_path):
    """Ctrl-C at the renaming, SIGKILL in the middle of the moves: the next run finishes and ends well."""
    out = tmp_path / "out"
    command = [name, inputs / "drive.toml", "--out", out, *OTHERS[name]]
    done = run(tmp_path / "hook", command, Moment("os.rename", "fluxproof-done-"))
    assert done.returncode == 130 and done.stderr == STOPPED and len(contents(out)) >= 2
    killed = Moment("os.rename", r"fluxproof-done-\w+/", after=1, number=signal.SIGKILL)
    assert run(tmp_path / "hook", command, killed).returncode == -signal.SIGKILL
    assert any(key.startswith(".fluxproof-done-") for key in contents(out))
    done = run(tmp_path / "hook", command)
    assert done.returncode == 0, done.stderr
    assert not [key for key in contents(out) if key.startswith(".")]


GUARDED = "import os, signal, sys, warnings\nfrom fluxproof.guard import guarded\nme = os.getpid()\n"
PRESS = "os.kill(me, signal.SIGINT)"
BODIES = {
    "in a destructor": f"class Late:\n def __del__(_): {PRESS}\ndef body():\n Late()\n while True: pass",
    "in a text": f"import fluxproof.diagnosis.command\ndef body(): exec('{PRESS}')",
    "twice": f"def body():\n try: {PRESS}\n finally: {PRESS}",
    "as another error": f"def body():\n try: {PRESS}\n except KeyboardInterrupt: raise ImportError",
    "in a __set_name__": f"class Name:\n def __set_name__(*_): {PRESS}\ndef body():\n class A: x = Name()",
}


@pytest.mark.parametrize("where", BODIES)
def test_ctrl_c_where_python_makes_something_else_of_it(where, tmp_path):
    (tmp_path / "body.py").write_text(f"{GUARDED}{BODIES[where]}\nsys.exit(guarded(body, True))")
    done = run(tmp_path, [], None, [sys.executable, "-m", "body"], cwd=tmp_path)
    assert (done.returncode, done.stderr) == (130, STOPPED)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ZeroDivisionError("by zero"), "internal error: ZeroDivisionError: by zero (print_registers.py:"),
        (RecursionError(), "internal error: RecursionError (print_registers.py:"),
        (KeyError("a\nb"), r"internal error: KeyError: 'a\nb' ("),
        (MemoryError("Unable to allocate 3 GiB"), "not enough memory: Unable to allocate 3 GiB"),
        (OSError(errno.EIO, "Input/output error", "/some/file"), "/some/file: Input/output error"),
        (OSError(errno.EIO, "Input/output error", b"/some/caf\xe9"), "/some/caf"),
        (OSError("odd"), "odd"),
    ],
)
def test_any_error_is_one_line(error, words, inputs, monkeypatch, capsys):
    def fails(*_):
        raise error

    monkeypatch.setattr("fluxproof.print_registers.load_drive", fails)
    monkeypatch.delenv("FLUXPROOF_DEBUG", raising=False)
    assert main(["registers", str(inputs / "drive.toml")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and err.startswith(f"fluxproof: {words}"), err
    monkeypatch.setenv("FLUXPROOF_DEBUG", "1")
    assert main(["registers", str(inputs / "drive.toml")]) == 2
    err = capsys.readouterr().err
    assert err.startswith("Traceback") and "in fails" in err and f"fluxproof: {words}" in err


def test_a_closed_or_full_standard_output(tmp_path):
    full = run(tmp_path, ["--help"], capture_output=False, stdout=open("/dev/full", "w"), stderr=subprocess.PIPE)  # noqa: SIM115
    assert one_line(full) == "standard output: No space left on device"
    for closed in ("1>&-", "2>&-", "1>&- 2>&-"):
        done = run(tmp_path, [], program=["sh", "-c", f'"{sys.executable}" -m fluxproof --help {closed}'])
        assert done.returncode == 0 and not done.stderr
    done = run(tmp_path, [], program=["sh", "-c", f'"{sys.executable}" -m fluxproof --help | true'])
    assert done.returncode == 0 and not done.stderr


def test_an_argument_that_is_no_text(tmp_path):
    for arguments in (["registers", b"caf\xe9.toml"], ["registers", "new\nline\x1b[2J.toml"]):
        line = one_line(run(tmp_path, arguments))
        assert "No such file" in line and ("caf" in line or "new line" in line) and "\x1b" not in line


def test_a_broken_installation_is_one_line(tmp_path):
    (tmp_path / "numpy.py").write_text("raise ImportError('broken')")
    program = ["env", f"PYTHONPATH={tmp_path}:{ROOT}", sys.executable, "-m", "fluxproof"]
    assert "ImportError: broken (" in one_line(run(tmp_path, ["registers", PAPER], program=program))


def test_warnings_are_for_debugging(tmp_path, monkeypatch):
    body = f"{GUARDED}import logging\ndef body():\n warnings.warn('one')\n logging.warning('two')\n return 0\n"
    command = [sys.executable, "-c", f"{body}sys.exit(guarded(body, True))"]
    assert run(tmp_path, [], None, command).stderr == ""
    environment = {**os.environ, "FLUXPROOF_DEBUG": "1", "PYTHONPATH": str(ROOT)}
    told = run(tmp_path, [], None, command, env=environment).stderr
    assert "one" in told and "two" in told


def test_help_is_quick(tmp_path):
    """Only the chosen subcommand is imported."""
    code = "import sys, fluxproof.command as c; c.parser(); print([m for m in ('numpy', 'numba') if m in sys.modules])"
    assert run(tmp_path, [], program=[sys.executable, "-c", code]).stdout.strip() == "[]"


def test_a_file_that_cannot_be_written_whole(inputs, tmp_path):
    """A limit of the file size in place of a full disk: the earlier file stays, nothing else does."""
    target = tmp_path / "settings" / "registers.json"
    files.write_text(target, "earlier")

    def small():
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))

    done = run(tmp_path, ["registers", inputs / "drive.toml", "--json", target], preexec_fn=small)
    assert one_line(done) == f"{target}: File too large"
    assert contents(target.parent) == {"registers.json": b"earlier"}


@pytest.mark.parametrize("name", ["diagnosis.json", "report.html"])
def test_a_full_disk_in_a_diagnosis(name, inputs, earlier, tmp_path, monkeypatch, capsys):
    original = Path.write_bytes

    def full(path, data):
        if name in path.name:
            original(path, data[:1000])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return original(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    for out in (earlier, tmp_path / "new"):
        before = contents(out)
        assert main([*map(str, diagnose(inputs, out))]) == 2
        assert capsys.readouterr().err == f"fluxproof: {out / name}: No space left on device\n"
        assert contents(out) == before


def refused(arguments, kept: list[Path], capsys) -> None:
    before = [path.read_bytes() for path in kept]
    assert main([*map(str, arguments)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "would be overwritten" in err, err
    assert [path.read_bytes() for path in kept] == before


def test_no_command_overwrites_its_input(inputs, tmp_path, capsys):
    drive, registers, words = tmp_path / "d.toml", tmp_path / "r.json", tmp_path / "run.fluxdump"
    drive.write_bytes(PAPER.read_bytes())
    registers.write_text("{}")
    words.write_bytes(b"words")
    refused(["registers", drive, "--json", drive], [drive], capsys)
    dump = ["dump", words, "--drive", drive, "--registers", registers]
    for more in ([], ["-o", words], ["-o", drive], ["-o", registers]):
        refused([*dump, *more], [drive, registers, words], capsys)
    out = tmp_path / "out"
    out.mkdir()
    for name, command in (
        ("simulation.json", ["simulate", drive, "--out", out]),
        ("report.html", ["simulate", drive, "--out", out]),
        ("drive.toml", ["commission", drive, "--out", out]),
        ("commission.json", ["commission", drive, "--out", out]),
        ("drive_pkg.vhd", ["project", drive, "--part", PART, "--out", out]),
        ("diagnosis.json", ["diagnose", inputs / "good.csv", "--drive", drive, "--out", out]),
        ("report.html", ["diagnose", drive, "--drive", inputs / "drive.toml", "--out", out]),
        ("flux_map.csv", [*diagnose(inputs, out), "--prior", drive]),
        ("fleet.html", ["fleet", inputs / "good.csv", "--drive", drive, "--out", out]),
        ("fleet.parquet", ["fleet", out / "fleet.parquet", "--drive", drive, "--out", out]),
    ):
        for link in (os.link, os.symlink):
            link(drive, out / name)
            refused(command, [drive, out / name], capsys)
            assert os.listdir(out) == [name]
            (out / name).unlink()
