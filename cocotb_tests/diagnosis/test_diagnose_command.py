# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof diagnose` as a command: exit status, files, printed text; the digital part end to end."""

from __future__ import annotations

import io
import json
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from cocotb_tests.support.diagnoses.schema import failures
from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings import from_core as bench
from cocotb_tests.support.recordings.from_equations import nominal_of
from cocotb_tests.support.recordings.with_mistake import MISTAKES, written
from cocotb_tests.support.slow import slowly
from cocotb_tests.support.untrusted.damaged_files import changed_files
from fluxproof import command as fluxproof
from fluxproof.checkout import ROOT
from fluxproof.diagnosis import command, session
from fluxproof.diagnosis import diagnose as run_diagnosis
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.replay import telemetry
from golden_model import drive as drives
from golden_model.io import telemetry_words
from golden_model.registers import registers
from golden_model.units import to_si

SHORT = bench.GRID[:18]
FLUX = 0.95 * bench.MACHINE.magnet_flux_wb


def diagnose(out, *recordings, drive=PAPER, more=()):
    """Exit status of the command."""
    return fluxproof.main(["diagnose", *map(str, recordings), "--drive", str(drive), "--out", str(out), *more])


def answer(out) -> dict:
    """diagnosis.json, which must follow the schema."""
    data = json.loads((out / "diagnosis.json").read_text())
    assert failures(data) == []
    return data


@pytest.fixture(scope="module")
def dump():
    """(samples, observed) of a drive whose magnets are 5 % weaker than drive.toml says."""
    return bench.dumped(SHORT, {"magnet_flux_wb": FLUX})


def write_dump(path, dump, values=bench.SET.values, rows=None):
    samples, observed = dump
    seen = {name: observed[name][:rows] for name in telemetry_words.PACKET}
    return telemetry.write_dump(path, bench.DRIVE, bench.SET._replace(values=values), samples[:rows], seen)


