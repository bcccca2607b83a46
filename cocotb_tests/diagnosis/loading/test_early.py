# SPDX-License-Identifier: BSD-3-Clause
"""What is refused before the libraries of a diagnosis are imported, with the message of the complete run."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from cocotb_tests.support.recordings.from_equations import dq_made, made, nominal_of, write
from fluxproof.checkout import ROOT
from fluxproof.command import main
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.early import refuse_early
from fluxproof.diagnosis.loading.load import load_recording
from golden_model.drive_keys import DriveError

HEAVY = ("matplotlib", "numba", "pandas", "pyarrow", "scipy", "fluxproof.diagnosis.session")
MOST_MODULES = 450  # about 290 with NumPy; 1,600 of a diagnosis
COMMAND = """
import json, sys
from fluxproof.command import main
status = main(sys.argv[1:])
print(json.dumps({"status": status, "modules": sorted(sys.modules)}))
"""


def without(table, *names):
    return {name: values for name, values in table.items() if name not in names}


def refused(path, nominal) -> str:
    with pytest.raises(RecordingError) as early:
        refuse_early([path], nominal.path)
    return str(early.value)


@pytest.mark.parametrize("case", ["no file", "no column", "no drive"])
def test_a_refusal_imports_little(case, tmp_path):
    nominal, path, drive = nominal_of(tmp_path), tmp_path / "r.csv", tmp_path / "drive.toml"
    if case != "no file":
        write(path, without(dq_made(), "u_q_ref"))
    drive = tmp_path / "none.toml" if case == "no drive" else nominal.path
    command = [sys.executable, "-c", COMMAND, "diagnose", str(path), "--drive", str(drive)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    seen = json.loads(done.stdout)
    assert seen["status"] == 2 and done.stderr.count("\n") == 1 and str(tmp_path) in done.stderr
    assert not set(HEAVY) & set(seen["modules"]) and len(seen["modules"]) < MOST_MODULES


@pytest.mark.parametrize("missing", [("u_q_ref",), ("omega_e",), ("i_d", "i_q")])
def test_the_message_is_that_of_the_complete_run(missing, tmp_path):
    nominal, path = nominal_of(tmp_path), write(tmp_path / "r.csv", without(dq_made(), *missing))
    with pytest.raises(RecordingError) as late:
        load_recording(path, nominal)
    assert refused(path, nominal) == str(late.value)


FOREIGN = {  # name: content, what the refusal says
    "prose.csv": (b"no numbers\n" * 50, "no row of numbers in the first 50 lines"),
    "log.json": (b'{"t": [0, 1], "i_q": [1, 2]}\n', "unknown format|JSON is not read"),
    "log.txt": (b'{"t": 0, "i_q": 2}\n' * 20, "JSON is not read: write a column for each signal"),
    "sheet.xlsx": (b"PK\x03\x04" + bytes(60), "an Excel workbook: unpack it, or save the sheet as CSV"),
    "log.csv": (b"\x1f\x8b\x08" + bytes(60), "compressed by gzip: unpack it"),
    "run.tdms": (b"TDSm" + bytes(60), "TDMS of LabVIEW: export it as CSV"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_file_is_refused_at_once(name, tmp_path):
    content, says = FOREIGN[name]
    nominal, path = nominal_of(tmp_path), tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=says) as late:
        load_recording(path, nominal)
    if name != "log.json":  # the text of a name that claims no format is for the reader
        assert refused(path, nominal) == str(late.value)


@pytest.mark.parametrize("columns", ['"nowhere" = "i_a"\n"t" = "t"\n', '"t" = {name = "t", unit = "parsec"}\n'])
def test_the_message_of_a_wrong_entry(columns, tmp_path):
    nominal, path = nominal_of(tmp_path, columns), write(tmp_path / "r.csv", made(400))
    with pytest.raises(RecordingError) as late:
        load_recording(path, nominal)
    assert refused(path, nominal) == str(late.value)


def test_columns_of_the_command_line_count(tmp_path, capsys):
    table = dq_made()
    nominal, path = nominal_of(tmp_path), write(tmp_path / "r.csv", {"shout": table.pop("i_q"), **table})
    refuse_early([path], nominal.path, {"shout": "i_q"})
    named = ["--column", "shout=i_q", "--column", "whisper=u_dc"]
    assert main(["diagnose", str(path), "--drive", str(nominal.path), *named]) == 2
    assert "'whisper' is not a column of" in capsys.readouterr().err


def test_what_a_diagnosis_can_use_or_judges_itself_passes(tmp_path):
    nominal = nominal_of(tmp_path)
    good, poor = write(tmp_path / "good.csv", made(400)), write(tmp_path / "poor.csv", without(made(400), "i_a"))
    empty, table = tmp_path / "empty.csv", write(tmp_path / "r.parquet", without(made(400), "i_a"))
    refuse_early([good], nominal.path)
    refuse_early([good, poor], nominal.path)  # a part that is no good is left out
    refuse_early([table], nominal.path)
    empty.write_text("")
    assert "empty" in refused(empty, nominal)
    with pytest.raises(RecordingError, match="none.csv: cannot be read"):
        refuse_early([good, tmp_path / "none.csv"], nominal.path)
    with pytest.raises(DriveError, match="none.toml: cannot be read"):
        refuse_early([good], tmp_path / "none.toml")


@pytest.mark.parametrize("text", ["columns = 3\n", "[machine]\npole_pairs = 'four'\n", "[columns]\nt = 7\n"])
def test_a_wrong_drive_file_is_for_those_who_read_it(text, tmp_path):
    drive, path = tmp_path / "drive.toml", write(tmp_path / "r.csv", made(400))
    drive.write_text(text)
    refuse_early([path], drive)
