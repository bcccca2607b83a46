"""The marginal likelihood of a set of effects (inference/evidence.py)."""

import numpy as np
import pytest

from fluxproof.diagnosis.inference.evidence import evidence

ROWS, NOISE = 60, 0.01


def value_of(y, doubt, x=None):
    """Log evidence of rows y with the errors ``doubt`` of curves and, if x is given, one effect with this column."""
    columns = np.zeros((len(y), 0)) if x is None else x[:, None]
    k = columns.shape[1]
    return evidence(
        columns, y, np.full(len(y), NOISE**2), np.full(len(y), 1e-4), doubt, np.zeros(len(y), np.int64), 1, -1, 0.0,
        np.ones(k), np.zeros(k, np.int64), np.ones(k, bool), np.full(k, 100.0), 0.01, 3.0, 1.0, np.inf,
    )  # fmt: skip


def test_a_curve_may_be_wrong_without_being_so():
    """Errors that are possible and not there neither cost evidence nor could be saved by a smaller effect."""
    y = NOISE * np.random.default_rng(1).standard_normal(ROWS)
    none, large, larger = (value_of(y, np.full(ROWS, w)) for w in (0.0, 0.3, 0.6))
    assert large[0] == pytest.approx(none[0]) == larger[0]
    assert none[-1].tolist() == [1.0] and large[-1].tolist() == [0.0] == larger[-1].tolist()


def test_a_curve_that_is_wrong_explains_what_is_left():
    """The share of the possible errors that is seen is learnt, so that they are no evidence for another effect."""
    rng = np.random.default_rng(2)
    doubt = np.where(np.arange(ROWS) % 3 == 0, 1.0, 0.0)  # at some operating points only
    y = NOISE * rng.standard_normal(ROWS) + 0.2 * doubt * rng.standard_normal(ROWS)
    without, with_it = value_of(y, np.zeros(ROWS)), value_of(y, doubt)
    assert with_it[0] > without[0] + 50.0 and 0.1 <= with_it[-1][0] <= 0.4


def test_an_effect_is_found_beside_errors_of_a_curve():
    rng = np.random.default_rng(3)
    x, doubt = np.linspace(-1.0, 1.0, ROWS), np.full(ROWS, 0.3)
    y = 5.0 * x + NOISE * rng.standard_normal(ROWS)
    found = value_of(y, doubt, x)
    assert found[0] > value_of(y, doubt)[0] + 50.0 and found[1][0] == pytest.approx(5.0, rel=0.01)
