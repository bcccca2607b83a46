# SPDX-License-Identifier: BSD-3-Clause
"""Damaged and hostile files: each gives one clear error line, or loads with a finding that names the damage."""

from __future__ import annotations

import time

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import made, nominal_of, write
from cocotb_tests.support.slow import slowly
from cocotb_tests.support.untrusted.damaged_files import REFUSED, SUFFIXES, damaged_files
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


@pytest.mark.parametrize("every", [400, slowly(1)])
def test_every_damaged_file_ends_in_one_line(every, tmp_path, nominal):
    files = dict(list(damaged_files(tmp_path).items())[::every])
    assert len(files) >= 400 // every
    loaded, wrong, slowest = [], [], (0.0, "")
    for name, (path, expected) in files.items():
        start = time.perf_counter()
        try:
            recording = load_recording(path, nominal)
        except RecordingError as error:
            message = str(error)
            if "\n" in message or not message.isprintable() or len(message) > 600 or message.count(":") == 0:
                wrong.append(f"{name}: no clear line: {message!r}")
            recording = None
        except BaseException as error:  # the point of this test
            wrong.append(f"{name}: {type(error).__name__}: {error}")
            continue
        slowest = max(slowest, (time.perf_counter() - start, name))
        if recording is None:
            continue
        loaded.append(name)
        if expected == REFUSED and not recording.fatal:
            wrong.append(f"{name}: loaded: {recording.problems} {recording.meta['notes']}")
        n = len(recording)
        if any(len(v) != n for v in (*recording.columns.values(), recording.usable, recording.joined)):
            wrong.append(f"{name}: columns of different lengths")
        if not recording.fatal and not all(np.isfinite(v).all() for v in recording.columns.values()):
            wrong.append(f"{name}: not finite")
        if not all("\n" not in p.message for p in recording.problems):
            wrong.append(f"{name}: more than a line")
    assert not wrong, "\n".join(wrong)
    assert not (tmp_path / "canary").exists(), "a pickle was loaded"
    assert not (tmp_path.parent / "evil.npy").exists()
    assert slowest[0] < 60.0, slowest
    assert len(files) - len(loaded) >= 200 // every


def test_the_undamaged_files_load(tmp_path, nominal):
    for suffix in SUFFIXES:
        recording = load_recording(write(tmp_path / f"r{suffix}", made(800)), nominal)
        assert not recording.problems, suffix
