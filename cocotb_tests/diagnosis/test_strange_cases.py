"""Cases of a generator that does not know the catalogue, which once were answered wrongly."""

import pytest

from fluxproof.diagnosis.session import diagnose
from studies.blind.generate import generate_case, listing

SEED, COUNT = 25112032, 60


def answer_to(number, tmp_path):
    number, stratum, turn = listing(SEED, COUNT, None, "sealed")[number - 1]
    entry = generate_case(("sealed", SEED, number, stratum, turn, tmp_path))
    folder = tmp_path / entry["case"]
    return diagnose(folder / entry["recording"], folder / "drive.toml")


@pytest.mark.parametrize(
    ("number", "names"),
    [
        (48, {"delay"}),  # a sampling skew beside it fitted better, but not the points that were not fitted
        (31, set()),  # healthy: the encoder's codes beat with the sampling near the first order
    ],
)
def test_nothing_absent_is_named(number, names, tmp_path):
    answer = answer_to(number, tmp_path)
    assert {e.name for e in answer.effects} == names
    assert answer.verdict == ("explained" if names else "no_mismatch")
