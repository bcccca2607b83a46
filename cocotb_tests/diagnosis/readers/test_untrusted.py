# SPDX-License-Identifier: BSD-3-Clause
"""A file from a stranger runs nothing and opens nothing else."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from cocotb_tests.support.recordings.from_equations import dump, made, write, write_mat73
from cocotb_tests.support.untrusted import hostile_files as hostile
from cocotb_tests.support.untrusted.damaged_files import Canary
from cocotb_tests.support.untrusted.hostile_files import refused
from cocotb_tests.support.untrusted.nothing_runs import watched
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers import read_table
from fluxproof.plant import jit
from golden_model import kernel

# --- nothing is evaluated ---


@pytest.mark.parametrize("version", ["4.10", "3.30"])
@pytest.mark.parametrize("on", ["u_dc", "time"])
def test_a_formula_of_an_mdf_file_does_not_run(tmp_path, monkeypatch, version, on):
    from asammdf.blocks import v2_v3_blocks, v4_blocks

    marker = tmp_path / "marker"
    text = hostile.planting(marker, "X" if version > "4" else "X1")
    path = hostile.mdf(tmp_path / "r.mf4", hostile.formula(text, version), on=on, version=version)
    run = []
    for blocks in (v2_v3_blocks, v4_blocks):  # as if sympy were installed
        monkeypatch.setattr(blocks, "lambdify", lambda *a, **k: run.append(a))
        monkeypatch.setattr(blocks, "symbols", lambda *a: run.append(a))
    refused(path, "u_dc" if on == "u_dc" else "the time of channel", "formula", "conversions applied")
    assert not marker.exists() and not run
    others = read_table(path, lambda names: ["i_a", "i_b"]) if on == "u_dc" else None
    assert others is None or len(others.columns["i_a"]) == 800  # a formula that is not needed does not matter
    assert not marker.exists() and not run


def test_the_formula_would_run_in_the_library(tmp_path):
    """Else the tests above could not fail."""
    from asammdf import MDF

    marker = tmp_path / "marker"
    path = hostile.mdf(tmp_path / "r.mf4", hostile.formula(hostile.planting(marker, "X")))
    with MDF(path) as file:
        file.select(["u_dc"])
    assert marker.exists()


def test_a_formula_inside_another_conversion_does_not_run(tmp_path):
    from asammdf.blocks.conversion_utils import from_dict

    marker = tmp_path / "marker"
    inner = {"formula": hostile.planting(marker, "X")}
    for outer in (
        {"val_0": 1.0, "text_0": inner, "default_addr": b""},
        {"val_0": 1.0, "text_0": b"one", "default_addr": inner},
        {"lower_0": 0.0, "upper_0": 1e9, "text_0": {"val_0": 1.0, "text_0": b"", "default_addr": inner}},
    ):
        path = hostile.mdf(tmp_path / "r.mf4", from_dict(outer))
        refused(path, "u_dc", "formula")
        assert not marker.exists()


def test_an_unfinished_mdf_file_runs_no_formula(tmp_path):
    marker = tmp_path / "marker"
    path = hostile.mdf(tmp_path / "r.mf4", hostile.formula(hostile.planting(marker, "X")))
    content = bytearray(path.read_bytes())
    content[:8], content[60] = b"UnFinMF ", 1
    path.write_bytes(content)
    refused(path)
    assert not marker.exists()


def test_a_packed_mdf_is_not_unpacked(tmp_path):
    path = hostile.mdf(tmp_path / "r.mf4", None).rename(tmp_path / "r.zip")
    refused(path, "unpack it first")


X = np.linspace(-3.0, 12.0, 31)
CONVERSIONS = {
    "linear": {"a": 2.5, "b": -1.0},
    "rational": {f"P{k + 1}": p for k, p in enumerate((0.5, 2.0, 1.0, 0.0, 0.25, 9.0))},
    "table": {"raw_0": -1.0, "phys_0": 10.0, "raw_1": 2.0, "phys_1": 5.0, "raw_2": 8.0, "phys_2": -7.0},
    "ranges": {
        "lower_0": 0.0, "upper_0": 3.0, "phys_0": 1.0, "lower_1": 3.0, "upper_1": 6.0, "phys_1": 2.0, "default": -9.0,
    },
    "partly words": {"val_0": 3.0, "text_0": b"error", "default_addr": {"a": 2.0, "b": 0.5}},
}  # fmt: skip
CONVERSIONS["interpolated"] = CONVERSIONS["table"] | {"interpolation": True}


@pytest.mark.parametrize("kind", CONVERSIONS)
@pytest.mark.parametrize("whole", [False, True])
def test_conversions_of_mdf4_give_what_the_library_gives(kind, whole):
    from asammdf.blocks.conversion_utils import from_dict

    from fluxproof.diagnosis.readers.mdf_conversion import physical, refusal

    if whole and kind == "ranges":
        pytest.skip("the library finds whole numbers at the upper end of a range only")
    conversion = from_dict(dict(CONVERSIONS[kind]))
    x = np.tile(np.arange(-3, 12) if whole else X, 12)
    expected = conversion.convert(x.copy())
    assert not refusal(conversion, newer=True)
    np.testing.assert_allclose(physical(conversion, x, newer=True), np.asarray(expected, float), rtol=1e-14)


def test_ranges_of_whole_numbers_include_both_ends():
    from asammdf.blocks.conversion_utils import from_dict

    from fluxproof.diagnosis.readers.mdf_conversion import physical

    ranges = {"lower_0": 0, "upper_0": 2, "phys_0": 1.0, "lower_1": 3, "upper_1": 5, "phys_1": 2.0, "default": -9.0}
    assert physical(from_dict(ranges), np.arange(-1, 7), newer=True).tolist() == [-9, 1, 1, 1, 2, 2, 2, -9]


@pytest.mark.parametrize(
    "code, P",
    [(6, (1, 2, 3, 4, 5, 6)), (6, (4, 0, 0, 2, 0, 0)), (7, (2, 0.5, 1, 0, 0, 3, 1)), (8, (2, 0.5, -99, 0, 0, 3, 1)),
     (7, (0, 1, 2, 3, 4, 5, -99)), (9, (0, 2, 1, 0, 0, 4)), (9, (1, 2, 1, 0, 3, 40)), (0, (7, 0.5)), (65535, ())],
)  # fmt: skip
def test_conversions_of_mdf3_give_what_the_library_gives(code, P):
    from asammdf.blocks.v2_v3_blocks import ChannelConversion

    from fluxproof.diagnosis.readers.mdf_conversion import physical, refusal

    coefficients = {f"P{k + 1}": float(p) for k, p in enumerate(P)} | {"a": 0.5, "b": 7.0}
    conversion = ChannelConversion(conversion_type=code, **coefficients)
    assert not refusal(conversion, newer=False)
    np.testing.assert_allclose(physical(conversion, X, newer=False), conversion.convert(X.copy()), rtol=1e-13)


def test_words_stay_a_column_of_text(tmp_path):
    from asammdf.blocks.conversion_utils import from_dict

    words = from_dict({"val_0": 0.0, "text_0": b"off", "val_1": 1.0, "text_1": b"on", "default_addr": b"?"})
    path = hostile.mdf(tmp_path / "r.mf4", words, on="state", state=np.arange(800) % 2)
    table = read_table(path)
    assert table.text == ["state"] and "u_dc" in table.columns


# --- nothing is run, imported, fetched or opened beside ---


def pairs(folder, suffix):
    """(good file, hostile file) of a format."""
    good = write_mat73(folder / "good.mat", made(800)) if suffix == "7.3" else None
    if suffix == ".dump":
        good = dump(folder / "good.dump")[0]
        bad = folder / "bad.dump"
        bad.write_bytes(good.read_bytes().replace(b"fluxproof telemetry", b"__import__('os') #x", 1))
        return good, bad
    if suffix == "table":
        matio = pytest.importorskip("matio", reason="mat-io needs Python 3.11")
        good, bad = folder / "good.mat", folder / "bad.mat"
        matio.save_to_mat(str(good), {"run": pd.DataFrame(made(800))}, version="v7")
        names = {"__import__('os').abort()": np.arange(800.0), "x": ["@(x) system('touch x')"] * 800}
        matio.save_to_mat(str(bad), {"abort": pd.DataFrame(names)}, version="v7")
        return good, bad
    good = good or write(folder / f"good{suffix}", made(800))
    bad = folder / f"bad{suffix if suffix != '7.3' else '.mat'}"
    objects = np.array([Canary(folder / "canary"), 1], dtype=object)
    if suffix == ".csv":
        head = "t,i_a,i_b,i_c,u_dc,d_a,__import__('os').abort(),x\n"
        bad.write_text(head + "0,1,2,3,4,5,=cmd|1,http://127.0.0.1:1/x\n" * 300)
    elif suffix == ".npy":
        np.save(bad, objects, allow_pickle=True)
    elif suffix == ".npz":
        np.savez(bad, t=objects, i_a=objects)
    elif suffix == ".parquet":
        hostile.with_extension(bad)
    elif suffix == ".mf4":
        hostile.mdf(bad, hostile.formula(hostile.planting(folder / "canary", "X")))
    elif suffix == ".mat":
        from scipy.io import savemat

        savemat(bad, {"f": objects.astype(str), "x": made(800)["t"], "a": "@(x) system('touch x')"})
    else:
        external = [(str(folder / "secret"), 0, 6400)]
        (folder / "secret").write_bytes(bytes(6400))
        build = hostile.mat73 if suffix == "7.3" else hostile.hdf5
        build(bad, lambda f: f.create_dataset("i_x", (800,), "f8", external=external))
    return good, bad


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz", ".npy", ".h5", ".mat", "7.3", "table", ".mf4", ".dump"])
def test_reading_runs_nothing(tmp_path, suffix):
    good, bad = pairs(tmp_path, suffix)
    read_table(good)  # libraries are imported when the first file of a format comes
    refused = []
    for path in (good, bad):
        with watched(path) as events:
            try:
                read_table(path)
            except RecordingError:
                refused.append(path)
        assert not events
    assert refused == (
        [] if suffix in (".csv", ".parquet", ".mat", "table") else [bad]
    )  # these contain numbers as well
    assert not (tmp_path / "canary").exists()


def test_the_watch_sees_what_runs(tmp_path):
    (tmp_path / "other").write_text("")
    with watched(tmp_path / "a.csv") as events:
        exec("1 + 1")
        open(tmp_path / "other").close()
        import this  # noqa: F401
    assert {"exec", "open", "import"} <= {name for name, _ in events}


def test_the_cache_of_compiled_code_is_the_users_own(tmp_path):
    """numba unpickles it, so a folder that others can write is not used."""
    _private = kernel._private
    assert jit.CACHE_DIR.parent == kernel.CACHE_DIR.parent and jit.CACHE_DIR != kernel.CACHE_DIR
    own = _private(tmp_path / "own")
    assert own == tmp_path / "own" == _private(own) and own.stat().st_mode & 0o777 == 0o700
    own.chmod(0o777)
    (tmp_path / "link").symlink_to(tmp_path / "own")
    (tmp_path / "file").write_text("")
    for name in ("own", "link", "file"):
        other = _private(tmp_path / name)
        assert other.parent != tmp_path and other.stat().st_mode & 0o777 == 0o700
        other.rmdir()


def test_mdf_frames_of_buses_are_not_decoded(tmp_path, monkeypatch):
    """asammdf would load the databases that the file attaches or names."""
    from asammdf.blocks.mdf_v4 import MDF4

    monkeypatch.setattr(MDF4, "_process_bus_logging", lambda self: pytest.fail("decoded"))
    monkeypatch.setattr(MDF4, "_extract_attachment", lambda *_: pytest.fail("attachment opened"))
    assert len(read_table(hostile.mdf(tmp_path / "r.mf4", None)).columns["u_dc"]) == 800


def test_hdf5_plugins_are_not_loaded(tmp_path):
    from h5py import h5d, h5p, h5s, h5t

    def build(file):
        settings = h5p.create(h5p.DATASET_CREATE)
        settings.set_chunk((100,))
        settings.set_filter(32001, 1, (1, 2))  # blosc, optional: needs a plugin to be read
        h5d.create(file.id, b"i_a", h5t.IEEE_F64LE, h5s.create_simple((800,)), settings)

    path = hostile.hdf5(tmp_path / "r.h5", build)
    refused(path, "i_a", "filter 32001", "plugin")
    assert len(read_table(path, lambda names: ["i_b"]).columns["i_b"]) == 800


def test_a_reference_to_what_has_no_name_is_refused(tmp_path):
    import h5py

    (tmp_path / "secret").write_bytes(bytes(6400))

    def build(file):
        ring = file.create_group("ring")
        ring["itself"] = ring  # so that it stays in the file without a name
        hidden = ring.create_dataset("x", (800,), "f8", external=[(str(tmp_path / "secret"), 0, 6400)])
        cell = file.create_dataset("cell", (1,), dtype=h5py.ref_dtype)
        cell[0] = hidden.ref
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        del file["ring"]

    refused(hostile.mat73(tmp_path / "r.mat", build), "cell", "no name")
