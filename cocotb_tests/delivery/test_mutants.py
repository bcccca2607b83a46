"""Every planted defect occurs once in the RTL and changes it; `make mutate` checks that the tests detect it."""

from __future__ import annotations

import pytest

from fluxproof.checkout import RTL
from scripts.mutants import MUTANTS


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda m: m[0].replace(" ", "_"))
def test_text_of_a_planted_defect_occurs_once(mutant):
    _, file, old, new = mutant
    assert (RTL / file).read_text().count(old) == 1
    assert old != new
