# SPDX-License-Identifier: BSD-3-Clause
"""The table of mistaken conventions."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.recordings.with_mistake import ROOT2
from fluxproof.diagnosis.conventions.table import READINGS


def test_every_reading_has_a_code_of_its_own_and_an_inverse_factor():
    codes = [r.code for r in READINGS]
    assert len(set(codes)) == len(codes)
    rms = next(r for r in READINGS if r.code == "currents_rms")
    assert rms.factor == pytest.approx(1 / ROOT2) and rms.columns()["i_a"] == (pytest.approx(ROOT2), 0.0)
    angle = next(r for r in READINGS if r.code == "angle_90")
    assert angle.factor is None and angle.columns() == {"theta_e": (1.0, pytest.approx(-np.pi / 2))}
