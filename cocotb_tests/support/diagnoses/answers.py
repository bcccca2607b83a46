# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses of the recordings of bench_logs.py, and what they say."""

from __future__ import annotations

import numpy as np

from cocotb_tests.support.recordings.from_equations import DRIVE, write
from fluxproof.diagnosis import diagnose


def without(columns, *names):
    return {name: values for name, values in columns.items() if name not in names}


def held(columns, step_s=5.0):
    n = len(next(iter(columns.values())))
    return {"t": step_s * np.arange(n), **columns}


def answer_of(folder, columns, more="", file="r.csv"):
    drive = folder / "drive.toml"
    drive.write_text(DRIVE + more)
    return diagnose(write(folder / file, columns), drive)


def found(answer):
    return {k: e.value for effect in answer.effects for k, e in effect.parameters.items()}


def said(answer, text) -> bool:
    return any(text in note for note in answer.notes)
