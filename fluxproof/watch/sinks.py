# SPDX-License-Identifier: BSD-3-Clause
"""Every row for others: a CSV file in SI units, and PlotJuggler's UDP server with JSON messages."""

from __future__ import annotations

import json
import socket

import numpy as np
import pyarrow as pa
from pyarrow.csv import CSVWriter

from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.io.telemetry_words import FIELDS
from golden_model.units import SIGNALS, si_per_lsb, unit

PLOTTED = ("i_d", "i_q", "i_q_ref", "omega_me", "u_d", "u_q", "u_dc", "lambda_d", "lambda_q", "run")
MOST_PER_TAKE = 20  # messages of one read: a plot needs no more, and a socket must not slow the reader


def scale_of(name: str, drive: Drive) -> float:
    """SI units per integer of a field; 1 for codes and flags."""
    return float(si_per_lsb(name, drive)) if name in SIGNALS else 1.0


def scales_of(drive: Drive) -> dict[str, float]:
    """``scale_of`` of every field of the packet."""
    return {name: scale_of(name, drive) for name in FIELDS}


def table(counter: np.ndarray, fields: dict[str, np.ndarray], scales: dict[str, float], period_s: float) -> pa.Table:
    """The rows in SI units, units in the names; codes and flags are integers."""
    columns = {"time [s]": counter * period_s, "counter": counter}
    for name, scale in scales.items():
        si = unit(name) if name in SIGNALS else "1"
        columns[name if si == "1" else f"{name} [{si}]"] = fields[name] if scale == 1.0 else fields[name] * scale
    return pa.table(columns)


class Csv:
    """All fields of all rows, time first."""

    def __init__(self, path: str, drive: Drive) -> None:
        self.scales = scales_of(drive)
        self.period_s = drive.sample_time_s
        try:
            self.file = open(path, "xb")  # noqa: SIM115 - closed by close()
        except OSError as error:
            raise DriveError(f"{path}: cannot be written: {error.strerror or error}") from None
        self.writer: CSVWriter | None = None

    def take(self, counter: np.ndarray, fields: dict[str, np.ndarray]) -> None:
        rows = table(counter, fields, self.scales, self.period_s)
        writer = self.writer or CSVWriter(self.file, rows.schema)
        writer.write(rows)
        self.writer = writer

    def close(self) -> None:
        if self.writer is not None:
            self.writer.close()
        self.file.close()


class PlotJuggler:
    """JSON messages over UDP; of each read evenly spaced rows, MOST_PER_TAKE at most."""

    def __init__(self, target: str, drive: Drive) -> None:
        host, _, port = target.rpartition(":")
        if not host or not port.isdigit():
            raise DriveError(f"--plotjuggler {target}: expected HOST:PORT")
        self.target = (host, int(port))
        self.scales = {name: scale_of(name, drive) for name in PLOTTED}
        self.period_s = drive.sample_time_s
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)

    def take(self, counter: np.ndarray, fields: dict[str, np.ndarray]) -> None:
        rows = np.unique(np.linspace(0, len(counter) - 1, MOST_PER_TAKE).astype(int))
        for k in rows:
            message = {"timestamp": float(counter[k] * self.period_s)}
            message |= {name: float(fields[name][k] * scale) for name, scale in self.scales.items()}
            try:
                self.socket.sendto(json.dumps(message).encode(), self.target)
            except OSError:
                return  # nobody listens, or too fast: a plot may miss a row

    def close(self) -> None:
        self.socket.close()
