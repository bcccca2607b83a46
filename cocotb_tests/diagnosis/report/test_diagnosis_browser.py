# SPDX-License-Identifier: BSD-3-Clause
"""report.html in headless Chromium: the layout on a phone, in light and dark.

The unchanged page is in a frame of 400 px with its own Content-Security-Policy; a script outside the frame inspects it
and writes the result into the dumped DOM.
"""

from __future__ import annotations

import pytest

from cocotb_tests.support.browser import seen
from cocotb_tests.support.diagnoses.samples import html_of, made_up, write_all
from fluxproof.diagnosis.ground import result


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """{verdict: folder with both files}."""
    return write_all(tmp_path_factory.mktemp("out"))


@pytest.mark.parametrize("verdict", result.VERDICTS)
def test_in_a_browser(written, tmp_path, verdict):
    """On a phone of 400 px: the sentence first, nothing wider than the screen, all pictures, nothing loaded."""
    saw, log = seen(html_of(written[verdict]), tmp_path)
    assert log == ""
    assert saw["first"] == made_up()[verdict].sentence
    assert saw["width"] == pytest.approx(400, abs=20) and saw["overflow"] <= 0 and saw["cut"] == 0
    pictures = {"explained": 7, "partly_explained": 6, "ambiguous": 6, "unexplained": 5, "no_mismatch": 5}
    assert len(saw["pictures"]) == pictures.get(verdict, 0) and all(size > 70 for size in saw["pictures"])
    # Two maps and a colour scale in two pictures; without an explanation there is one map in each.
    rasters = {"explained": 6, "partly_explained": 6, "ambiguous": 6, "unexplained": 4, "no_mismatch": 4}
    assert len(saw["rasters"]) == rasters.get(verdict, 0)
    assert all(wide > 0 for wide in saw["rasters"])
    assert saw["links"] == saw["fetched"] == [] and saw["scripts"] == 0
    assert saw["title"] == f"Fluxproof diagnosis: {verdict.replace('_', ' ')}"


def test_in_a_dark_browser(written, tmp_path):
    light, _ = seen(html_of(written["explained"]), tmp_path, "--blink-settings=preferredColorScheme=1")
    dark, log = seen(html_of(written["explained"]), tmp_path, "--blink-settings=preferredColorScheme=0")
    assert light["ink"] == "rgb(29, 33, 39)" and dark["ink"] == "rgb(230, 233, 237)" and log == ""


def test_probe_detects_defects_of_the_page(written, tmp_path):
    """The same probe on a page with an external picture, a broken one, a script and a line that is too wide."""
    wrong = """<p style="width: 900px">wide</p><img src="http://127.0.0.1:9/x.png"><script>0</script>
    <img src="data:image/png;base64,AAAA">"""
    saw, log = seen(html_of(written["bad_recording"]).replace("<body>", "<body>" + wrong), tmp_path)
    assert saw["first"] == "wide" and saw["overflow"] > 300 and saw["cut"] > 0
    assert saw["rasters"] == [0, 0] and "http://127.0.0.1:9/x.png" in saw["links"] and saw["scripts"] == 1
    assert "Content Security Policy" in log
