# SPDX-License-Identifier: BSD-3-Clause
"""The table of a power analyser: rms values, power and current references in place of dq voltages."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from cocotb_tests.support.recordings.from_equations import nominal_of
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording

WEAK = 0.95  # of the magnets' flux


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def points(nominal, weak=WEAK):
    """(i, u, omega_e) complex dq [A, V] and speed (n,) of a machine whose magnets are weaker."""
    m = nominal.machine
    speeds, currents = np.meshgrid([150.0, 300.0, 500.0, -300.0], [0.0, 1.5j, 3 - 2j, -1 + 2j, -2 + 4j, -1 - 3j, 4.5j])
    i, omega = currents.ravel(), speeds.ravel()
    psi = m.inductance_d_h * i.real + 1j * m.inductance_q_h * i.imag + weak * m.magnet_flux_wb
    return i, m.resistance_ohm * i + 1j * omega * psi, omega


def written(path, nominal, u_scale=1.0, drop=()):
    i, u, omega = points(nominal)
    table = {
        "n [1/min]": omega / nominal.machine.pole_pairs * 60 / (2 * np.pi),
        "U1_LL [V rms]": u_scale * np.abs(u) * np.sqrt(1.5),
        "I [A rms]": np.abs(i) / np.sqrt(2),
        "P_el [kW]": 1.5e-3 * (u * np.conj(i)).real,
        "Id_soll [A]": 1.01 * i.real,
        "Iq_soll [A]": 1.01 * i.imag,  # by the sensors of the drive: the current of the analyser counts
    }
    pd.DataFrame({k: np.round(x, 5) for k, x in table.items() if k not in drop}).to_csv(path, sep=";", index=False)
    return path


def test_dq_values_are_those_of_the_machine(tmp_path, nominal):
    i, u, omega = points(nominal)
    recording = load_recording(written(tmp_path / "a.csv", nominal), nominal)
    assert recording.points and not recording.has("u_line")
    loaded = (i != 0) & (np.abs(i.imag) > 0)
    found = recording["u_d_ref"] + 1j * recording["u_q_ref"]
    assert np.allclose(np.abs(found), np.abs(u), rtol=1e-3)
    assert np.max(np.abs(found - u)[loaded]) < 0.03 * np.abs(u).max()
    assert np.allclose(np.abs(recording["i_d"] + 1j * recording["i_q"]), np.abs(i), atol=1e-3)
    assert any("u_line and p_el" in note for note in recording.meta["notes"])


def test_weak_magnets_are_named(tmp_path, nominal):
    answer = diagnose(written(tmp_path / "a.csv", nominal), nominal)
    assert [e.name for e in answer.effects] == ["magnet_flux"], (answer.sentence, answer.notes)
    found = answer.effects[0].parameters["magnet_flux_wb"]
    assert found.value == pytest.approx(WEAK * nominal.machine.magnet_flux_wb, rel=0.01)


def test_what_is_missing_or_contradicts_itself_is_told(tmp_path, nominal):
    with pytest.raises(RecordingError, match="missing for a power-analyser table: p_el"):
        load_recording(written(tmp_path / "a.csv", nominal, drop=("P_el [kW]",)), nominal)
    with pytest.raises(RecordingError, match="p_el is 1.7.* times the apparent power of u_line"):
        load_recording(written(tmp_path / "b.csv", nominal, u_scale=1 / np.sqrt(3)), nominal)
