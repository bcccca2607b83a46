# SPDX-License-Identifier: BSD-3-Clause
"""The files of the cases: a recording with its drive file as they are, or a variant written into a folder."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from fluxproof.checkout import DRIVES, recordings
from fluxproof.files import replacing, write_text
from studies.real import brusa

MN4004 = Path(__file__).with_name("mn4004.toml")
METU_COLUMNS = {"t_s": ("t", "s"), "id1": ("i_d", "A"), "iq1": ("i_q", "A"), "vd1": ("u_d_ref", "V"),
                "vq1": ("u_q_ref", "V")}  # fmt: skip
METU_RAD_S = 50.0 / 60.0 * 2.0 * np.pi * 10
Files = Callable[[Path], tuple[list[Path], Path]]


def _present(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    return path


def with_drive(recording: str, drive: Path) -> Files:
    """A recording by its path below the folder of recordings, with a drive file of the project."""
    return lambda folder: ([_present(recordings() / recording)], drive)


def at(place: str, recording: str, drive: str = "drive.toml") -> Files:
    """A recording and a drive file of one folder of recordings."""
    return lambda folder: ([_present(recordings() / place / recording)], _present(recordings() / place / drive))


def rows_apart(place: str, recording: str, step_s: float) -> Files:
    """The same rows with another time between them."""

    def files(folder: Path):
        (source,), drive = at(place, recording)(folder)
        table = pd.read_csv(source)
        return [written(table.assign(t=step_s * np.arange(len(table))), folder / "recording.csv")], drive

    return files


def metu(with_step: bool) -> Files:
    """The module's log with its columns named and its constant speed; with_step: and the time between its rows."""

    def files(folder: Path):
        (source,), drive = at("bench/metu", "module_1.csv")(folder)
        text = drive.read_text()
        text += "\n[control]\nsample_time_s = 0.0004\n" if with_step else ""
        text += "\n[columns]\n" + "".join(f'{k} = {{name="{n}", unit="{u}"}}\n' for k, (n, u) in METU_COLUMNS.items())
        text += f'id_tot = ""\niq_tot = ""\n\n[constants]\nomega_e = {METU_RAD_S:.6g}\n'
        return [source], write_text(folder / "drive.toml", text)

    return files


def brusa_loop(folder: Path):
    """Two recordings of the closed loop over the measured map; made once, as the simulation takes a minute."""
    source = _present(recordings() / brusa.FILE)
    out = [folder / f"naming_{k}.parquet" for k in range(len(brusa.NAMING))]
    if not all(path.exists() for path in out):
        naming, _ = brusa.recordings(brusa.measured_map(source))
        for path, recording in zip(out, naming, strict=True):
            with replacing(path) as temporary:
                pd.DataFrame(recording.columns).to_parquet(temporary, index=False)
    return out, write_text(folder / "drive.toml", brusa.DRIVE.read_text() + brusa.IDEAL)


def written(table: pd.DataFrame, path: Path, separator: str = ",") -> Path:
    """A table as CSV with nine digits."""
    with replacing(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.9g", sep=separator)
    return path


__all__ = ["DRIVES", "MN4004", "at", "brusa_loop", "metu", "rows_apart", "with_drive", "written"]