@pytest.fixture(scope="module")
def explained(dump, tmp_path_factory):
    """The output folder of a correct telemetry dump, and the printed text."""
    folder = tmp_path_factory.mktemp("explained")
    path = write_dump(folder / "run.dump", dump)
    done = subprocess.run(
        [sys.executable, "-m", "fluxproof.command", "diagnose", path, "--drive", PAPER, "--out", folder / "out"],
        cwd=ROOT, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "out", done


def test_answer_on_stdout_and_progress_on_stderr(explained):
    out, done = explained
    lines = done.stdout.splitlines()
    assert lines[0] == answer(out)["sentence"] and "magnet" in lines[0].lower()
    assert any(line.startswith("magnet_flux  magnet_flux_wb  0.156") for line in lines)
    assert f"wrote {out / 'report.html'}" in lines and f"wrote {out / 'drive_improved.toml'}" in lines
    progress = done.stderr.splitlines()
    assert progress[0].startswith("reading ") and "replaying the core" in progress and "\x1b" not in done.stderr
    assert len(set(progress)) == len(progress)


def test_outputs_with_a_correct_controller(explained, dump):
    out, _ = explained
    data = answer(out)
    assert data["verdict"] == "explained" and [e["name"] for e in data["effects"]] == ["magnet_flux"]
    assert data["digital"] == {"checked": True, "samples": len(dump[0]), "first_difference": None}
    assert any("equals its golden model" in note for note in data["notes"])
    assert any("closed-loop" in note and "improved" in note for note in data["notes"])
    page = (out / "report.html").read_text()
    assert data["sentence"].split(" (")[0] in page and 'id="overlay"' in page


def test_advice_is_printed_and_the_report_opened(dump, tmp_path, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr(command.webbrowser, "open", lambda page: opened.append(page) or len(opened) < 2)
    path = write_dump(tmp_path / "run.dump", dump, rows=150)
    assert diagnose(tmp_path / "out", path, more=["--open", "--quiet"]) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines()[1] == answer(tmp_path / "out")["advice"] != ""
    assert opened == [(tmp_path / "out" / "report.html").resolve().as_uri()] and printed.err == ""
    assert diagnose(tmp_path / "out", path, more=["--open", "--quiet"]) == 0
    assert "no browser" in capsys.readouterr().err


def test_the_improved_drive_is_one_that_registers_takes(explained, capsys):
    out, _ = explained
    path = out / "drive_improved.toml"
    assert load_nominal(path).machine.magnet_flux_wb == pytest.approx(FLUX, rel=2e-3)
    before, after = registers(bench.DRIVE).values, registers(drives.load(path)).values
    changed = {name for name in before._fields if getattr(before, name) != getattr(after, name)}
    follow = {"delta_max", "speed_kp", "speed_ki", "emf_min", "emf_w", "residual_min", "residual_w"}
    assert "lambda_mg" in changed and not changed - follow - {"lambda_mg"}, changed
    assert fluxproof.main(["registers", str(path)]) == 0 and "lambda_mg" in capsys.readouterr().out


def test_the_improved_drive_leaves_no_mismatch(explained, dump, tmp_path, capsys):
    out, _ = explained
    path = write_dump(tmp_path / "run.dump", dump)
    improved = tmp_path / "drive.toml"
    improved.write_bytes((out / "drive_improved.toml").read_bytes())
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "drive_improved.toml").write_text("of an earlier run\n")
    assert diagnose(tmp_path / "out", path, drive=improved, more=["--quiet"]) == 0
    printed = capsys.readouterr()
    assert answer(tmp_path / "out")["verdict"] == "no_mismatch" and printed.err == ""
    assert not (tmp_path / "out" / "drive_improved.toml").exists() and "drive_improved" not in printed.out


def test_the_drive_to_diagnose_is_never_overwritten(explained, dump, tmp_path, capsys):
    out, _ = explained
    mine = tmp_path / "drive_improved.toml"
    mine.write_bytes((out / "drive_improved.toml").read_bytes())
    before = mine.read_bytes()
    assert diagnose(tmp_path, write_dump(tmp_path / "run.dump", dump, rows=2000), drive=mine) == 2
    assert "would be overwritten" in capsys.readouterr().err and mine.read_bytes() == before


@pytest.mark.parametrize("used", [False, True])
def test_a_flux_map_of_the_user_is_never_overwritten(explained, dump, tmp_path, capsys, used):
    drive, mine, out = tmp_path / "drive.toml", tmp_path / "out" / "flux_map.csv", tmp_path / "out"
    text = (explained[0] / "drive_improved.toml").read_text()
    drive.write_text(text + ('\n[plant.machine]\nflux_map = "out/flux_map.csv"\n' if used else ""))
    out.mkdir()
    mine.write_text("mine\n")
    if used:
        (out / "diagnosis.json").write_text("{}\n")
    assert diagnose(out, write_dump(tmp_path / "run.dump", dump, rows=2000), drive=drive) == 2
    assert "would be overwritten" in capsys.readouterr().err and mine.read_text() == "mine\n"


@pytest.mark.parametrize(
    ("register", "bit", "block"), [("kp_q", 5, "current_pi"), ("k_delay", 4, "svm_delay_compensation")]
)
def test_a_flipped_register_bit_is_found_before_any_physics(register, bit, block, dump, tmp_path, capsys):
    changed = bench.SET.values._replace(**{register: getattr(bench.SET.values, register) ^ (1 << bit)})
    assert diagnose(tmp_path / "out", write_dump(tmp_path / "run.dump", dump, changed, rows=3000)) == 0
    data = answer(tmp_path / "out")
    found = data["digital"]["first_difference"]
    assert data["verdict"] == "digital_mismatch" and data["effects"] == [] and data["digital"]["checked"]
    assert (found["block"], found["cause_name"], found["cause_bit"]) == (block, register, bit)
    recorded = int(dump[1][found["signal"]][found["sample"]])
    assert found["recorded_si"] == pytest.approx(to_si(found["signal"], recorded, bench.DRIVE))
    first = capsys.readouterr().out.splitlines()[0]
    for word in (
        f"block {block}",
        f"sample {found['sample']}",
        f"signal {found['signal']}",
        f"bit {found['bit']}",
        register,
    ):
        assert word in first, first
    assert not (tmp_path / "out" / "drive_improved.toml").exists()
    assert block in (tmp_path / "out" / "report.html").read_text()


def test_a_dump_without_steady_stretch_is_still_replayed(dump, tmp_path, capsys):
    assert diagnose(tmp_path / "out", write_dump(tmp_path / "run.dump", dump, rows=150)) == 0
    data = answer(tmp_path / "out")
    assert data["verdict"] == "bad_recording" and data["digital"]["samples"] == 150
    assert "150 samples equal to the golden model" in capsys.readouterr().out


def table_of(path, rows=None, **changes):
    columns = bench.columns(SHORT) | changes
    frame = pd.DataFrame({name: values[:rows] for name, values in columns.items()})
    frame.to_csv(path, index=False) if path.suffix == ".csv" else frame.to_parquet(path)
    return path


def test_several_recordings_are_one_diagnosis(tmp_path, monkeypatch, capsys):
    halves = [table_of(tmp_path / f"part{k}.parquet") for k in range(2)]
    monkeypatch.chdir(tmp_path)
    assert fluxproof.main(["diagnose", *map(str, halves), "--drive", str(PAPER), "--quiet"]) == 0
    out = tmp_path / "build" / "diagnosis" / "part0_and_1_more"
    data = answer(out)
    assert data["verdict"] == "no_mismatch" and data["recording"]["rows"] == 2 * len(bench.columns(SHORT)["t"])
    assert not data["digital"]["checked"]


def test_every_file_that_was_written_is_listed(tmp_path, capsys):
    """Also the drive file of an answer without an effect, which its advice recommends."""
    recording, drive = written(MISTAKES["dq currents in rms"], tmp_path)
    assert diagnose(tmp_path / "out", recording, drive=drive, more=["--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "drive_improved.toml" in lines[1] and not answer(tmp_path / "out")["effects"]
    files = {f"wrote {path}" for path in (tmp_path / "out").iterdir()}
    assert files == {line for line in lines if line.startswith("wrote ")} and len(files) == 3


def test_a_bad_recording_is_a_verdict(tmp_path, capsys):
    path = table_of(tmp_path / "stopped.csv", theta_e=np.ones(len(bench.columns(SHORT)["t"])))
    assert diagnose(tmp_path / "out", path) == 0
    data = answer(tmp_path / "out")
    assert data["verdict"] == "bad_recording" and data["effects"] == []
    assert any(p["fatal"] for p in data["recording"]["problems"])
    assert "The recording cannot be used: column theta_e" in capsys.readouterr().out.splitlines()[0]


@pytest.mark.slow
def test_constant_currents_give_no_name(tmp_path):
    """Three constant phase currents of a rotating machine mean a dead converter, whatever fits them."""
    standing = np.full(len(bench.columns(SHORT)["t"]), 1.25)
    path = table_of(tmp_path / "stuck.csv", i_a=standing, i_b=standing, i_c=-2.0 * standing)
    assert diagnose(tmp_path / "out", path) == 0
    data = answer(tmp_path / "out")
    assert data["effects"] == [] and data["verdict"] in ("bad_recording", "unexplained"), data["sentence"]


HOSTILE = "t,i_a\x1b[2J,i_b,theta_e\n" + "0,1,2,3\n" * 400
UNUSABLE = {
    "empty.csv": b"",
    "prose.csv": b"The quick brown fox\n" * 50,
    "picture.csv": b"\x89PNG\r\n\x1a\n" + bytes(100),
    "not_really.parquet": b"t,i_a,i_b\n" * 50,
    "cut.mat": b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + bytes(7),
    "hostile.csv": HOSTILE.encode(),
    "words.csv": b"t,i_a,i_b,theta_e,d_a,d_b,d_c,u_dc\n" + b"a,b,c,d,e,f,g,h\n" * 400,
    "dump.dump": b"FLUXDUMP\xff\xff\xff\x7f",
}


@pytest.mark.parametrize("name", UNUSABLE)
def test_unusable_input_ends_in_one_line_and_status_2(name, tmp_path, capsys):
    path = tmp_path / name
    path.write_bytes(UNUSABLE[name])
    assert diagnose(tmp_path / "out", path, more=["--quiet"]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1 and printed.err.startswith("fluxproof: ")
    assert str(path) in printed.err and "\x1b" not in printed.err and not (tmp_path / "out").exists()


@pytest.mark.parametrize("half", [slice(4), slowly(slice(4, 8))])  # more than five findings are left to the report
def test_unusable_parts_beside_a_good_one_are_named(half, tmp_path, capsys):
    paths = [tmp_path / name for name in list(UNUSABLE)[half]]
    for path in paths:
        path.write_bytes(UNUSABLE[path.name])
    good = table_of(tmp_path / "good.csv", rows=900)
    assert diagnose(tmp_path / "out", good, *paths, more=["--quiet"]) == 0
    printed = capsys.readouterr()
    for path in paths:
        (line,) = [line for line in printed.out.splitlines() if f"({path.name} is not used)" in line]
        assert line.startswith("recording: ") and str(path) in line
    assert "\x1b" not in printed.out and not printed.err
    assert diagnose(tmp_path / "out", good, tmp_path / "none.csv", more=["--quiet"]) == 2


def test_missing_files_and_foreign_drives(tmp_path, capsys):
    good = table_of(tmp_path / "good.csv", rows=900)
    file = tmp_path / "file"
    file.write_text("in the way\n")
    for recording, drive, out, word in (
        (tmp_path / "none.csv", PAPER, "out", "none.csv"),
        (tmp_path, PAPER, "out", "not a file"),
        (good, tmp_path / "none.toml", "out", "none.toml"),
        (good, good, "out", "good.csv"),
        (good, PAPER, "file", "file"),
    ):
        assert diagnose(tmp_path / out, recording, drive=drive, more=["--quiet"]) == 2
        printed = capsys.readouterr()
        assert printed.err.count("\n") == 1 and word in printed.err, printed.err


def test_missing_options_print_the_usage(capsys):
    with pytest.raises(SystemExit) as ended:
        fluxproof.main(["diagnose", "a.csv"])
    assert ended.value.code == 2 and "--drive" in capsys.readouterr().err


def test_help_does_not_import_the_diagnosis():
    slow = ("pandas", "matplotlib", "fluxproof.diagnosis.session")
    code = f"import sys, fluxproof.command; print([m for m in {slow} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


class Log(io.StringIO):
    encoding = "ascii"


class Terminal(Log):
    def isatty(self):
        return True


def test_progress_is_one_printable_line_on_a_terminal():
    terminal, log = Terminal(), Log()
    for stream in (terminal, log):
        with command.Progress(stream=stream) as progress:
            for text in ("reading a\x1b]0;taken\x07", "reading a\x1b]0;taken\x07", "around µ"):
                progress(text)
    assert (
        "\n" not in terminal.getvalue()
        and terminal.getvalue().endswith("\r\x1b[K")
        and "\x07" not in terminal.getvalue()
    )
    assert log.getvalue() == "reading a ]0;taken \naround \\xb5\n"


def test_failing_overlay_adds_only_a_note(dump, tmp_path, monkeypatch):
    def failing(*_):
        raise ValueError("no such loop")

    monkeypatch.setattr(session, "closed_loop", failing)
    found = session.run(table_of(tmp_path / "a.csv", rows=4000), PAPER, tmp_path / "out")
    assert found.verdict == "no_mismatch" and any("no such loop" in note for note in found.notes)
    answer(tmp_path / "out")


@pytest.mark.slow
@pytest.mark.parametrize("digit", ["0", "5"])
def test_files_with_flipped_bits_end_without_traceback_and_without_a_name(digit, tmp_path):
    """Bits flipped in files of every format: they may be rejected, but no name comes without a finding."""
    nominal = nominal_of(tmp_path)
    files = {n: path for n, (path, _) in changed_files(tmp_path).items() if n.startswith("flip") and n[4] == digit}
    named, refused = [], 0
    for name, path in files.items():
        try:
            found = run_diagnosis(path, nominal)
        except RecordingError:
            refused += 1
            continue
        if (found.effects or found.ambiguity) and not found.problems:
            named.append(f"{name}: {found.sentence} {[p.message for p in found.problems]}")
    assert len(files) == 9 and refused < len(files) and not named, "\n".join(named)
