"""Cases of a generator that does not know the catalogue, which once were answered wrongly."""

import numpy as np
import pytest

from fluxproof.diagnosis.balance.cells import noise
from fluxproof.diagnosis.ingest.load import load_recording
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.physics import rows_of
from fluxproof.diagnosis.session import diagnose
from studies.blind.generate import generate_case, listing

SEED, LATER, COUNT = 25112032, 26112026, 60


def files_of(number, tmp_path, seed=SEED):
    """Recording and drive file of a case."""
    number, stratum, turn = listing(seed, COUNT, None, "sealed")[number - 1]
    entry = generate_case(("sealed", seed, number, stratum, turn, tmp_path))
    folder = tmp_path / entry["case"]
    return folder / entry["recording"], folder / "drive.toml"


@pytest.mark.parametrize(
    ("seed", "number", "names"),
    [
        (SEED, 48, {"delay"}),  # a sampling skew beside it fitted better, but not the points that were not fitted
        (SEED, 31, set()),  # healthy: the encoder's codes beat with the sampling near the first order
        (LATER, 9, {"iron_loss", "resistance"}),  # eddy currents that lag looked like a delay
        (LATER, 59, {"current_gain", "friction", "iron_loss"}),  # and like a sampling skew
        (LATER, 54, {"inductance_d", "resistance_temperature"}),  # codes that beat looked like a swing of the voltage
        (SEED, 10, {"dead_time", "saturation"}),  # a twisting shaft as alternative, which does not help
    ],
)
def test_exactly_what_is_there_is_named(seed, number, names, tmp_path):
    answer = diagnose(*files_of(number, tmp_path, seed))
    assert {e.name for e in answer.effects} == names
    assert answer.verdict == ("explained" if names else "no_mismatch")


def test_the_noise_is_at_most_that_of_the_misfit(tmp_path):
    recording, drive = files_of(31, tmp_path)
    nominal = load_nominal(drive)
    rows, _ = rows_of([load_recording(recording, nominal)], nominal)
    assert np.all(rows.noise <= noise(rows.view, rows.cells, rows.cells.y) * 1.000001)


@pytest.mark.parametrize(
    ("seed", "number", "says"),
    [(SEED, 12, "bent towards full scale"), (LATER, 28, "bent towards full scale"), (LATER, 27, "soft shaft")],
)
def test_what_no_parameter_carries_is_told(seed, number, says, tmp_path):
    """Two effects of the catalogue together looked like each of them."""
    answer = diagnose(*files_of(number, tmp_path, seed))
    assert answer.verdict == "unexplained" and not answer.effects and says in answer.sentence
    assert answer.explained_share in (0.0, None) and max(r.share for r in answer.remainder) <= 1.0
