# SPDX-License-Identifier: BSD-3-Clause
"""Reading recordings: every format and layout comes back as written, with units."""

from __future__ import annotations

import dataclasses
import re
import sys
import time

import numpy as np
import pandas as pd
import pytest

from cocotb_tests.support.recordings.from_equations import as_text, codes, dump, made, nominal_of, write, write_mat73
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import COLUMNS, RecordingError
from fluxproof.diagnosis.loading.early import refuse_early
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.loading.together import together
from fluxproof.diagnosis.readers import read_table
from fluxproof.diagnosis.readers.grids import flat


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".parquet", ".npz", ".npy", ".h5", ".mat", ".mf4", "7.3"])
def test_every_format_comes_back_as_written(tmp_path, nominal, suffix):
    table = made()
    path = write_mat73(tmp_path / "r.mat", table) if suffix == "7.3" else write(tmp_path / f"r{suffix}", table)
    recording = load_recording(path, nominal)
    assert codes(recording) == []
    assert set(recording.columns) == set(table)
    for name, values in table.items():
        np.testing.assert_allclose(recording[name], values, rtol=1e-12, atol=1e-12)
    assert recording.joined[:-1].all() and not recording.joined[-1] and recording.usable.all() and not recording.slow


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_matlab_tables_and_timetables(tmp_path, nominal, version):
    matio = pytest.importorskip("matio", reason="mat-io needs Python 3.11")
    table = made()
    rest = {name: values for name, values in table.items() if name != "t"}
    frame = pd.DataFrame(rest | {"comment": ["a"] * len(table["t"])})
    frame.attrs["VariableUnits"] = ["mA" if name == "i_a" else "" for name in frame]
    frame["i_a"] *= 1e3
    times = pd.to_timedelta(np.round(table["t"] * 1e9), unit="ns")
    timed = frame.set_index(times).rename_axis("Time").drop(columns="i_a").assign(i_a=table["i_a"])
    for kind, content in (("table", frame.assign(t=table["t"])), ("timetable", timed)):
        path = tmp_path / f"{kind}.mat"
        matio.save_to_mat(str(path), {"run": content, "gain": np.array([2.0])}, version=version)
        if kind == "table":  # the writer stores no units
            nominal_or_own = dataclasses.replace(nominal, columns={"i_a": {"name": "i_a", "unit": "mA"}})
        else:
            nominal_or_own = nominal
        recording = load_recording(path, nominal_or_own)
        for name, values in table.items():
            np.testing.assert_allclose(recording[name], values, rtol=1e-9, atol=1e-9)


def test_a_matlab_table_without_its_library_names_the_remedy(tmp_path, nominal, monkeypatch):
    matio = pytest.importorskip("matio", reason="mat-io needs Python 3.11")
    path = tmp_path / "r.mat"
    matio.save_to_mat(str(path), {"run": pd.DataFrame(made())}, version="v7")
    monkeypatch.setitem(sys.modules, "matio", None)
    with pytest.raises(RecordingError, match=r"r\.mat: MATLAB objects need Python 3\.11.*writetable"):
        load_recording(path, nominal)


UNITS = {
    "t": ("ms", 1e3), "i_a": ("mA", 1e3), "i_b": ("A", 1.0), "i_c": ("kA", 1e-3), "theta_e": ("deg", 180 / np.pi),
    "omega_e": ("rpm", 60 / (2 * np.pi * 4)), "u_dc": ("mV", 1e3), "d_a": ("%", 100.0), "d_b": ("permille", 1e3),
    "d_c": ("1", 1.0),
}  # fmt: skip


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".h5", ".mf4"])
def test_units_that_a_file_states_are_converted(tmp_path, nominal, suffix):
    table = made()
    units = {name: unit for name, (unit, _) in UNITS.items()}
    raw = {name: values * UNITS[name][1] for name, values in table.items()}
    if suffix == ".csv":
        path = write(tmp_path / "r.csv", {f"{name} [{units[name]}]": v for name, v in raw.items()})
    else:
        if suffix == ".mf4":
            raw["t"] = table["t"]
        path = write(tmp_path / f"r{suffix}", raw, units)
    recording = load_recording(path, nominal)
    assert codes(recording) == []
    for name, values in table.items():
        np.testing.assert_allclose(recording[name], values, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "separator, decimal", [(",", "."), (";", ","), (";", "."), ("\t", ","), ("  ", "."), (" ", ",")]
)
@pytest.mark.parametrize("extra", ["", "units", "comments", "quoted"])
def test_text_layouts(tmp_path, nominal, separator, decimal, extra):
    table = made(600)
    before = {"comments": "# recorded on a bench\n% 10 kHz\n\n", "quoted": ""}.get(extra, "")
    text = as_text(table, separator, decimal, units=extra == "units", before=before)
    if extra == "quoted":
        head, rest = text.split("\n", 1)
        text = separator.join(f'"{name}"' for name in table) + "\n" + rest if separator.strip() else head + "\n" + rest
    path = tmp_path / "r.csv"
    path.write_text(text)
    recording = load_recording(path, nominal)
    assert codes(recording) == []
    for name, values in table.items():
        np.testing.assert_array_equal(recording[name], values)


