# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof diagnose --example`: its own recording, every hidden difference named, its size beside the truth."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from fluxproof.command import main
from fluxproof.diagnosis.example import motor, recording, truth
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.loading.load import load_recording
from golden_model import drive as drives


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """(folder, what the command printed)."""
    out = tmp_path_factory.mktemp("example") / "out"
    with pytest.MonkeyPatch.context() as patch:
        printed = []
        patch.setattr("builtins.print", lambda *words, **_: printed.append(" ".join(map(str, words))))
        assert main(["diagnose", "--example", "--out", str(out), "--quiet"]) == 0
    return out, printed


@pytest.fixture(scope="module")
def answer(made):
    return json.loads((made[0] / "diagnosis.json").read_text())


def test_every_hidden_difference_is_named_with_its_size(answer):
    rows, others = truth.compare(answer["effects"])
    assert answer["verdict"] == "explained" and others == []
    assert [row.hidden.effect for row in rows] == ["dead_time", "magnet_flux", "encoder_offset"]
    assert max(row.deviation for row in rows) < 3.0
    for (
        row
    ) in rows:  # a wide interval would hold the truth too; a resistance may take a part of the dead time's voltage
        assert row.sigma < (0.2 if row.hidden.effect == "dead_time" else 0.06) * abs(row.hidden.value)
    fit = answer["fit"]
    assert fit["holdout_before"] > 10.0 and fit["holdout_after"] < 2.0 * fit["noise_floor"] < 1.0


def test_the_controller_is_equal_in_every_bit(answer, made):
    samples = len(motor.PLAN) * (motor.RAMP + motor.DWELL)
    assert answer["digital"] == {"checked": True, "samples": samples, "first_difference": None}
    assert f"controller: {samples} samples equal to the golden model in every bit" in made[1]


def test_the_truth_and_the_ordinary_command_are_printed(made):
    out, printed = made
    at = printed.index("hidden from the drive file:")
    assert "true 0.1518 Wb" in printed[at + 2] and "magnets -8 %" in printed[at + 2]
    assert all("found" in line and "off" in line for line in printed[at + 1 : at + 4])
    assert printed[-1].endswith(f"fluxproof diagnose {out / 'example.fluxdump'} --drive {out / 'drive.toml'}")


def test_the_currents_conceal_it(made):
    """At the end of every operating point the currents are on their references, within 2 % of their limit."""
    seen = load_recording(made[0] / recording.RECORDING, load_nominal(made[0] / recording.DRIVE))
    drive = drives.load(motor.DRIVE_FILE)
    end = np.arange(len(seen)).reshape(len(motor.PLAN), -1)[:, -100:]
    for name, column in (("i_d", 1), ("i_q", 2)):
        wanted = np.array(motor.PLAN)[:, column]
        current = seen.meta["observed"][name] * seen.meta["scales"][name]
        assert np.abs(current[end].mean(axis=1) - wanted).max() < 0.02 * drive.current_limit_a


def test_the_drive_file_is_that_of_the_paper():
    assert drives.load(motor.DRIVE_FILE) == drives.load(DRIVES / "paper001.toml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--example", "log.csv"], "a recording and a drive file of its own: leave out RECORDING log.csv"),
        (["--example", "--drive", "d.toml"], "leave out --drive d.toml"),
        ([], "required: RECORDING, --drive drive.toml (or --example"),
        (["log.csv"], "required: --drive drive.toml (or"),
        (["--drive", "d.toml"], "required: RECORDING (or --example"),
    ],
)
def test_what_is_missing_or_too_much(arguments, words, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["diagnose", *arguments])
    assert ended.value.code == 2 and words in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize("name", [recording.RECORDING, recording.DRIVE])
def test_a_file_of_the_user_stays(name, tmp_path, capsys):
    (tmp_path / name).write_text("mine")
    assert main(["diagnose", "--example", "--out", str(tmp_path), "--quiet"]) == 2
    assert "choose another folder" in capsys.readouterr().err
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(name, "mine")]


def test_truth_beside_wrong_answers():
    """A size ten standard deviations off, an effect that was not named, and one that is not there."""
    drive = drives.load(motor.DRIVE_FILE)
    flux = next(secret for secret in motor.hidden(drive) if secret.effect == "magnet_flux")
    found = {"value": 1.1 * flux.value, "sigma": 0.01 * flux.value, "unit": "Wb"}
    effects = [{"name": "magnet_flux", "parameters": {"magnet_flux_wb": found}}, {"name": "friction", "parameters": {}}]
    lines = truth.lines(effects)
    assert any("magnets" in line and "10.0 σ off" in line for line in lines)
    assert sum("not found" in line for line in lines) == 2 and lines[-1] == "  friction: asserted, but not there"
