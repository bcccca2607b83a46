# SPDX-License-Identifier: BSD-3-Clause
"""What all tests share: figures of a study, which `make board` collects; all tests before any is deselected."""

import json
import signal
from pathlib import Path

import pytest

pytest.register_assert_rewrite("cocotb_tests.support")  # else a failing assert there shows no values
COLLECTED = pytest.StashKey[list]()


def pytest_configure():
    # Behind `&` in a script Ctrl-C is ignored, also by every program that the tests start and stop with it.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    config.stash[COLLECTED] = list(items)  # -k and -m have not taken any out yet


@pytest.fixture
def all_tests(request) -> list[pytest.Item]:
    """Every test there is, also those that -k and -m leave out; skips where only some files were collected."""
    here, folder = Path(__file__).parent, request.config.invocation_params.dir
    if not {(folder / part).resolve() for part in request.config.args} & {here, here.parent}:
        pytest.skip("needs all of cocotb_tests collected (no path on the command line)")
    return request.config.stash[COLLECTED]


@pytest.fixture
def figure(record_property):
    """figure(name, ours, target, unit, passed): a line of the study's table; the test itself still asserts.

    passed: None for a figure without a target, which is there for comparison.
    """

    def record(name: str, ours, target, unit: str, passed: bool) -> None:
        row = {"figure": name, "ours": ours, "target": target, "unit": unit, "pass": passed is None or bool(passed)}
        record_property("figure", json.dumps(row))

    return record