def test_title_names_and_units_above_the_numbers(tmp_path):
    """Units that no list holds are units too, where they repeat under names that do not."""
    head = "2026-05-11 15:22:21\nBus voltage, Current d, Current q, Bus power, Field\nV, A, A, furlong, furlong\n"
    (tmp_path / "r.csv").write_text(head + "48.1, 0.1, 1.5, 70, 1\n" * 30)
    table = read_table(tmp_path / "r.csv")
    assert list(table.columns) == ["Bus voltage", "Current d", "Current q", "Bus power", "Field"]
    assert [table.units[n] for n in ("Bus voltage", "Current q", "Field")] == ["V", "A", "furlong"]
    (tmp_path / "two.csv").write_text("left, left, right\nu, i, i2\n" + "48.1, 0.1, 1.5\n" * 30)
    assert list(read_table(tmp_path / "two.csv").columns) == ["u", "i", "i2"]


def test_text_without_header_takes_numbers_as_names(tmp_path):
    table = made(600)
    path = tmp_path / "r.txt"
    path.write_text(as_text(table, " ", ".", header=False))
    nominal = nominal_of(tmp_path, "".join(f'{k + 1} = "{name}"\n' for k, name in enumerate(table)))
    recording = load_recording(path, nominal)
    np.testing.assert_array_equal(recording["d_c"], table["d_c"])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_text_encodings(tmp_path, nominal, encoding):
    table = made(600) | {"temp_winding [°C]": np.full(600, 40.0)}
    path = tmp_path / "r.csv"
    path.write_bytes(as_text(table, ",", ".").encode(encoding))
    recording = load_recording(path, nominal)
    assert recording["temp_winding"][0] == 40.0 and recording.meta["columns"]["t"] == "t"


def test_rows_without_a_line_end_and_lines_in_messages(tmp_path, nominal):
    table = made(600)
    path = tmp_path / "r.csv"
    path.write_text(as_text(table, ",", ".", end=""))
    recording = load_recording(path, nominal)
    assert len(recording) == 599 and any("line end" in note for note in recording.meta["notes"])
    lines = as_text(table, ",", ".").split("\n")
    lines[100] += ",7"
    path.write_text("\n".join(lines))
    with pytest.raises(RecordingError, match=rf"^{path}:101: 11 fields; 10 expected"):
        load_recording(path, nominal)
    lines[100] = lines[100][:-2].replace(",", ",x", 1)
    path.write_text("\n".join(lines))
    problem = next(p for p in load_recording(path, nominal).problems if p.code == "not_a_number")
    assert problem.column == "i_a" and problem.row == 99 and "line 101" in problem.message


def test_other_rasters_are_brought_onto_the_currents(tmp_path, nominal):
    from asammdf import MDF, Signal

    table = made()
    with MDF() as mdf:
        mdf.append([Signal(table[n], table["t"], name=n) for n in table if n not in ("t", "u_dc")])
        mdf.append([Signal(np.array([560.0, 570.0]), np.array([0.0, 0.2]), name="u_dc", unit="V")])
        mdf.save(tmp_path / "r.mf4", overwrite=True)
    recording = load_recording(tmp_path / "r.mf4", nominal)
    assert len(recording) == 4000
    assert (recording["u_dc"][:2000] == 560).all() and (recording["u_dc"][2001:] == 570).all()
    assert any("u_dc" in note and "raster" in note for note in recording.meta["notes"])


def test_dspace_structures(tmp_path, nominal):
    from scipy.io import savemat

    table = made()
    signals = [{"Name": name, "Data": values, "Unit": COLUMNS[name]} for name, values in table.items() if name != "t"]
    savemat(tmp_path / "r.mat", {"exp1": {"X": {"Name": "", "Data": table["t"]}, "Y": signals}})
    recording = load_recording(tmp_path / "r.mat", nominal)
    assert codes(recording) == []
    np.testing.assert_allclose(recording["d_b"], table["d_b"])


