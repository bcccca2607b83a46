# SPDX-License-Identifier: BSD-3-Clause
"""Text of other languages: `project`, and `registers --format c`, with odd file names, folders, parts and addresses.

The case is JSON of the arguments; what the texts mean to their languages is for the tests of fluxproof/quote.py.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os

from hypothesis import strategies as st

from fluxproof import print_registers
from fluxproof.project import command
from golden_model.drive_keys import DriveError
from scripts.fuzz import corpus
from scripts.fuzz.case import Case
from scripts.fuzz.drawn.text import names

SECONDS, TURN, NAMES_FILE = 5.0, 60, False
LONG = st.sampled_from(
    ("1" * 30_000, "xc7z" + "0" * 30_000, "x" * 30_000, "xc7z0٢0clg484-1", "XC7Z020CLG484-1", "xc7z020clg484-1\n")
)
VALID = {"name": "drive.toml", "part": "xc7z020clg484-1", "core": None, "base": None, "drive": 0}


def cases():
    odd = {
        "name": names.map(lambda s: s.replace("/", "").replace("\0", "")[:80].strip(".") or "d"),
        "part": st.one_of(LONG, names, st.sampled_from(("xc7a35ticsg324-1L", "xczu3eg-sbva484-1-e"))),
        "core": st.one_of(st.none(), names),
        "base": st.one_of(st.none(), names, st.sampled_from(("0x43C00000", "0x1000", "-4096", "1" * 5000))),
        "drive": st.integers(0, len(corpus.drives()) - 2),
    }
    changed = st.sets(st.sampled_from(sorted(odd)), max_size=3)
    drawn = changed.flatmap(
        lambda keys: st.fixed_dictionaries({k: odd[k] if k in keys else st.just(VALID[k]) for k in VALID})
    )
    return drawn.map(lambda given: Case(".json", json.dumps(given).encode()))


def run(path) -> None:
    """The two commands; either writes every file whole, or none."""
    try:
        given = json.loads(path.read_bytes())
        content = corpus.drives()[1 + given["drive"]]  # the first is not complete
        drive = path.parent / given["name"]
    except (ValueError, KeyError, TypeError, IndexError):  # a shortened case that no command line gives
        return
    try:
        drive.write_bytes(content)
    except (OSError, ValueError):  # no name of a file here
        return
    out = path.parent / "out"
    arguments = argparse.Namespace(
        drive=str(drive), part=given["part"], core=given["core"], base=given["base"], hil=False, out=str(out)
    )
    failure = _printed(command.run, arguments)
    written = sorted(os.listdir(out)) if out.exists() else []
    assert bool(written) == (failure is None), f"{failure} and {written}"
    for name in written:
        assert not name.startswith("."), f"a temporary file {name}"
        assert (out / name).read_bytes().endswith(b"\n"), f"{name} is not whole"
    failure = (
        _printed(print_registers.run, argparse.Namespace(drive=str(drive), format="c", json=None, flux_map=None))
        or failure
    )
    if failure is not None:
        raise failure


def _printed(run_command, arguments) -> DriveError | None:
    """Run a command with its output thrown away; its error."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            run_command(arguments)
    except DriveError as error:
        return error
    return None


def warm(folder) -> None:
    path = folder / "valid.json"
    path.write_text(json.dumps(VALID))
    run(path)
