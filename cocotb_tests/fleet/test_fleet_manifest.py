# SPDX-License-Identifier: BSD-3-Clause
"""Manifests, folders and patterns: what is found, and what a mistake says."""

from __future__ import annotations

import pandas as pd
import pytest

from fluxproof.command import main
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.fleet.manifest import entries


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "night").mkdir()
    for name in ("a.csv", "b.csv", "night/c.csv"):
        (tmp_path / name).write_text("t,i_a\n0,1\n")
    (tmp_path / "drive.toml").write_text("[machine]\n")
    (tmp_path / ".hidden.csv").write_text("t\n0\n")
    (tmp_path / "notes.md").write_text("no recording")
    return tmp_path


def manifest(folder, text, name="list.csv"):
    path = folder / name
    path.write_text(text)
    return str(path)


def test_folders_and_patterns(folder):
    manifest(folder, "recording\na.csv\n")  # in a folder, a manifest is no recording
    drive = str(folder / "drive.toml")
    names = [e.name for e in entries([str(folder)], drive)]
    assert names == sorted(str(folder / n) for n in ("a.csv", "b.csv", "night/c.csv"))
    assert [e.name for e in entries([str(folder / "*" / "*.csv")], drive)] == [str(folder / "night" / "c.csv")]
    assert len(entries([str(folder), str(folder / "a.csv")], drive)) == 3


def test_manifest_in_csv_and_parquet(folder):
    text = "recording,serial,time,temperature,line\nnight/c.csv,7,2026-03-01T10:00:00+02:00,21.5,A\na.csv,,,,\n"
    plain, full = entries([manifest(folder, text)], str(folder / "drive.toml"))
    assert plain.serial == "a.csv" and plain.time is None and plain.temperature is None and plain.more == {}
    assert full.path == str(folder / "night" / "c.csv") and full.serial == "7" and full.more == {"line": "A"}
    assert full.time.isoformat() == "2026-03-01T08:00:00+00:00" and full.temperature == 21.5
    frame = pd.DataFrame({
        "recording": ["night/c.csv"], "serial": ["7"], "time": [pd.Timestamp("2026-03-01T08:00", tz="UTC")],
        "temperature": [21.5], "line": ["A"],
    })  # fmt: skip
    frame.to_parquet(folder / "list.parquet")
    assert entries([str(folder / "list.parquet")], str(folder / "drive.toml")) == [full]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("recording,time\na.csv,\nb.csv,yesterday\n", "list.csv:3: column 'time': 'yesterday' is no time; expected"),
        ("recording,temperature\na.csv,warm\n", "list.csv:2: column 'temperature': 'warm' is no number; expected deg"),
        ("recording,serial\n\na.csv,1,2\n", "list.csv:3: 3 columns; 2 columns expected, as in line 1"),
        ("recording,serial\n,5\n", "list.csv:2: column 'recording': empty; expected a file name or address"),
        ("recording,recording\na.csv,b.csv\n", "list.csv:1: column 'recording' twice"),
        ("recording,drive\na.csv,other.toml\n", "list.csv:2: column 'drive': "),
        ("recording,serial\na.csv,1\na.csv,2\n", "a.csv is named twice, with different drive file, serial number"),
    ],
)
def test_mistakes_name_line_and_column(folder, text, said, capsys):
    path = manifest(folder, text)
    with pytest.raises(RecordingError, match="^[^\n]*$") as error:
        entries([path], str(folder / "drive.toml"))
    assert said in str(error.value)
    assert main(["fleet", path, "--drive", str(folder / "drive.toml"), "--out", str(folder / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_no_drive_and_no_recording(folder):
    with pytest.raises(RecordingError, match="list.csv:2: column 'drive': empty or missing, and there is no --drive"):
        entries([manifest(folder, "recording\na.csv\n")], None)
    with pytest.raises(RecordingError, match="no such file or folder, and no file matches it"):
        entries([str(folder / "x*.csv")], "drive.toml")
    with pytest.raises(RecordingError, match="missing.toml: drive file of .*: no such file"):
        entries([str(folder / "a.csv")], str(folder / "missing.toml"))


def test_a_limit_that_is_none_is_told(folder, capsys):
    command = ["fleet", str(folder / "a.csv"), "--drive", str(folder / "drive.toml"), "--out", str(folder / "out")]
    assert main([*command, "--limit", "magnet_flux_wb=much"]) == 2
    assert "expected PARAMETER=VALUE, such as magnet_flux_wb=0.095" in capsys.readouterr().err