def test_suffix_of_another_format_is_rejected(tmp_path, nominal):
    path = write(tmp_path / "r.parquet", made())
    path.rename(tmp_path / "r.csv")
    with pytest.raises(RecordingError, match="the name suggests text, the content is Parquet"):
        load_recording(tmp_path / "r.csv", nominal)


def test_only_wanted_columns_are_read(tmp_path):
    path = write(tmp_path / "r.parquet", made() | {f"other{k}": np.zeros(4000) for k in range(50)})
    assert set(read_table(path, lambda names: ["t", "i_a"]).columns) == {"t", "i_a"}
    assert len(read_table(path).columns) == 60


def test_a_telemetry_dump_brings_its_registers(tmp_path):
    path, drive = dump(tmp_path / "core.dump")
    recording = load_recording(path, load_nominal(drive))
    assert [p.code for p in recording.problems] == ["current_limit"]  # the run meets it, and nothing else is found
    assert recording.has("i_a", "theta_e", "d_a", "u_dc", "i_q_ref")
    assert {"registers", "samples", "observed"} <= set(recording.meta) and len(recording.meta["samples"]) == len(
        recording
    )


@pytest.mark.study
def test_a_million_rows_in_time(tmp_path, nominal):
    table = made(1_000_000, speed=600.0)
    table |= {"i_d_ref": np.zeros(1_000_000), "temp_winding": np.full(1_000_000, 40.0)}
    csv, parquet = tmp_path / "r.csv", write(tmp_path / "r.parquet", table)
    pd.DataFrame(table).to_csv(csv, index=False, float_format="%.7g")
    load_recording(write(tmp_path / "warm.parquet", made(600)), nominal)
    seconds = {}
    for name, call in {
        "csv": lambda: read_table(csv),
        "parquet": lambda: read_table(parquet),
        "all": lambda: load_recording(parquet, nominal),
    }.items():
        start = time.process_time()
        call()
        seconds[name] = time.process_time() - start
    print(seconds)
    # Twice what was measured on one core, for slower ones.
    assert seconds["csv"] < 12 and seconds["parquet"] < 2 and seconds["all"] < 8


AXES_OF = {  # how a file holds the axes of its matrices, and how many speeds it has beside four currents
    "vectors": (lambda omega, i_q: (omega, i_q), 6),
    "matrices": (lambda omega, i_q: np.meshgrid(omega, i_q, indexing="ij"), 6),
    "square": (lambda omega, i_q: np.meshgrid(omega, i_q, indexing="ij"), 4),
}


@pytest.mark.parametrize("axes", AXES_OF)
def test_matrices_over_speed_and_current_are_a_table(tmp_path, nominal, axes):
    from scipy.io import savemat

    shape, speeds = AXES_OF[axes]
    omega, i_q = np.linspace(50.0, 500.0, speeds), np.array([0.0, 1.0, 2.5, 4.0])
    grid = np.meshgrid(omega, i_q, indexing="ij")
    u_q, u_d = 1.5 * grid[1] + 0.165 * grid[0], -0.016 * grid[0] * grid[1]
    held = dict(zip(("omega_e", "i_q"), shape(omega, i_q), strict=True))
    savemat(tmp_path / "m.mat", held | {"u_q_ref": u_q, "u_d_ref": u_d, "i_d": 0.0 * u_q})
    recording = load_recording(tmp_path / "m.mat", nominal)
    assert recording.points and len(recording) == 4 * speeds
    for name, values in {"omega_e": grid[0], "i_q": grid[1], "u_q_ref": u_q}.items():
        np.testing.assert_allclose(recording[name], values.ravel())


def test_square_matrices_with_vectors_do_not_tell_their_axes(tmp_path, nominal):
    from scipy.io import savemat

    square = np.ones((4, 4))
    savemat(
        tmp_path / "m.mat", {"omega_e": np.arange(4.0), "i_q": np.arange(4.0), "u_q_ref": square, "u_d_ref": square}
    )
    with pytest.raises(RecordingError, match="both axes as matrices too"):
        load_recording(tmp_path / "m.mat", nominal)


AXES_OF_TEXT = r"omega_e [rad/s] \ i_q [A]"


