# SPDX-License-Identifier: BSD-3-Clause
"""Names of files that hold another language: every file of every command says the same as for a harmless name."""

from __future__ import annotations

import json
import re
import shutil
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from cocotb_tests.support.diagnoses.samples import made_up
from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.untrusted.foreign_text import NAMES, Page, c_tokens, unescaped, vhdl_analysed
from cocotb_tests.support.vivado.tclsh import needs_tclsh, stubbed
from fluxproof import commission_drive as commissioning
from fluxproof.command import main
from fluxproof.commission import steps
from fluxproof.commission.session import Step, Value
from fluxproof.diagnosis.conventions.reading import Reading
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.improve.improve import write_improved
from fluxproof.diagnosis.ingest.units import split_unit
from fluxproof.diagnosis.report import pictures, write_outputs
from fluxproof.project import parts
from fluxproof.project.command import core_folder
from fluxproof.quote import visible
from golden_model.drive_file import read_tables
from golden_model.drive_keys import DriveError

ARTIX, ULTRASCALE = "xc7a100tcsg324-1", "xczu3eg-sbva484-1-e"
SPACES = " " * 100_000


def named(folder: Path, name: str, text: str | None = None) -> Path:
    """The paper's drive file, or ``text``, under a name."""
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_text(PAPER.read_text() if text is None else text)
    return path


def project(tmp_path: Path, name: str, *options: str, part: str = ULTRASCALE) -> Path:
    """The folder that `fluxproof project` writes, always the same one."""
    folder = tmp_path / "made"
    shutil.rmtree(folder, ignore_errors=True)
    drive = named(tmp_path / "drives", name)
    assert main(["project", str(drive), "--part", part, "--out", str(folder), *options]) == 0
    return folder


def compiled(text: str, folder: Path) -> list[str]:
    """What a C compiler sees of a file, without the compiler's own headers."""
    return c_tokens(re.sub("^#include <stdint.h>$", "", text, flags=re.MULTILINE), folder)


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_a_project_holds_the_same_commands(facts, tmp_path, name):  # noqa: F811
    """Tcl and XDC in the stub of Vivado, the header and the device tree in a C compiler, the package in GHDL."""
    seen = []
    for each in ("drive.toml", name):
        folder = project(tmp_path, each)
        files = {path.name: path.read_bytes().decode("ascii") for path in folder.iterdir()}
        assert len(files) == 5
        vhdl = [line for line in files["drive_pkg.vhd"].splitlines() if not line.startswith("--")]
        vhdl_analysed(files["drive_pkg.vhd"], tmp_path)
        tokens = [compiled(files[file], tmp_path) for file in ("drive_registers.h", "fluxproof.dtsi")]
        done = stubbed(facts, folder / "project.tcl", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        seen.append((done.stdout, tokens, vhdl))
        for file, text in files.items():
            assert each in unescaped(text), file
    assert seen[0] == seen[1] and "create_clock" in seen[0][0] and not list(tmp_path.glob("**/ran"))


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_a_header_of_registers_holds_the_same_values(tmp_path, capsys, name):
    seen = []
    for each in ("drive.toml", name):
        assert main(["registers", str(named(tmp_path, each)), "--format", "c"]) == 0
        out = capsys.readouterr().out
        assert out.isascii() and each in unescaped(out.splitlines()[0])
        seen.append(compiled(out, tmp_path))
    assert seen[0] == seen[1]


@pytest.mark.parametrize(
    "name", ["a}", "a} [exec touch ran] {", "a\\", "a $argv0", "[exec touch ran]", 'a" ; exec touch ran', "a\nb", "é ж"]
)
def test_the_folder_of_the_core_is_one_word(facts, tmp_path, name):  # noqa: F811
    needs_tclsh()
    core = tmp_path / name
    (core / "scripts" / "vivado").mkdir(parents=True)
    (core / "scripts" / "vivado" / "example.tcl").write_text('file mkdir [file join $core "was here"]\n')
    folder = project(tmp_path, "drive.toml", "--core", str(core), part="xc7z020clg484-1")
    done = stubbed(facts, folder / "project.tcl", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (core / "was here").is_dir() and not list(tmp_path.glob("**/ran"))


@pytest.mark.parametrize("name", ["a\U0001f600", "a\udcff"])
def test_a_folder_that_tcl_cannot_hold_is_refused(tmp_path, capsys, name):
    drive = named(tmp_path, "drive.toml")
    assert main(["project", str(drive), "--part", ARTIX, "--out", str(tmp_path / "out"), "--core", name]) == 2
    err = capsys.readouterr().err
    assert f"U+{ord(name[1]):04X}" in err and err.count("\n") == 1 and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ("--part", "xc7z" + "0" * 30_000),
        ("--part", "xc" + "7a" * 15_000 + "_"),
        ("--part", "xc7z٠٢٠clg484-1"),
        ("--part", "xc7z020clg484-1\n"),
        ("--part", "\u212ac7z020clg484-1"),
        ("--part", "xc7z020clg484-1;exec"),
        ("--base", "٠x43C00000"),
        ("--base", "١١٢٧٢١٩٢٠٠"),
        ("--base", "0x43C0_0000"),
        ("--base", " 0x43C00000"),
        ("--base", "1" * 100_000),
    ],
)
def test_arguments_of_other_scripts_and_of_any_length_are_refused_at_once(tmp_path, capsys, option, text):
    given = {"--part": "xc7z020clg484-1", option: text}
    options = [word for pair in given.items() for word in pair]
    began = time.process_time()
    assert main(["project", str(PAPER), "--out", str(tmp_path / "out"), *options]) == 2
    assert time.process_time() - began < 5.0
    err = capsys.readouterr().err
    assert option in err and err.count("\n") == 1 and len(err) < 300 and not (tmp_path / "out").exists()


