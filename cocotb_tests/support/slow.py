"""Cases that `make slow` looks at and `make test` leaves out."""

import pytest


def slowly(*case):
    """A case of a parametrised test that only `make slow` runs."""
    return pytest.param(*case, marks=pytest.mark.slow)


def halved(cases) -> list:
    """The cases, every second one only for `make slow`."""
    return [slowly(case) if k % 2 else case for k, case in enumerate(cases)]
