# SPDX-License-Identifier: BSD-3-Clause
"""Quantities in text: engineering units and rounding."""

from __future__ import annotations

import pytest

from fluxproof.diagnosis.ground.quantities import ascii_of, measured


@pytest.mark.parametrize("sigma, text", [(0.1, "5.09 +- 0.10 V"), (0.23, "5.1 +- 0.2 V"), (0.0, "5.087 V")])
def test_error_has_one_digit_or_two(sigma, text):
    assert ascii_of(measured(5.0873, sigma, "V", digits=1)) == text
