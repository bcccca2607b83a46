# SPDX-License-Identifier: BSD-3-Clause
"""Files of strangers: what is no regular file, manifests in other encodings, addresses, names that are not UTF-8."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cocotb_tests.support.fleet.small_fleet import Here
from fluxproof.command import main
from fluxproof.diagnosis.fleet.prior import read_fleet
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.fleet.addresses import blocks, check_address, file_name, spelled
from fluxproof.fleet.manifest import entries
from fluxproof.fleet.manifest_file import MOST_COLUMNS, MOST_LINE
from fluxproof.fleet.session import run
from fluxproof.fleet.work import Item, key_of, version, work
from golden_model.regular_file import read_regular

DRIVE = Path(__file__).resolve().parents[2] / "docs" / "drives" / "servo_24v.toml"
FIFOS = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no FIFOs here")


def reasons(sources, out: Path) -> dict[str, str]:
    """{recording: reason} of the rows."""
    outcome = run(entries([str(s) for s in sources], str(DRIVE)), out, Here, quiet=True)
    return {row["recording"]: row["reason"] for row in pq.read_table(outcome.fleet).to_pylist()}


@FIFOS
def test_what_is_no_regular_file_costs_one_row(tmp_path):
    os.mkfifo(tmp_path / "fifo.csv")
    (tmp_path / "folder").mkdir()
    (tmp_path / "gone.csv").symlink_to("nowhere")
    names = ["fifo.csv", "/dev/zero", "folder", "gone.csv"]
    (tmp_path / "list.csv").write_text("\n".join(["recording", *names]))
    said = reasons([tmp_path / "list.csv"], tmp_path / "out")
    kinds = ["a FIFO, not", "a device, not", "a folder, not", "No such file"]
    assert all(kind in said[name] for name, kind in zip(names, kinds, strict=True))
    for source in (tmp_path, tmp_path / "*.csv"):  # the folder, a pattern
        found = reasons([source], tmp_path / "out2")
        assert "a FIFO, not" in found[str(tmp_path / "fifo.csv")] and "No such" in found[str(tmp_path / "gone.csv")]


@FIFOS
@pytest.mark.parametrize(
    "command",
    [
        "fleet BAD --drive DRIVE --out OUT", "fleet A --drive BAD --out OUT", "diagnose A --drive BAD --out OUT",
        "registers BAD", "dump BAD --drive DRIVE -o OUT", "dump A --drive DRIVE --registers BAD -o OUT",
    ],
)  # fmt: skip
@pytest.mark.parametrize("bad", ["fifo", "/dev/zero"])
def test_every_command_refuses_what_is_no_regular_file(tmp_path, command, bad, capsys):
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "a.csv").write_text("t,i_a\n0,1\n")
    places = {"BAD": str(tmp_path / bad), "A": str(tmp_path / "a.csv"), "DRIVE": str(DRIVE), "OUT": str(tmp_path / "o")}
    assert main([places.get(word, word) for word in command.split()]) == 2
    said = capsys.readouterr().err.strip()
    assert bad in said and "not a regular file" in said and "\n" not in said


def test_sizes_are_limited(tmp_path):
    (tmp_path / "drive.toml").write_bytes(b"#" * 1001)
    with pytest.raises(OSError, match="more than 1000 bytes"):
        read_regular(tmp_path / "drive.toml", 1000)
    with pytest.raises(OSError, match="longer than"), open("/dev/zero", "rb") as endless:
        list(blocks(endless, limit_s=0.05))


@FIFOS
def test_a_prior_is_a_fleet(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(RecordingError, match="a FIFO, not a regular file"):
        read_fleet(tmp_path / "fifo")
    pq.write_table(pa.table({"recording": [1]}), tmp_path / "other.parquet")
    with pytest.raises(RecordingError, match="column 'recording' is int64, not string"):
        read_fleet(tmp_path / "other.parquet")


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_manifests_of_other_programs(tmp_path, encoding, separator):
    text = f"serial{separator}recording\r\n7ä{separator}a.csv\r\n"
    (tmp_path / "list.csv").write_bytes(text.encode(encoding))
    (entry,) = entries([str(tmp_path / "list.csv")], str(DRIVE))
    assert (entry.name, entry.serial) == ("a.csv", "7ä")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("recording,serial\na.csv,ä\n".encode("utf-16-le"), ": UTF-16-LE without a byte-order mark; expected UTF-8"),
        ("recording\na.csv\n".encode("utf-16") + b"\x00\xd8", ":3: not UTF-16 text, as the byte-order mark says"),
        (b"recording,serial\na.csv,\xe4\n", ":2: column 'serial': byte 0xe4 is not UTF-8; save the manifest as UTF-8"),
        (b"recording,\xe4\na.csv,1\n", ":1: column 2: byte 0xe4 is not UTF-8"),
        (b"recording;recording\na;b\n", ":1: column 'recording' twice"),
        (b"recording\na\0.csv\n", ":2: letter 2 is a zero byte; expected text"),
        (("recording," + ",".join(map(str, range(MOST_COLUMNS)))).encode(), ":1: 1001 columns; at most 1000 are read"),
        (b"recording\n" + b"a" * (MOST_LINE + 1), ":2: more letters in a line; at most 1000000 are read"),
        (b"recording\n" + b"a" * 200_000, ":2: not a table in CSV: field larger than field limit"),
        (b"recording,time\na.csv,0001-01-01T00:00:00+14:00\n", ":2: column 'time': "),
        (b"recording,temperature\na.csv,nan\n", ":2: column 'temperature': 'nan' is no number; expected degrees"),
        (b"recording,drive\na.csv," + b"d" * 5000 + b"\n", ":2: column 'drive': "),
        (b"recording\nhttp://host/a.csv\n", ":2: column 'recording': http://host/a.csv: http:// in a manifest needs"),
    ],
)  # fmt: skip
def test_mistakes_of_a_manifest(tmp_path, data, said):
    (tmp_path / "list.csv").write_bytes(data)
    with pytest.raises(RecordingError, match="^[^\n]{1,700}$") as error:
        entries([str(tmp_path / "list.csv")], str(DRIVE))
    assert f"list.csv{said}" in str(error.value)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (pa.table({"recording": ["a"], "more": [[1, 2]]}), "column 'more' is list<element: int64>; expected text, num"),
        (pa.table({"recording": [b"a"]}), "column 'recording' is binary; expected text, numbers or times"),
        (pa.table([["a"], ["b"]], names=["recording"] * 2), ":1: column 'recording' twice"),
    ],
)
def test_mistakes_of_a_manifest_in_parquet(tmp_path, table, said):
    pq.write_table(table, tmp_path / "list.parquet")
    with pytest.raises(RecordingError) as error:
        entries([str(tmp_path / "list.parquet")], str(DRIVE))
    assert said in str(error.value)


@pytest.mark.parametrize(
    "address",
    [
        "s3://bucket/a.csv", "zip://a.csv::http://host/a.zip", "reference://a::file:///refs.json",
        "simplecache::http://host/a.csv", "ssh://host/a.csv", "zip://a.csv", "tar://a.csv::file:///a.tar.gz",
        "generic://http://host/a", "nothing://a",
    ],
)  # fmt: skip
def test_a_manifest_connects_to_nothing_by_itself(address):
    with pytest.raises(RecordingError):
        check_address(address, ())


def test_addresses_that_are_allowed():
    for address in ("file:///a.csv", "zip://n/*.csv::file:///a.zip", "tar://a.csv::zip://b.tar::file:///c.zip"):
        check_address(address, ())
    check_address("http://host/a.csv", ("http",))
    check_address("s3://bucket/a.csv")  # on the command line
    for address in ("reference://a::file:///refs.json", "reference://a", "simplecache::http://host/a"):
        with pytest.raises(RecordingError):
            check_address(address)


def test_names_of_an_archive_choose_no_address_and_no_folder(tmp_path):
    with zipfile.ZipFile(tmp_path / "store.zip", "w") as store:
        store.writestr("a.csv::http://host/b.csv", "t\n0\n")
    with pytest.raises(RecordingError, match="contains '::'"):
        entries([f"zip://**/*::file://{tmp_path / 'store.zip'}"], str(DRIVE))
    assert file_name("zip://../../x.csv::file:///a.zip") == "x.csv"
    for address in ("http://host/..", "http://host/a/../", "http://h/\0\n", "http://h/" + "n" * 999):
        name = file_name(address)
        assert name and name not in (".", "..") and len(name) <= 100 and name.isprintable() and "/" not in name


def test_links_that_lead_back_end(tmp_path):
    for name in "ab":
        (tmp_path / name).symlink_to(".")
    (tmp_path / "x.csv").write_text("t\n0\n")
    found = entries([str(tmp_path / "**" / "*.csv"), str(tmp_path)], str(DRIVE))
    assert [e.name for e in found] == [str(tmp_path / "x.csv")]


def test_names_that_are_no_text(tmp_path):
    names = [b"run\xff.csv", b"run\\xff.csv", b"run\xfe.csv", b"run\n.csv", "rün.csv".encode()]
    folder = tmp_path / "runs"
    folder.mkdir()
    try:
        for n, name in enumerate(names):
            Path(os.fsdecode(os.fsencode(folder) + b"/" + name)).write_text(f"t,i_a\n0,{n}\n")
    except OSError:
        pytest.skip("this file system has names in UTF-8 alone")
    found = reasons([folder], tmp_path / "out")
    assert len(found) == len(names) and str(folder / "run\\xff.csv") in found
    page = (tmp_path / "out" / "fleet.html").read_text(encoding="utf-8")
    assert "run\\xff.csv" in page and "run\\\\xff.csv" in page
    assert main(["fleet", str(folder), "--drive", str(DRIVE), "--out", str(tmp_path / "out"), "--quiet"]) == 0


def test_spelled_names_stay_different():
    names = ["a", "a\udcff", "a\\xff", "a\\\\xff", "a\\\udcff", "a\\", "ä\udcff"]
    assert len({spelled(name) for name in names}) == len(names)
    assert spelled("ä") == "ä" and spelled("a\udcff") == "a\\xff" and spelled("C:\\b") == "C:\\b"


def test_a_recording_that_is_removed_meanwhile_is_tried_again(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,i_a\n0,1\n")
    item = Item(str(path), str(DRIVE), key_of(str(path), str(DRIVE)), version=version())
    assert work(item).lasting
    path.unlink()
    result = work(item)
    assert not result.lasting and "cannot be read" in result.row["reason"]


def test_an_empty_drive_file_and_a_closed_folder(tmp_path):
    (tmp_path / "empty.toml").write_text("")
    (tmp_path / "a.csv").write_text("t,i_a\n0,1\n")
    outcome = run(entries([str(tmp_path / "a.csv")], str(tmp_path / "empty.toml")), tmp_path / "out", Here, quiet=True)
    (row,) = pq.read_table(outcome.fleet).to_pylist()
    assert row["status"] == "failed" and "is missing" in row["reason"]
    if hasattr(os, "geteuid") and os.geteuid() != 0:  # root may read everything
        (tmp_path / "runs" / "closed").mkdir(parents=True, mode=0o000)
        with pytest.raises(RecordingError, match="closed|runs: cannot be read: Permission denied"):
            entries([str(tmp_path / "runs")], str(DRIVE))
