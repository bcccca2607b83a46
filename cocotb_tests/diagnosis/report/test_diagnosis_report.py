# SPDX-License-Identifier: BSD-3-Clause
"""Outputs of `fluxproof diagnose`: diagnosis.json against its schema, and the contents of report.html."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.samples import DEAD_TIME, HOSTILE, UNKNOWN, evidence, html_of, made_up, write_all
from cocotb_tests.support.diagnoses.schema import failures, schema
from fluxproof.diagnosis.ground import result
from fluxproof.diagnosis.ground.result import Estimate, Evidence
from fluxproof.diagnosis.report import words, write_outputs
from fluxproof.diagnosis.report.overlay import thinned


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """{verdict: folder with both files}."""
    return write_all(tmp_path_factory.mktemp("out"))


def json_of(folder) -> dict:
    return json.loads((folder / "diagnosis.json").read_text(), parse_constant=pytest.fail)


def test_conventions_are_a_table_with_their_rivals(tmp_path):
    told = result.Convention("currents_rms", "i", 0.7071, "the currents are <rms> values", ["currents_half"])
    answer = dataclasses.replace(made_up()["explained"], conventions=[told])
    write_outputs(answer, tmp_path)
    html = html_of(tmp_path)
    assert 'id="conventions"' in html and "&lt;rms&gt;" in html and "currents_half" in html and "0.7071" in html
    assert json_of(tmp_path)["conventions"][0]["code"] == "currents_rms" and not failures(json_of(tmp_path))


def test_schema_is_one_and_describes_every_field():
    pytest.importorskip("jsonschema").Draft202012Validator.check_schema(schema())

    def undescribed(node, path=""):
        for name, field in node.get("properties", {}).items():
            if "description" not in field and "$ref" not in field:
                yield f"{path}.{name}"
            yield from undescribed(field, f"{path}.{name}")
            yield from undescribed(field.get("items", {}), f"{path}.{name}[]")

    nodes = [schema(), *schema()["$defs"].values()]
    assert [path for node in nodes for path in undescribed(node)] == []


@pytest.mark.parametrize("verdict", result.VERDICTS)
def test_json_follows_the_schema(written, verdict):
    data = json_of(written[verdict])
    assert failures(data) == []
    assert data["verdict"] == verdict and data["recording"]["rows"] == 200000


@pytest.mark.parametrize(
    "path, value",
    [
        (("verdict",), "perhaps"),
        (("effects",), []),
        (("effects", 0, "confidence"), 1.01),
        (("effects", 0, "parameters", "v_dead_v", "value"), None),
        (("effects", 0, "plant"), {"resistance": 1.0}),
        (("location", "regions", 0, "variable"), "colour"),
        (("fit", "holdout_after"), "0.1"),
        (("recording", "problems", 0, "row"), 1.5),
        (("mood",), "good"),
    ],
)
def test_schema_rejects(written, path, value):
    data = json_of(written["explained"])
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert failures(data) != []


def test_nonfinite_values_become_null_or_are_rejected(written, tmp_path):
    data = json_of(written["explained"])
    assert data["effects"][1]["parameters"]["knee_a"]["sigma"] is None
    assert data["location"]["regions"][1]["low"] is None
    assert data["effects"][1]["plant"]["machine.flux_map"]["i_d_a"] == [-6, -4, -2, 0]
    lost = replace(DEAD_TIME, parameters={"v_dead_v": Estimate(math.nan, 0.1, "V")})
    with pytest.raises(ValueError, match=r"effects\[0\]\.parameters\.v_dead_v\.value is nan"):
        write_outputs(replace(made_up()["explained"], effects=[lost]), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_page_contains_the_result(written):
    page = html_of(written["explained"])
    for said in ("0.901 ± 0.011 V", "&gt; 99 %", "−0.410 ± 0.020 mH", "= 2.01°", "by a factor of 10",
                 "order 6 with 0.225 V", "0.01581", "drive_improved.toml", "equal in every bit",
                 "three samples are missing", "no torque"):  # fmt: skip
        assert said in page, said
    page = html_of(written["ambiguous"])
    for said in ("Not separable", "314 rad/s (749.6 rpm)", "winding at 80 °C", "an offset stays on d"):
        assert said in page, said
    assert "c * omega_e * abs(i_q) * cos(2*theta_e)" in html_of(written["unexplained"])
    assert "1.02 times the noise floor" in html_of(written["no_mismatch"])
    assert re.search(r"<td[^>]*>golden</td><td><code>0x0124", html_of(written["digital_mismatch"]))
    page = html_of(written["bad_recording"])
    assert page.index("current_sum") < page.index("clipped") and "Improvement" not in page


def test_page_escapes_text_from_files(written, tmp_path):
    page = html_of(written["explained"])
    assert "<script" not in page and "<img" not in page and "&lt;script&gt;" in page
    diagnosis = replace(
        made_up()["unexplained"],
        sentence=HOSTILE,
        notes=[HOSTILE],
        unknown_term=replace(UNKNOWN, formula=HOSTILE),
    )
    data = {"t": np.arange(9.0), "recorded": {HOSTILE: np.arange(9.0)}}
    page = html_of(write_outputs(diagnosis, tmp_path, overlay=data)[0].parent)
    assert "<script" not in page and "<img" not in page and 'id="overlay"' in page


@pytest.mark.parametrize(
    "without, picture, said",
    [
        ({"theta_e"}, "angle_current", "misfit over angle and current: theta_e is missing"),
        ({"orders"}, "orders", "harmonic orders: orders is missing"),
        ({"t"}, "over_time", "misfit over time: t is missing"),
    ],
)
def test_omitted_picture_is_reported(tmp_path, without, picture, said):
    arrays = evidence().arrays
    diagnosis = replace(
        made_up()["explained"], evidence=Evidence({k: v for k, v in arrays.items() if k not in without})
    )
    page = html_of(write_outputs(diagnosis, tmp_path)[0].parent)
    assert said in page and f'id="{picture}"' not in page and 'id="speed_current"' in page


def test_one_operating_point_has_no_map(tmp_path):
    arrays = evidence().arrays
    arrays |= {name: np.full_like(arrays[name], 3.0) for name in ("omega_e", "i_d", "i_q")}
    page = html_of(write_outputs(replace(made_up()["explained"], evidence=Evidence(arrays)), tmp_path)[0].parent)
    assert "misfit over speed and current: speed or current does not vary" in page and 'id="over_time"' in page


def test_nonfinite_block_is_ignored(tmp_path):
    arrays = evidence().arrays
    arrays["before_d"][7] = np.nan
    page = html_of(write_outputs(replace(made_up()["explained"], evidence=Evidence(arrays)), tmp_path)[0].parent)
    assert 'id="over_time"' in page and "nan" not in page.lower()


def test_thinning_keeps_peaks():
    values = np.zeros(100_003)
    values[77_777], values[12_345] = 5.0, -3.0
    t, thin = thinned(np.arange(len(values)) * 1e-4, values)
    assert len(t) == len(thin) <= 700 and thin.max() == 5.0 and thin.min() == -3.0
    assert t[thin.argmax()] == pytest.approx(7.7777, abs=0.04)


@pytest.mark.parametrize(
    "value, sigma, unit, expected",
    [
        (0.9, 0.01, "V", "0.900 ± 0.010 V"),
        (0.01607, 0.00012, "H", "16.07 ± 0.12 mH"),
        (-1.234567e-6, 2e-9, "s", "−1.2346 ± 0.0020 µs"),
        (1234.0, 250.0, "ohm", "1230 ± 250 Ω"),
        (0.0, 0.3, "A", "0.00 ± 0.30 A"),
        (1.02, math.nan, "1", "102 % (uncertainty unknown)"),
        (math.pi, 0.1, "rad", "3.14 ± 0.10 rad = 180°"),
    ],
)
def test_measured(value, sigma, unit, expected):
    assert words.measured(value, sigma, unit) == expected


def test_no_partial_files_remain(written):
    assert {p.name for folder in written.values() for p in folder.iterdir()} == {
        "diagnosis.json",
        "report.html",
    }
