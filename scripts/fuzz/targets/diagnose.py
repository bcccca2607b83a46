# SPDX-License-Identifier: BSD-3-Clause
"""The whole of `diagnose` on damaged recordings, to its report: a few cases a minute."""

from __future__ import annotations

import functools

from hypothesis import strategies as st

from fluxproof.diagnosis.command import answer_lines, printable
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.session import run as session
from scripts.fuzz import corpus
from scripts.fuzz.case import Case
from scripts.fuzz.drawn import damage, text

SECONDS, TURN, NAMES_FILE = 120.0, 2, True
ROWS = 1200
NAN = ("nan", "0", "1e308", "-1e308", "1e-308")


@functools.cache
def _files() -> tuple[Case, ...]:
    return Case(".csv", corpus.text(corpus.motor(ROWS))), *corpus.telemetry()[:1]


def cases():
    table = _files()[0]
    return st.one_of(text.damaged_table((table,)), columns(table), damage.damaged(_files()))


@st.composite
def columns(draw, table: Case) -> Case:
    """Every second, third, ... value of a column is another one, or the column is scaled."""
    lines = [line.split(",") for line in table.content.decode().splitlines()]
    for _ in range(draw(st.integers(1, 3))):
        column = draw(st.integers(0, len(lines[0]) - 1))
        step, first = draw(st.sampled_from((1, 2, 3, 100))), draw(st.integers(1, 3))
        word = draw(st.sampled_from((*NAN, "scale")))
        factor = 10.0 ** draw(st.integers(-12, 12))
        for line in lines[first::step]:
            line[column] = f"{float(line[column]) * factor:.6g}" if word == "scale" else word
    return Case(".csv", "\n".join(map(",".join, [*lines, []])).encode())


def run(path) -> None:
    """The command's steps, with the lines it prints."""
    drive = path.parent / "drive.toml"
    drive.write_text(corpus.NOMINAL)
    nominal = load_nominal(drive)
    out = path.parent / "out"
    answer = session([str(path)], nominal, out)
    for line in answer_lines(answer, nominal, out):
        assert printable(line, "utf-8").isprintable()
    assert (out / "report.html").stat().st_size and (out / "diagnosis.json").stat().st_size


def warm(folder) -> None:
    for case in _files():
        path = folder / f"valid{case.suffix}"
        path.write_bytes(case.content)
        run(path)