@pytest.mark.parametrize("part", [ARTIX, "xc7a35ticsg324-1L", "XCZU3EG-SBVA484-1-E", "xcku040-ffva1156-2-e"])
def test_names_of_parts_are_known(part):
    assert parts.checked(part) == part.lower()


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_commissioning_keeps_what_the_file_says(tmp_path, monkeypatch, capsys, name):
    """The drive file itself holds the name as a key, a string and a comment."""
    monkeypatch.setattr(commissioning, "open_bus", lambda *_: SimpleNamespace(now=lambda: 1.0))

    def measured(bus, drive, reverse, say, done, *_):
        done(Step("resistance", {"resistance": Value(1.5, 0.01, "ohm")}, f"of {name}"))
        return replace(drive, sensors=replace(drive.sensors, current_offset_code=(2048.0,) * 3)), None

    monkeypatch.setattr(steps, "commission", measured)
    held = name.encode("utf-8", "replace").decode()  # what a file of UTF-8 can hold of it
    key = '"' + "".join(f"\\U{ord(c):08x}" for c in held) + '"'
    lines = PAPER.read_text().replace("resistance_ohm", f"# {visible(held)!r}\nresistance_ohm")
    drive = named(tmp_path, name, f'{lines}\n[columns]\n{key} = {{name = "i_a"}}  # {held!r}\n')
    assert main(["commission", str(drive), "--out", str(tmp_path / "out")]) == 0
    before, after = read_tables(drive), read_tables(tmp_path / "out" / "drive.toml")
    assert held in after["columns"] and after["columns"] == before["columns"] and set(after) == set(before)
    assert json.loads((tmp_path / "out" / "commission.json").read_text())["drive"] == name
    assert all(line.isprintable() for line in capsys.readouterr().out.splitlines())


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_the_improved_drive_names_the_columns_of_the_recording(tmp_path, name):
    """The column's name comes from the recording; what TOML cannot hold is said in a comment."""
    nominal = load_nominal(named(tmp_path, name))
    recording = from_columns({"t": [0.0, 1.0], "i_d": [0.0, 1.0], "i_q": [0.0, 1.0]}, 1.0)
    recording.meta["columns"] = {"i_d": name, "i_q": "q"}
    reading = Reading("x", "i", f"of {name}", currents=2.0)
    path = write_improved(nominal, [], tmp_path / "out.toml", [reading], recording)
    columns = read_tables(path)["columns"]
    assert columns.pop("q") == {"name": "i_q", "factor": 2.0}
    if "\udcff" in name:
        assert columns == {} and "# a\\udcff\\udcfe.toml: the character U+DCFF" in path.read_text()
    else:
        assert columns == {name: {"name": "i_d", "factor": 2.0}}


