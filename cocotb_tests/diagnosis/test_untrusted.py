"""A file from a stranger runs nothing, opens nothing else, and takes no more than its size allows."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
import pytest

from cocotb_tests.support import hostile_files as hostile
from cocotb_tests.support.damaged_files import Canary
from cocotb_tests.support.nothing_runs import watched
from cocotb_tests.support.recordings_made import as_text, dump, made, nominal_of, write, write_mat73
from fluxproof.diagnosis.ingest.load import load_recording
from fluxproof.diagnosis.readers import limits, read_table
from fluxproof.diagnosis.recording import RecordingError
from fluxproof.golden_model import kernel
from fluxproof.plant import jit


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def refused(path, *parts):
    """The message of the refusal, in which all ``parts`` occur."""
    with pytest.raises(RecordingError) as error:
        read_table(path)
    message = str(error.value)
    assert message.isprintable() and len(message) < 400
    assert all(part in message for part in parts), message
    return message


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


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz", ".npy", ".h5", ".mat", "7.3", ".mf4", ".dump"])
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
    assert refused == ([] if suffix in (".csv", ".parquet", ".mat") else [bad])  # these contain numbers as well
    assert not (tmp_path / "canary").exists()


def test_the_watch_sees_what_runs(tmp_path):
    (tmp_path / "other").write_text("")
    with watched(tmp_path / "a.csv") as events:
        exec("1 + 1")
        open(tmp_path / "other").close()
        import this  # noqa: F401
    assert {"exec", "open", "import"} <= {name for name, _ in events}


@pytest.mark.parametrize("module", [kernel, jit])
def test_the_cache_of_compiled_code_is_the_users_own(tmp_path, module):
    """numba unpickles it, so a folder that others can write is not used."""
    _private = module._private
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


# --- limits ---


def quick(path, *parts, seconds=2.0):
    start = time.process_time()
    refused(path, *parts)
    assert time.process_time() - start < seconds


def test_deep_groups_and_rings_of_hdf5(tmp_path):
    def deep(file):
        for _ in range(300):
            file = file.create_group("g")

    quick(hostile.hdf5(tmp_path / "deep.h5", deep), "32 groups inside each other")

    def ring(file):
        a, b = file.create_group("a"), file.create_group("b")
        a["b"], b["a"], a["up"] = b, a, file["/"]
        file["i_a"] = made(800)["i_a"]

    assert len(read_table(hostile.hdf5(tmp_path / "ring.h5", ring)).columns) == 10


def test_what_hdf5_declares_and_does_not_store(tmp_path):
    build = lambda n: lambda f: f.create_dataset("i_a", (n,), "f8", chunks=(800,))  # noqa: E731
    quick(hostile.hdf5(tmp_path / "huge.h5", build(10**13)), "i_a", "numbers are to be read from")
    path = hostile.hdf5(tmp_path / "empty.h5", build(800))
    refused(path, "i_a", "declares 1 chunks and stores 0")
    assert len(read_table(path, lambda names: ["i_b"]).columns["i_b"]) == 800
    plain = hostile.hdf5(tmp_path / "plain.h5", lambda f: f.create_dataset("i_a", (800,), "f8"))
    refused(plain, "i_a", "declares 6400 bytes and stores 0")


@pytest.mark.parametrize("make, suffix", [(hostile.constant_npz, ".npz"), (hostile.constant_parquet, ".parquet")])
def test_much_from_few_bytes(tmp_path, make, suffix):
    path = make(tmp_path / f"r{suffix}", made(4), 1_000_000)
    quick(path, "10000000 numbers are to be read from", "can have 4000000")
    assert len(read_table(path, lambda names: ["t", "i_a"]).columns["t"]) == 1_000_000


def test_mat_that_unpacks_to_much(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "r.mat", {"x": np.zeros(6_000_000)}, do_compression=True)
    quick(tmp_path / "r.mat", "unpacks from")
    build = lambda f: f.create_dataset("x", (1, 6_000_000), "f8", chunks=(1, 10_000), compression="gzip")  # noqa: E731
    quick(hostile.mat73(tmp_path / "r73.mat", build), "numbers are to be read from")


def test_mdf_that_declares_much(tmp_path):
    path = hostile.mdf(tmp_path / "r.mf4", None)
    content = bytearray(path.read_bytes())
    at = content.index((800).to_bytes(8, "little"), content.index(b"##CG"))
    content[at : at + 8] = (10**12).to_bytes(8, "little")
    path.write_bytes(content)
    quick(path, "1000000000000 samples")


def test_constant_columns_beside_real_ones_load(tmp_path):
    """Sixteen constants beside two currents of few bits; a table of constants only."""
    rng = np.random.default_rng(1)
    rows = 300_000
    table = {f"c{k}": np.full(rows, float(k)) for k in range(16)}
    table |= {name: rng.integers(0, 16, rows) / 8.0 for name in ("i_a", "i_b")}
    assert len(read_table(write(tmp_path / "r.parquet", table)).columns["i_a"]) == rows
    table = {f"c{k}": np.zeros(60_000) for k in range(40)}
    assert len(read_table(write(tmp_path / "r.h5", table)).columns["c0"]) == 60_000


def test_the_limits_grow_with_the_file():
    assert limits.most_cells(0) == limits.most_cells(100_000) == 4_000_000
    assert limits.most_cells(10_000_000) == limits.MAX_CELLS
    assert limits.most_seconds(2_000_000) == 21.0
    assert limits.most_bytes(10**6) - limits.most_bytes(0) == 24 * 28_000_000 + 4 * 10**6


def test_reading_ends_when_its_time_is_over(tmp_path, monkeypatch):
    path = write(tmp_path / "r.csv", made(600))
    monkeypatch.setattr(limits, "most_seconds", lambda size: 0.1)

    def never(names):
        while True:
            try:
                time.sleep(10)
            except Exception:  # what a library does
                pass

    before = signal.signal(signal.SIGALRM, own := lambda *_: None)
    signal.setitimer(signal.ITIMER_REAL, 50.0)
    try:
        with pytest.raises(RecordingError, match=r"r\.csv: reading took longer than 0 s, the limit of its size"):
            read_table(path, never)
        assert signal.getsignal(signal.SIGALRM) is own  # and an alarm of somebody else goes on
        assert 45.0 < signal.getitimer(signal.ITIMER_REAL)[0] < 50.0
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


# --- messages that name the reason ---


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf16_without_a_mark_is_read(tmp_path, nominal, encoding):
    path = tmp_path / "r.csv"
    path.write_bytes(as_text(made(600), ",", ".").encode(encoding))
    np.testing.assert_array_equal(load_recording(path, nominal)["d_c"], made(600)["d_c"])


def test_too_many_columns_are_counted(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("\n".join([",".join(["1"] * 100_000)] * 3) + "\n")
    refused(path, ":1: 100000 columns; at most 20000 are read")
    path.write_text(",".join(f"c{k}" for k in range(100_000)) + "\n")
    refused(path, "columns in it; at most 20000 columns are read")


def twice(folder, suffix, name):
    """A recording in which ``name`` heads two columns."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table, path = made(600), folder / f"r{suffix}"
    if suffix == ".csv":
        lines = as_text(table, ",", ".").splitlines()
        path.write_text(f"{lines[0]},{name}\n" + "".join(f"{line},1\n" for line in lines[1:]))
    elif suffix == ".parquet":
        pq.write_table(pa.table([*table.values(), table["t"]], names=[*table, name]), path)
    else:
        import zipfile

        write(path, table)
        with pytest.warns(UserWarning), zipfile.ZipFile(path, "a") as archive:
            archive.writestr(f"{name}.npy", archive.read("t.npy"))
    return path


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz"])
def test_a_column_twice_is_named_if_it_is_needed(tmp_path, suffix):
    path = twice(tmp_path, suffix, "i_b")
    refused(path, "duplicate column i_b", ":1" if suffix == ".csv" else "")
    assert set(read_table(path, lambda names: ["t", "i_a"]).columns) == {"t", "i_a"}

    def lacking(names):
        raise RecordingError(f"{path}: no column i_z")

    with pytest.raises(RecordingError, match="no column i_z; the file has column i_b twice"):
        read_table(path, lacking)


def test_a_name_that_is_not_utf8(tmp_path, nominal):
    for content in (b"", b"prose\n", b"\x89PNG\r\n", as_text(made(20), ",", ".").replace("i_c", "i_b").encode()):
        path = tmp_path / os.fsdecode(b"r\xff\n.csv")
        path.write_bytes(content)
        with pytest.raises(RecordingError) as error:
            load_recording(path, nominal)
        message = str(error.value)
        assert message.isprintable() and message.encode() and message.count("udcff") == 1
    with pytest.raises(RecordingError, match="udcff"):
        read_table(tmp_path / os.fsdecode(b"none\xff.csv"))
