# SPDX-License-Identifier: BSD-3-Clause
"""A unit that is written down is kept, whatever the nameplate suggests."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import codes, made, nominal_of, write
from fluxproof.diagnosis.loading.load import load_recording


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


DOCUMENTED = {"A": ("i_a", "i_b", "i_c", 1e3), "1": ("d_a", "d_b", "d_c", 100.0), "V": ("u_dc", 1e3)}


@pytest.mark.parametrize("unit", DOCUMENTED)
def test_a_documented_unit_is_never_converted(tmp_path, nominal, unit):
    """The nameplate may be wrong as well: the recording is rejected, with a word on both."""
    *names, factor = DOCUMENTED[unit]
    table = {f"{n} [{unit}]" if n in names else n: v * (factor if n in names else 1.0) for n, v in made().items()}
    recording = load_recording(write(tmp_path / "r.csv", table), nominal)
    (problem,) = (p for p in recording.problems if p.code == "unit")
    assert problem.fatal and problem.column in names and "documented" in problem.message
    np.testing.assert_allclose(recording[names[0]], table[f"{names[0]} [{unit}]"])


def test_the_unit_of_a_common_name_is_not_documented(tmp_path, nominal):
    table = {n.replace("i_", "i"): v * (1e3 if n.startswith("i_") else 1.0) for n, v in made().items()}
    recording = load_recording(write(tmp_path / "r.csv", table), nominal)
    assert codes(recording) == ["unit"] and not recording.fatal
    np.testing.assert_allclose(recording["i_a"], made()["i_a"], atol=1e-6)


@pytest.mark.parametrize("header", ["temp_winding", "temp_winding [degC]"])
def test_a_winding_in_kelvin(tmp_path, nominal, header):
    recording = load_recording(write(tmp_path / "r.csv", made() | {header: np.full(4000, 300.0)}), nominal)
    assert codes(recording) == ["unit"] and not recording.fatal
    if header == "temp_winding":
        np.testing.assert_allclose(recording["temp_winding"], 26.85)
    else:
        assert "temp_winding" not in recording.columns and recording.problems[0].action == "not used"
