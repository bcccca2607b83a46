# SPDX-License-Identifier: BSD-3-Clause
"""What all tests share: figures of a study, which `make board` collects."""

import json
import signal

import pytest


def pytest_configure():
    # Behind `&` in a script Ctrl-C is ignored, also by every program that the tests start and stop with it.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def figure(record_property):
    """figure(name, ours, target, unit, passed): a line of the study's table; the test itself still asserts.

    passed: None for a figure without a target, which is there for comparison.
    """

    def record(name: str, ours, target, unit: str, passed: bool) -> None:
        row = {"figure": name, "ours": ours, "target": target, "unit": unit, "pass": passed is None or bool(passed)}
        record_property("figure", json.dumps(row))

    return record
