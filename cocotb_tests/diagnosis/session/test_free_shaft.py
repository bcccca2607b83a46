# SPDX-License-Identifier: BSD-3-Clause
"""A free shaft behind a speed loop."""

import pytest

from cocotb_tests.support.recordings.blind_cases import files_of
from cocotb_tests.support.slow import slowly
from fluxproof.diagnosis.session import work


@pytest.mark.parametrize(
    ("seed", "count", "number", "kind", "names"),
    [
        slowly(26112026, 80, 6, "free", {"cogging"}),
        (27112026, 100, 34, "loaded", {"cogging", "magnet_flux"}),  # the transducer measures the load only
    ],
)
def test_cogging_that_the_speed_loop_conceals_is_named(seed, count, number, kind, names, tmp_path):
    """Only slow blocks show it; they were given the noise of the fast ones."""
    recording, drive = files_of(number, tmp_path, seed, "own", count)
    worked = work(recording, drive)
    answer = worked.answer()
    assert {e.name for e in answer.effects} == names and answer.verdict == "explained"
    assert set(worked.decision.basis.view.shaft) == {kind}
