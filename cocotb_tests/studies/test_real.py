# SPDX-License-Identifier: BSD-3-Clause
"""Real recordings: what they determine, what they do not, and both on held-out rows.

Without the recordings, whose folder FLUXPROOF_RECORDINGS names (default ../shared/recordings), these tests skip.
"""

from __future__ import annotations

import json

import pytest

from fluxproof.checkout import recordings
from fluxproof.diagnosis.ground.nominal import load_nominal
from studies.real import brusa, emrax, laas
from studies.real.__main__ import main


def run(part, out):
    file = recordings() / part.FILE
    if not file.exists():
        pytest.skip(f"{part.FILE} is missing; FLUXPROOF_RECORDINGS names its folder")
    entry = part.run(recordings(), out)
    folder = out / part.FILE.parts[0]
    data = json.loads((folder / "diagnosis.json").read_text())
    assert data["verdict"] == entry["verdict"]
    assert "<svg" in (folder / "report.html").read_text() or "<img" in (folder / "report.html").read_text()
    load_nominal(folder / "drive_improved.toml")
    return entry


@pytest.fixture(scope="module")
def emrax_entry(tmp_path_factory):
    return run(emrax, tmp_path_factory.mktemp("emrax"))


@pytest.fixture(scope="module")
def laas_entry(tmp_path_factory):
    return run(laas, tmp_path_factory.mktemp("laas"))


@pytest.mark.study
@pytest.mark.parametrize("split", ("operating_points", "operating_points_loaded", "later_time", "later_time_loaded"))
def test_emrax_improves_on_both_axes(emrax_entry, split):
    for axis in "dq":
        both = emrax_entry["held_out_splits"][split][axis]
        assert both["after"] < 0.4 * both["before"]


@pytest.mark.study
def test_emrax_names_what_its_log_can_show(emrax_entry):
    told = set(emrax_entry["effects"]).union(*emrax_entry["ambiguity"])
    assert {"dead_time", "encoder_offset", "cross_saturation"} <= set(emrax_entry["effects"])
    # A gain of the bus voltage leaves nearly what a magnet flux does; the flux is the likelier one of the two.
    assert (
        "magnet_flux" in told and {"inductance_q", "saturation"} & told and emrax_entry["sets"][0]["probability"] > 0.5
    )
    # A saturation beside the q inductance gains as much as its freedom costs.
    assert all(entry.get("log_odds", -1.0) < 1.0 for entry in emrax_entry["if_added"].values())
    assert not {"resistance", "inductance_d", "iron_loss", "emf_harmonics"} & set(emrax_entry["effects"])
    assert len(emrax_entry["cannot_tell"]) > 4


@pytest.mark.study
def test_emrax_improved_drive_in_closed_loop(emrax_entry):
    before, after = (emrax_entry["closed_loop_rms"][f"rms_{k}"] for k in ("before", "after"))
    assert all(after[u] < 0.4 * before[u] for u in ("u_d_ref", "u_q_ref"))


def test_laas_identified_parameters(laas_entry):
    there = laas_entry["there"]
    assert 300 * 0.9 < 60 / (2 * 3.14159265 * 3**0.5 * there["emf_constant_vs_per_rad"][0]) < 300 * 1.1
    assert max(there["cogging_a_of_order"], key=there["cogging_a_of_order"].get) == "72"
    late = there["speed_is_late_by_s"]
    assert late["from_the_voltage"][0] == pytest.approx(late["from_the_angle"][0], rel=0.3)
    assert laas_entry["held_out"]["q"]["after"] < 0.5 * laas_entry["held_out"]["q"]["before"]


def test_laas_unidentifiable_parameters(laas_entry):
    assert not {"dead_time", "current_offset", "inductance_q", "encoder_offset"} & set(laas_entry["effects"])
    text = " ".join(laas_entry["cannot_tell"])
    assert all(word in text for word in ("d axis", "L_q", "Inverter loss", "Offset", "Vsupply", "torque constant"))


@pytest.mark.study
@pytest.mark.timeout(600)
def test_brusa_map_within_two_percent(tmp_path):
    entry = run(brusa, tmp_path)
    assert entry["verdict"] == "explained" and set(entry["effects"]) == {"saturation", "cross_saturation"}
    errors = entry["flux_map"]["covered grid of the measured map"]
    assert errors["points"] > 0.9 * errors["of"]
    assert errors["d"]["max"] < 0.02 and errors["q"]["max"] < 0.02
    for axis in "dq":
        assert entry["held_out"][axis]["after"] < 0.2 * entry["held_out"][axis]["before"]


def test_absent_recordings_are_reported_without_failure(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("FLUXPROOF_RECORDINGS", str(tmp_path / "none"))
    assert main(["--out", str(tmp_path), "--quiet"]) == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert all("skipped" in entry for entry in result["recordings"].values()) and len(result["recordings"]) == 3
    assert result["cases"] == [] and sum(result["counts"].values()) == 0
