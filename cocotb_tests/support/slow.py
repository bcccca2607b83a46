# SPDX-License-Identifier: BSD-3-Clause
"""Cases that `make slow` looks at and `make test` leaves out."""

import pytest


def slowly(*case):
    """A case of a parametrised test that only `make slow` runs."""
    return pytest.param(*case, marks=pytest.mark.slow)


def halved(cases, every=2) -> list:
    """The cases, all but every second one (or one of ``every``) only for `make slow`."""
    return [slowly(case) if k % every else case for k, case in enumerate(cases)]