def _as_text(omega, i_q, matrices, separator=";", decimal=",", corner=AXES_OF_TEXT) -> str:
    """Matrices {title: (speeds, currents)} as a bench exports them, one below the other."""

    def line(first, values):
        return separator.join([first, *(f"{x:.17g}".replace(".", decimal) if x == x else "" for x in values)])

    lines = []
    for title, matrix in matrices.items():
        rows = [line(f"{w:.17g}".replace(".", decimal), row) for w, row in zip(omega, matrix, strict=True)]
        lines += ["", title, line(corner, i_q), *rows]
    return "\n".join(["bench 3", *lines, ""])


def _mapped():
    omega, i_q = np.linspace(50.0, 500.0, 4), np.array([0.0, 1.0, 2.5, 4.0])
    w, i = np.meshgrid(omega, i_q, indexing="ij")
    matrices = {"# u_q_ref [mV]": 1e3 * (1.5 * i + 0.165 * w), "u_d_ref [V]": -0.016 * w * i, "i_d": 0.0 * i}
    matrices["u_d_ref [V]"][3, 3] = np.nan  # not reached
    return omega, i_q, matrices


@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), ("\t", "."), (",", ".")])
def test_matrices_in_text_are_operating_points(tmp_path, nominal, separator, decimal):
    omega, i_q, matrices = _mapped()
    path = tmp_path / "map.csv"
    path.write_text(_as_text(omega, i_q, matrices, separator, decimal))
    recording = load_recording(path, nominal)
    assert recording.points and len(recording) == 15
    assert any("1 of 16 points have an empty cell" in note for note in recording.meta["notes"])
    np.testing.assert_allclose(recording["omega_e"], np.repeat(omega, 4)[:15])
    np.testing.assert_allclose(recording["i_q"], np.tile(i_q, 4)[:15])
    np.testing.assert_allclose(recording["u_q_ref"], 1e-3 * matrices["# u_q_ref [mV]"].ravel()[:15])


def test_matrices_of_several_files_are_one_recording(tmp_path, nominal):
    omega, i_q, matrices = _mapped()
    paths = []
    for k, (title, matrix) in enumerate(matrices.items()):
        paths.append(tmp_path / f"{k}.csv")
        paths[-1].write_text(_as_text(omega, i_q, {title: matrix}))
    other = tmp_path / "other.csv"
    other.write_text(_as_text(omega + 1.0, i_q, matrices))
    groups = together([*paths[:2], other, paths[2], paths[0]])
    assert groups == [paths, [other], [paths[0]]]
    recording = load_recording(paths[0], nominal, *paths[1:])
    assert len(recording) == 15 and {"i_d", "u_d_ref", "u_q_ref"} <= set(recording.columns)
    with pytest.raises(RecordingError, match="missing i_d"):
        load_recording(paths[0], nominal)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: s.replace(AXES_OF_TEXT, "rpm"), r"4: a matrix whose corner 'rpm' does not name both axes; 'DOWN"),
        (lambda s: s.replace("u_d_ref [V]\n", "\n"), r"a matrix without a line above that names its quantity"),
        (lambda s: s.replace("\n500;", "\n501;", 1), r"'u_d_ref \[V\]' over other axes than 'u_q_ref \[mV\]'"),
        (lambda s: s.replace("\n500;", "\n500;1;1;1;", 1), r"8: 8 fields; 5 expected as in the axis above"),
        (lambda s: re.sub(r"\n50;[^;]*", "\n50;n.a.", s, count=1), r"5: field 2: 'n\.a\.' is not a number"),
        (lambda s: s + "\n7;8;9\n", r"a row of numbers outside a matrix"),
        (lambda s: s.replace("i_d\n", "u_d_ref [V]\n"), r"u_d_ref \[V\] twice"),
        (lambda s: s.replace("u_q_ref [mV]", "torque [Nm]"), r"u_q_ref"),
    ],
)  # fmt: skip
def test_what_is_a_matrix_only_in_part_is_refused_with_its_line(tmp_path, nominal, change, words):
    path = tmp_path / "map.csv"
    path.write_text(change(_as_text(*_mapped())))
    with pytest.raises(RecordingError, match=words):
        load_recording(path, nominal)
    with pytest.raises(RecordingError, match=words):
        refuse_early([path], nominal.path)


def test_phases_in_one_array_are_no_matrix_over_two_axes():
    found = flat({"t": np.arange(50.0), "i": np.ones((50, 3)), "d": np.ones((50, 3))})
    assert list(found) == ["t", "i[0]", "i[1]", "i[2]", "d[0]", "d[1]", "d[2]"]
