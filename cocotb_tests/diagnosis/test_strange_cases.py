"""Cases of a generator that does not know the catalogue, which once were answered wrongly."""

import numpy as np
import pytest

from fluxproof.diagnosis.balance.cells import noise
from fluxproof.diagnosis.ingest.load import load_recording
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.physics import rows_of
from fluxproof.diagnosis.session import diagnose
from studies.blind.generate import generate_case, listing

SEED, COUNT = 25112032, 60


def files_of(number, tmp_path):
    """Recording and drive file of a case."""
    number, stratum, turn = listing(SEED, COUNT, None, "sealed")[number - 1]
    entry = generate_case(("sealed", SEED, number, stratum, turn, tmp_path))
    folder = tmp_path / entry["case"]
    return folder / entry["recording"], folder / "drive.toml"


@pytest.mark.parametrize(
    ("number", "names"),
    [
        (48, {"delay"}),  # a sampling skew beside it fitted better, but not the points that were not fitted
        (31, set()),  # healthy: the encoder's codes beat with the sampling near the first order
    ],
)
def test_nothing_absent_is_named(number, names, tmp_path):
    answer = diagnose(*files_of(number, tmp_path))
    assert {e.name for e in answer.effects} == names
    assert answer.verdict == ("explained" if names else "no_mismatch")


def test_the_noise_is_at_most_that_of_the_misfit(tmp_path):
    recording, drive = files_of(31, tmp_path)
    nominal = load_nominal(drive)
    rows, _ = rows_of([load_recording(recording, nominal)], nominal)
    assert np.all(rows.noise <= noise(rows.view, rows.cells, rows.cells.y) * 1.000001)
