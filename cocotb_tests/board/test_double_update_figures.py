# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the double update for `make board`: RTL against golden model, bandwidth and phase margin."""

import pytest

from studies.board import double_update


@pytest.mark.study
def test_figures_of_the_double_update(figure):
    rows = double_update.rows()
    for row in rows:
        figure(*(row[key] for key in ("figure", "ours", "target", "unit", "pass")))
    missed = [row for row in rows if row["pass"] is False]  # None: without a target, for comparison
    assert not missed, missed
