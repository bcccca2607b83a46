# SPDX-License-Identifier: BSD-3-Clause
"""A recording with its drive file before they are written, the ways to change it, and a mishap as such a change."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit

from fluxproof.files import replacing, write_text
from studies.mishaps.bases import BASES, FORMS
from studies.scored.truth import Case, Cause, Truth

KEYS = {"resistance_ohm": "resistance", "inductance_d_h": "inductance_d", "inductance_q_h": "inductance_q",
        "magnet_flux_wb": "magnet_flux"}  # fmt: skip
SEEN, EXACT, ROOM = 0.03, 0.003, 0.06  # shares of a value: a difference that is a cause, that is none; its interval


@dataclass(frozen=True)
class Log:
    """columns: {name in the file: (n,) numbers or texts}; drive: document of the drive file; rest: how it is written.

    before, after: text around the rows of a CSV; index: the table's index in Parquet, which then is the format.
    """

    columns: dict
    drive: dict
    separator: str = ","
    decimal: str = "."
    before: str = ""
    after: str = ""
    header: str = ""  # in place of the names
    digits: str = "%.9g"
    encoding: str = "utf-8"
    index: pd.Index | None = None

    def having(self, **columns) -> Log:
        """With these columns beside the others, or in their place."""
        return dataclasses.replace(self, columns={**self.columns, **columns})

    def without(self, *names) -> Log:
        return dataclasses.replace(self, columns={n: v for n, v in self.columns.items() if n not in names})

    def rows(self, chosen) -> Log:
        """The rows of an index or mask."""
        return dataclasses.replace(self, columns={n: np.asarray(v)[chosen] for n, v in self.columns.items()})

    def renamed(self, **names) -> Log:
        return dataclasses.replace(self, columns={names.get(n, n): v for n, v in self.columns.items()})

    def driven(self, section: str, **values) -> Log:
        """With these keys in a section of the drive file; None removes a key."""
        part = {k: v for k, v in {**self.drive.get(section, {}), **values}.items() if v is not None}
        return dataclasses.replace(self, drive={**self.drive, section: part})

    def written(self, folder: Path) -> tuple[list[Path], Path]:
        """(recordings, drive file) in a folder."""
        drive = write_text(folder / "drive.toml", tomlkit.dumps(self.drive))
        frame = pd.DataFrame(self.columns)
        path = folder / ("recording.csv" if self.index is None else "recording.parquet")
        with replacing(path) as temporary:
            if self.index is not None:
                frame.set_index(self.index).to_parquet(temporary)
            else:
                temporary.write_bytes(self._text(frame).encode(self.encoding))
        return [path], drive

    def _text(self, frame) -> str:
        rows = frame.to_csv(
            index=False, sep=self.separator, decimal=self.decimal, float_format=self.digits, lineterminator="\n"
        )
        names, _, body = rows.partition("\n")
        return f"{self.before}{self.header or names}\n{body}{self.after}"


@dataclass(frozen=True)
class Mishap:
    """name; form of the recording; what it does to a Log; and of the truth: what it adds to that of the base.

    may, reading, may_read: as in Cause, of the causes by which the drive file differs.
    ignored: the base's own cause cannot be seen any more.
    """

    name: str
    form: str
    change: Callable[[Log], Log]
    causes: tuple[Cause, ...] = ()
    beside: tuple[Cause, ...] = ()
    readings: str = ""
    limit: str = ""
    never: str = ""
    tells: str = ""
    guess: str = ""
    may: tuple[str, ...] = ()
    reading: str = ""
    may_read: str = ""
    ignored: bool = False

    def case(self, base: str) -> Case:
        """The mishap on one base."""
        log = Log(dict(FORMS[self.form](base)), BASES[base].drive())
        changed = self.change(log)
        name = f"{self.name.replace(' ', '_')}.{base}"
        return Case(name, self.truth(base, changed.drive), changed.written)

    def truth(self, base: str, drive: dict) -> Truth:
        """Causes by which the machine differs from the drive file as it is written now, and those of the mishap."""
        causes, beside = [*self.causes], [*self.beside]
        for key, name in {} if self.ignored else KEYS.items():
            true = BASES[base].value(key)
            stated = drive["machine"].get(key, true)
            off = abs(true - stated) / true
            sizes = {key: (true - ROOM * abs(true), true + ROOM * abs(true))}
            if off > SEEN:
                causes.append(Cause((name,), sizes, self.may, self.reading, self.may_read))
            elif off > EXACT:
                beside.append(Cause((name,), sizes))
        if self.ignored:
            beside += [Cause((KEYS[key],)) for key in BASES[base].true]
        return Truth(tuple(causes), tuple(beside), self.readings, self.limit, self.never, self.tells, self.guess)


def scaled(factor, *names):
    """Columns times a factor."""
    return lambda log: log.having(**{n: log.columns[n] * factor for n in names})


def swapped(one, other):
    """Two columns exchanged."""
    return lambda log: log.having(**{one: log.columns[other], other: log.columns[one]})


def stated(**factors):
    """Keys of [machine] times a factor."""
    return lambda log: log.driven("machine", **{k: log.drive["machine"][k] * f for k, f in factors.items()})


def then(*changes):
    """One change after the other."""

    def change(log):
        for one in changes:
            log = one(log)
        return log

    return change