@pytest.fixture(scope="module")
def drawn():
    """The pictures of a report, which are slow to draw and hold no name."""
    return pictures.draw(made_up()["explained"], None)


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_a_report_has_the_same_elements(tmp_path, monkeypatch, drawn, name):
    monkeypatch.setattr(pictures, "draw", lambda *_: drawn)
    seen = []
    for each in ("drive.toml", name):
        nominal = load_nominal(named(tmp_path, each))
        write_outputs(made_up()["explained"], tmp_path / "out", nominal)
        found = Page((tmp_path / "out" / "report.html").read_bytes().decode("utf-8"))
        assert visible(each) in found.text
        seen.append(found.tags)
    assert seen[0] == seen[1]


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_diagnose_says_one_printable_line(tmp_path, capsys, name):
    """A recording, its column and the drive file have the name."""
    drive, recording = named(tmp_path / "drives", name), tmp_path / f"{name}.csv"
    column = name.encode("utf-8", "replace").decode().replace('"', '""')
    text = f't [s],"{column} [A]"\n' + "".join(f"0,{k}\n" for k in range(40))
    recording.write_bytes(text.encode())
    assert main(["diagnose", str(recording), "--drive", str(drive), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and err[:-1].isprintable() and err.count("fluxproof:") == 1


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("i_a [mA]", ("i_a", "mA")), ("i_a (mA) ", ("i_a", "mA")), (" i_a ", ("i_a", "")), ("[mA]", ("[mA]", "")),
        ("a [b] [mA]", ("a [b]", "mA")), ("a [b](c]", ("a [b]", "c")), ("a ]b]", ("a ]b]", "")), ("", ("", "")),
        ("a [b]c]", ("a [b]c]", "")), ("a []", ("a", "")), (f"a{SPACES}x]", (f"a{SPACES}x]", "")),
    ],
    ids=range(11),
)  # fmt: skip
def test_a_unit_in_brackets_is_found_at_once(name, expected):
    began = time.process_time()
    assert split_unit(name) == expected and time.process_time() - began < 1.0


@pytest.mark.parametrize(
    "text",
    [
        "a" + ".a" * 50_000 + " = 1", "[a" + " . a" * 25_000 + "]", "x = {a" + ".a" * 50_000 + " = 1}",
        '"="' + '."="' * 25_000 + " = 1", "x = '''\n\"'''\ny" + ".'#'" * 25_000 + " = 1", 'x = """' + '\\"""' * 25_000,
        "x = [" + '"a.b", ' * 30 + "]\ny" + '."""' * 25_000,
    ],
    ids=range(7),
)  # fmt: skip
def test_a_key_of_many_parts_is_refused_at_once(tmp_path, capsys, text):
    began = time.process_time()
    assert main(["registers", str(named(tmp_path, "drive.toml", text))]) == 2
    err = capsys.readouterr().err
    assert time.process_time() - began < 3.0 and "drive.toml:" in err and err.count("\n") == 1


def test_a_file_with_many_points_is_read(tmp_path):
    """Points in strings, comments and numbers are no parts of keys."""
    points = "." * 200 + "a.b" * 60
    text = f'# {points}\na = \'{points}\' # {points}\nb = """\n{points}\n"""\nc = [{"1.5, " * 100}]\n'
    assert read_tables(named(tmp_path, "drive.toml", text))["c"] == [1.5] * 100


def test_a_core_folder_that_no_system_has_is_refused():
    """A find of `make fuzz`."""
    with pytest.raises(DriveError, match=r"--core 'a\\x00b': no name of a folder"):
        core_folder("a\0b")
