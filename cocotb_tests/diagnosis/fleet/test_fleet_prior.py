# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof diagnose --prior`: the population is told, and it makes no faulty drive of a healthy one."""

from __future__ import annotations

import copy
import json

import jsonschema
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cocotb_tests.support.fleet import small_fleet
from fluxproof.checkout import ROOT
from fluxproof.command import main
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.fleet.prior import design_of, load_prior, placed
from fluxproof.diagnosis.fleet.row import row_of
from fluxproof.diagnosis.fleet.schema import schema
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.report.write import json_ready
from fluxproof.diagnosis.session import work
from studies.blind.generate import write_recording
from studies.fleet import drives

FAULTY = ("dead_time", "iron_loss", "current_gain", "encoder_offset", "saturation", "cross_saturation")


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """(folder with drive.toml, the recording of a drive exactly as described, its answer without a prior)."""
    folder = tmp_path_factory.mktemp("prior")
    nominal = drives.design_of(small_fleet.SEED)
    (folder / "drive.toml").write_text(nominal.toml())
    exact = drives.healthy(nominal, small_fleet.SEED, 0, small_fleet.ROWS)
    m = nominal.machine
    exact.build.change("motor", **dict.fromkeys(("r_a", "r_b", "r_c"), m["resistance_ohm"]))
    exact.build.change("motor", l_d=m["inductance_d_h"], l_q=m["inductance_q_h"], psi_m=m["magnet_flux_wb"])
    path = write_recording(folder / "exact", drives.record(exact, small_fleet.SEED, 0), "parquet")
    return folder, path, work(path, folder / "drive.toml")


def population_of(folder, alone, change, name) -> str:
    """A fleet.parquet of 30 drives, each the row of an answer after ``change(row, n)``."""
    rows = []
    for n in range(30):
        row = copy.deepcopy(row_of(alone.answer(), alone.decision.posterior))
        change(row, n)
        head = dict(recording=f"r{n:02d}", drive="drive.toml", serial=f"S{n:02d}", status="done", key=f"{n}", more=[])
        rows.append({**row, **head, "design": design_of(folder / "drive.toml"), "version": "1"})
    pq.write_table(pa.Table.from_pylist(rows, schema()), folder / name)
    return str(folder / name)


def faulty(row, n):
    """All drives of the fleet have six effects, 20 % more resistance and 10 % less flux, and surely so."""
    row["names"] = [{"effect": e, "confidence": 0.999, "explains": 0.5} for e in ("resistance", "magnet_flux")]
    (row["hypotheses"][0]["extras"], row["hypotheses"][0]["credible"]) = list(FAULTY), [1.0] * len(FAULTY)
    del row["hypotheses"][1:]
    spread = np.random.default_rng(n).standard_normal(2)
    for e in row["hypotheses"][0]["estimates"]:
        e["value"] *= {"resistance_ohm": 1.2 + 0.01 * spread[0], "magnet_flux_wb": 0.9 + 0.01 * spread[1]}.get(
            e["parameter"], 1.0
        )


@pytest.mark.slow
def test_a_fleet_of_faulty_drives_makes_no_faulty_one_of_a_healthy_drive(drive):
    folder, path, alone = drive
    assert alone.decision.verdict == "no_mismatch" and not alone.decision.effects
    fleet = population_of(folder, alone, faulty, "faulty.parquet")
    prior = load_prior(fleet, folder / "drive.toml")
    assert all(prior.rates[e] > 0.9 for e in (*FAULTY, "resistance"))  # the fleet is as one-sided as can be
    shifts = prior.shifts()
    assert all(shifts[e] == pytest.approx(np.log(19.0)) for e in FAULTY) and shifts["friction"] < -2.0
    answer = diagnose(path, folder / "drive.toml", prior=fleet)
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity
    assert "was the prior" in " ".join(answer.notes) and answer.prior.drives == 30
    found = {p.parameter: p for p in answer.prior.parameters}
    r = found["resistance_ohm"]
    assert r.z < -8.0 and r.shrunk == pytest.approx(r.value, rel=0.01)  # it is none of them, and is not made one


def test_the_odds_of_a_name_are_at_most_its_bayes_factor(drive, monkeypatch):
    """No prior odds above even ones: what a recording says by itself bounds each name.  Without the cap it does not."""
    folder, _, alone = drive
    prior = load_prior(population_of(folder, alone, faulty, "faulty.parquet"), folder / "drive.toml")
    odds = lambda: [np.log(0.05 / 0.95) + shift for shift in prior.shifts().values()]  # noqa: E731
    assert max(odds()) <= 1e-9
    monkeypatch.setattr("fluxproof.diagnosis.ground.constants.FLEET_EVEN", 0.999)
    assert max(odds()) > 2.0


def test_the_command_says_that_there_was_a_prior(drive, tmp_path, capsys):
    folder, path, alone = drive
    fleet = population_of(folder, alone, lambda row, n: None, "healthy.parquet")
    command = ["diagnose", str(path), "--drive", str(folder / "drive.toml"), "--out", str(tmp_path), "--quiet"]
    assert main([*command, "--prior", fleet]) == 0
    assert f"prior: 30 drives in {fleet}" in capsys.readouterr().out
    data = json.loads((tmp_path / "diagnosis.json").read_text())
    jsonschema.validate(json_ready(data), json.loads((ROOT / "docs" / "diagnosis.schema.json").read_text()))
    assert data["prior"]["drives"] == 30 and data["prior"]["parameters"]
    assert "Among the other drives" in (tmp_path / "report.html").read_text()


def test_another_drive_file_and_another_file_are_refused(drive, tmp_path):
    folder, path, alone = drive
    fleet = population_of(folder, alone, lambda row, n: None, "healthy.parquet")
    other = tmp_path / "drive.toml"
    other.write_text((folder / "drive.toml").read_text() + "\n# another design\n")
    with pytest.raises(RecordingError, match="no recording of the drive file"):
        load_prior(fleet, other)
    with pytest.raises(RecordingError, match="column 'recording' is missing; expected a fleet.parquet"):
        load_prior(path, folder / "drive.toml")
    with pytest.raises(RecordingError, match="not a readable Parquet file"):
        load_prior(folder / "drive.toml", folder / "drive.toml")


def test_a_value_is_shrunk_as_far_as_it_can_be_one_of_them(drive):
    from fluxproof.diagnosis.fleet.population import population

    rng = np.random.default_rng(0)
    x = 0.1 + 0.002 * rng.standard_normal(60)
    pop = population("magnet_flux", "magnet_flux_wb", "Wb", [str(n) for n in range(60)], x, [2e-4] * 60)
    near, far = placed(pop, 0.103, 0.002), placed(pop, 0.15, 0.002)
    assert near.shrunk == pytest.approx(0.1015, abs=4e-4) and near.shrunk_sigma < 0.0016
    assert far.shrunk == pytest.approx(0.15, abs=1e-3) and far.p < 1e-6
