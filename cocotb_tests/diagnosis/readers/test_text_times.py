# SPDX-License-Identifier: BSD-3-Clause
"""Text that programs for people write: dates, clock times, quotes, thousands separators, a header inside the file."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from cocotb_tests.support.recordings.from_equations import T, as_text, codes, made, nominal_of
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.readers.sniff import sniff
from fluxproof.diagnosis.readers.text import read


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


@pytest.fixture(scope="module")
def table():
    return made(n=800)


def stamped(table, start, form, name="t", decimal="."):
    """The table as text with its time as texts from ``start``."""
    stamps = pd.Timestamp(start) + pd.to_timedelta(np.round(table["t"] * 1e9).astype(int), unit="ns")
    texts = [stamp.strftime(form).replace(".", decimal) if decimal == "," else stamp.strftime(form) for stamp in stamps]
    rest = {k: v for k, v in table.items() if k != "t"}
    lines = as_text(rest, ";", decimal).splitlines()
    return "\n".join(f"{a};{b}" for a, b in zip([name, *texts], lines, strict=True)) + "\n"


@pytest.mark.parametrize(
    "form, name, decimal",
    [
        ("%Y-%m-%d %H:%M:%S.%f", "t", "."),
        ("%Y-%m-%dT%H:%M:%S.%fZ", "t", "."),
        ("%d.%m.%Y %H:%M:%S.%f", "t", "."),
        ("%H:%M:%S.%f", "t", "."),
        ("%H:%M:%S.%f", "t [hh:mm:ss]", ","),
        ("%H:%M:%S.%f", "t [ms]", "."),
        ("%Y/%m/%d %H:%M:%S.%f", "DateTime", "."),
        ("%m/%d/%Y %I:%M:%S.%f %p", "DateTime", "."),
    ],
)
def test_dates_and_clock_times_are_seconds(tmp_path, nominal, table, form, name, decimal):
    path = tmp_path / "r.csv"
    path.write_text(stamped(table, "2026-11-03 23:59:59.96", form, name, decimal))  # over midnight
    recording = load_recording(path, nominal)
    assert codes(recording) == [] and recording.joined[:-1].all()
    np.testing.assert_allclose(recording["t"], table["t"], atol=1.1e-6)
    assert any("clock times" in note for note in recording.meta["notes"])


def test_a_timetable_of_matlab_has_seconds_in_words(tmp_path, nominal, table):
    lines = as_text(table, ",", ".").splitlines()
    time = ["Time", *(f"{t:.6g} sec" for t in table["t"])]
    at = lines[0].split(",").index("t")
    rows = [
        ",".join([t, *(v for k, v in enumerate(line.split(",")) if k != at)])
        for t, line in zip(time, lines, strict=True)
    ]
    (tmp_path / "r.csv").write_text("\n".join(rows) + "\n")
    recording = load_recording(tmp_path / "r.csv", nominal)
    assert codes(recording) == []
    np.testing.assert_allclose(recording["t"], table["t"], atol=1e-9)


HEADS = {  # lines above the numbers: names and units found
    "a scope": ("x-axis,1,2\nsecond,Volt,Ampere\n", ",", ["x-axis", "1", "2"], ["second", "Volt", "Ampere"]),
    "a preamble": ("Sample Interval,1e-05,\n\nTIME,CH1,CH2,\n", ",", ["TIME", "CH1", "CH2"], ["", "", ""]),
    "LabVIEW": ("***End_of_Header***\t\nX_Value\tId [A]\tn [rpm]\tComment\n", "\t",
                ["X_Value", "Id [A]", "n [rpm]"], ["", "", ""]),
    "no header": ("", ";", ["1", "2", "3"], ["", "", ""]),
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADS)
def test_headers_of_instruments(tmp_path, kind):
    head, separator, names, units = HEADS[kind]
    rows = "".join(separator.join((f"{k}e-5", "0.5", f"{k}.25")) + "\n" for k in range(40))
    (tmp_path / "r.csv").write_text(head + rows)
    layout = sniff(tmp_path / "r.csv")
    assert (layout.names, layout.units, layout.first) == (names, units, head.count("\n"))


def test_timestamps_of_parquet(tmp_path, nominal, table):
    frame = pd.DataFrame(table)
    frame["t"] = pd.Timestamp("2026-11-03 10:00", tz="Europe/Berlin") + pd.to_timedelta(table["t"], unit="s")
    frame.to_parquet(tmp_path / "r.parquet")
    recording = load_recording(tmp_path / "r.parquet", nominal)
    assert codes(recording) == []
    np.testing.assert_allclose(np.diff(recording["t"]), T, atol=1e-8)


def test_quoted_decimal_commas(tmp_path, nominal, table):
    rows = as_text(table, ";", ",").splitlines()
    quoted = [rows[0].replace(";", ","), *('"' + row.replace(";", '","') + '"' for row in rows[1:])]
    (tmp_path / "r.csv").write_text("\n".join(quoted) + "\n")
    recording = load_recording(tmp_path / "r.csv", nominal)
    np.testing.assert_allclose(recording["i_a"], table["i_a"], rtol=1e-12)


@pytest.mark.parametrize("decimal, found, plain", [(",", "1.234,500", "1234,500"), (".", "1,234.500", "1234.500")])
def test_thousands_separators_are_named(tmp_path, nominal, table, decimal, found, plain):
    lines = as_text(table, ";", decimal).splitlines()
    lines[400:] = [f"{found};{line.partition(';')[2]}" for line in lines[400:]]
    (tmp_path / "r.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError) as error:
        load_recording(tmp_path / "r.csv", nominal)
    for word in ("r.csv:401: column 't'", repr(found), repr(plain), "thousands separators"):
        assert word in str(error.value), error.value


def test_a_word_does_not_void_decimal_commas(tmp_path, nominal, table):
    lines = as_text(table, ";", ",").splitlines()
    lines[300] = ";".join(["overflow" if k == 1 else v for k, v in enumerate(lines[300].split(";"))])
    (tmp_path / "r.csv").write_text("\n".join(lines) + "\n")
    recording = load_recording(tmp_path / "r.csv", nominal)
    assert sorted(codes(recording)) == ["missing", "not_a_number"]
    assert np.count_nonzero(~recording.usable) == 1


@pytest.mark.parametrize("inside, says", [(None, "repeats the header"), ("part;" * 9 + "two", "is a line of words")])
def test_a_header_inside_is_one_finding(tmp_path, nominal, table, inside, says):
    lines = as_text(table, ";", ".").splitlines()
    both = [*lines, inside or lines[0], *lines[1:]]
    (tmp_path / "r.csv").write_text("\n".join(both) + "\n")
    recording = load_recording(tmp_path / "r.csv", nominal)
    assert codes(recording) == ["header_inside", "time_order"]
    assert f"line 802 {says}" in recording.problems[0].message
    assert len(recording) == 2 * len(table["t"]) and np.count_nonzero(~recording.joined) == 2


def test_names_of_time_zones_and_an_index_without_a_name_are_a_time(tmp_path):
    """One name of a zone in all rows is no part of the time; two are summer time's begin, which nobody can convert."""
    rows = [f"2026-05-01 12:00:00.{k:03d} CEST,{k}.5" for k in range(40)]
    path = tmp_path / "r.csv"
    path.write_text(",i_d\n" + "\n".join(rows) + "\n")
    table = read(path)
    np.testing.assert_allclose(table.columns["t"], np.arange(40) * 1e-3, atol=1e-9)
    path.write_text("t,i_d\n" + "\n".join([*rows[:20], *(row.replace("CEST", "CET") for row in rows[20:])]) + "\n")
    assert "t" not in read(path).columns
