# SPDX-License-Identifier: BSD-3-Clause
"""fleet.html in headless Chromium, with every part it can have, and hostile names."""

from __future__ import annotations

import datetime

import numpy as np
import pytest

from cocotb_tests.support.browser import seen
from cocotb_tests.support.diagnoses.samples import HOSTILE
from cocotb_tests.support.fleet.rows import ageing, flux, hypothesis, row
from fluxproof.diagnosis.fleet.findings import findings
from fluxproof.fleet.page import headline, render

START = datetime.datetime(2026, 1, 1, tzinfo=datetime.timezone.utc)


@pytest.fixture(scope="module")
def found():
    """A fleet with an outlier of each kind, a drift, a group and a recording that failed."""
    rng = np.random.default_rng(0)
    rows = [row(n, [hypothesis(values=flux(0.1 + 0.002 * rng.standard_normal()))]) for n in range(40)]
    rows[3] = row(3, [hypothesis(["dead_time"], 50.0, flux(0.1))], serial=HOSTILE)
    rows[4] = row(4, [hypothesis(values=flux(0.07))])
    for n in range(10, 15):
        rows[n] = row(n, [hypothesis(left=[("u_dq", -2.0, 1.5, 0.6)], share=0.6)], verdict="unexplained")
        rows[n]["unknown"] = {"meaning": "", "formula": HOSTILE}
    rows += [row(100 + k, [hypothesis(values=flux(x, s))], t, "old") for k, (t, x, s) in enumerate(ageing(0.02))]
    failed = {**row(200, []), "status": "failed", "reason": f"{HOSTILE}: not a file", "verdict": "bad_recording"}
    return findings([*rows, failed])


def test_in_a_browser(found, tmp_path):
    saw, log = seen(render(found), tmp_path)
    assert log == "" and saw["first"] == headline(found)
    assert "2 drives differ from the rest, 1 drifts, 1 group shares an unexplained residual, 1 rec" in saw["first"]
    assert saw["width"] == pytest.approx(400, abs=20) and saw["overflow"] <= 0 and saw["cut"] == 0
    assert len(saw["pictures"]) == 4 and all(size > 70 for size in saw["pictures"])
    assert saw["fetched"] == [] and saw["scripts"] == 0
    assert all(link.startswith("reports/") and link.endswith("/report.html") for link in saw["links"])
    assert len(saw["links"]) >= 90 and saw["title"] == "Fluxproof fleet: 91 recordings"


def test_nothing_to_tell(tmp_path):
    rows = [row(n, [hypothesis(values=flux(0.1 + 1e-4 * n))], verdict="no_mismatch") for n in range(10)]
    page = render(findings(rows))
    assert "10 recordings of 10 drives: no drive differs." in page and "None, at a share of false ones" in page
    failed = {**row(0, []), "status": "failed", "reason": "not a file", "verdict": "bad_recording"}
    said = "1 recording could not be used."
    assert headline(findings([failed])) == f"1 recording of 1 drive: {said}"
    other = {**failed, "serial": "another"}
    assert headline(findings([*rows, other])) == f"11 recordings of 11 drives: {said}"
    assert (
        headline(findings([*rows, failed])) == f"11 recordings of 10 drives: {said}"
    )  # the drive has another, sound one
