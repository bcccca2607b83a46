# SPDX-License-Identifier: BSD-3-Clause
"""The blind benchmark's scorer on synthetic answers: every figure can be right and wrong."""

from __future__ import annotations

import json

import pandas as pd
import pytest

from studies.blind import figures
from studies.blind.page import page
from studies.blind.score import summary
from studies.blind.thinned import summary as thinned_summary
from studies.blind.thinned import thin, visible


def _truth(stratum="single", names=("resistance",), identifiable=True, form="catalogue", **more):
    effects = [{"name": n, "form": form, "size": 1.0, "parameters": {"resistance_ohm": 2.0}} for n in names]
    return {
        "case": "case_0001",
        "stratum": stratum,
        "effects": effects,
        "kind": "",
        "problem_codes": ["clip"],
        "identifiable": {"all": identifiable, "effects": dict.fromkeys(names, identifiable)},
        "rows": 1000,
        **more,
    }


def _answer(verdict="explained", names=("resistance",), ambiguity=(), value=2.0, sigma=0.01, ratio=1.0, problems=()):
    effects = [
        {
            "name": n,
            "confidence": 0.996,
            "parameters": {"resistance_ohm": {"value": value, "sigma": sigma, "unit": "ohm"}},
        }
        for n in names
    ]
    return {
        "verdict": verdict,
        "effects": effects,
        "ambiguity": [list(g) for g in ambiguity],
        "seconds": 1.0,
        "fit": {"holdout_after": ratio, "noise_floor": 1.0},
        "recording": {"problems": [{"code": p, "message": ""} for p in problems]},
    }


def _figure(name, *pairs, resolved=()):
    return figures.figures(list(pairs), list(resolved))[name]["value"]


@pytest.mark.parametrize(
    "name, right, wrong",
    [
        ("single_named_right", (_truth(), _answer()), (_truth(), _answer("ambiguous", ()))),
        ("single_named_right", (_truth(), _answer()), (_truth(), _answer(names=("resistance", "delay")))),
        (
            "pairs_exactly_right",
            (_truth("pair", ("delay", "cogging")), _answer(names=("cogging", "delay"))),
            (_truth("pair", ("delay", "cogging")), _answer(names=("cogging",))),
        ),
        (
            "triples_exactly_right",
            (_truth("triple", ("a", "b", "c")), _answer(names=("a", "b", "c"))),
            (_truth("triple", ("a", "b", "c")), _answer(names=("a", "b", "d"))),
        ),
        ("masked_named_right", (_truth("masked"), _answer()), (_truth("masked"), _answer("no_mismatch", ()))),
        (
            "unknown_recognised",
            (_truth("unknown", ()), _answer("unexplained", ())),
            (_truth("unknown", ()), _answer("no_mismatch", ())),
        ),
        (
            "damage_found",
            (_truth("damaged", ()), _answer("no_mismatch", (), problems=("clipped",))),
            (_truth("damaged", ()), _answer("no_mismatch", (), problems=("gap",))),
        ),
        (
            "damage_found",
            (_truth("damaged", ()), _answer("bad_recording", ())),
            (_truth("damaged", ()), _answer(problems=("clipped",))),
        ),
        (
            "truth_inside_ambiguity",
            (_truth(), _answer("ambiguous", (), [("delay", "resistance")])),
            (_truth(), _answer("ambiguous", (), [("delay", "cogging")])),
        ),
        (
            "not_identifiable_honest",
            (_truth(identifiable=False), _answer("no_mismatch", ())),
            (_truth(identifiable=False), _answer(names=("delay",))),
        ),
        ("coverage_95", (_truth(), _answer(value=2.015)), (_truth(), _answer(value=2.03))),
    ],
)
def test_a_rate_is_one_when_right_and_zero_when_wrong(name, right, wrong):
    assert _figure(name, right) == 1.0
    assert _figure(name, wrong) == 0.0
    assert _figure(name, right, wrong) == 0.5


@pytest.mark.parametrize(
    "name, right, wrong",
    [
        ("confidently_wrong", (_truth(), _answer("ambiguous")), (_truth(), _answer("ambiguous", ("delay",)))),
        (
            "confidently_wrong",
            (_truth("unknown", ()), _answer("unexplained", ())),
            (_truth("unknown", ()), _answer()),
        ),
        (
            "false_alarm_healthy",
            (_truth("healthy", ()), _answer("no_mismatch", ())),
            (_truth("healthy", ()), _answer("unexplained", ())),
        ),
        ("breakdowns", (_truth(), _answer()), (_truth(), {"error": "ValueError: x"})),
    ],
)
def test_a_fault_rate_is_zero_when_right_and_one_when_wrong(name, right, wrong):
    assert _figure(name, right) == 0.0
    assert _figure(name, wrong) == 1.0


def test_unidentifiable_singles_are_not_counted():
    assert _figure("single_named_right", (_truth(identifiable=False), _answer("ambiguous", ()))) is None


def test_misfit_and_parameters_are_measured():
    assert _figure("holdout_over_floor_median", (_truth(), _answer(ratio=1.3))) == 1.3
    assert _figure("parameter_error_median", (_truth(), _answer(value=2.1))) == pytest.approx(0.05)
    assert _figure("parameter_error_median", (_truth(), _answer(names=("delay",)))) is None


def test_a_tie_counts_as_broken_only_when_asked_and_named():
    looks = [{"case": "case_0001", "asked": True, "resolved": r} for r in (True, False)]
    looks.append({"case": "case_0001", "asked": False, "resolved": False})
    assert _figure("request_resolves_tie", resolved=looks) == 0.5
    assert _figure("ambiguous_without_request", resolved=looks) == pytest.approx(1 / 3)


def test_wilson():
    assert figures.wilson(0, 0) == (0.0, 1.0)
    assert figures.wilson(95, 100) == pytest.approx((0.8882, 0.9785), abs=1e-4)


def test_targets_are_judged():
    judged = figures.figures([(_truth(), _answer(names=("delay",)))])
    assert judged["confidently_wrong"]["met"] is False and judged["single_named_right"]["met"] is False
    assert figures.figures([(_truth(), _answer())])["confidently_wrong"]["met"] is True


def test_summary_and_page():
    pairs = [
        (_truth(), _answer(names=("delay",))),
        (_truth(form="tanh"), _answer()),
        (_truth(), {"error": "<b>"}),
    ]
    result = summary(pairs, [])
    assert result["confusion"]["resistance"] == {"delay": 1, "resistance": 1, "(none)": 1}
    assert result["by_form"]["other"]["single_named_right"]["k"] == 1
    assert result["by_form"]["catalogue"]["single_named_right"]["k"] == 0
    assert result["by_effect"]["delay"] == {"false": 1} and result["times"]["median_s"] == 1.0
    text = page({**json.loads(json.dumps(result)), "seed": 1, "cases_total": 3, "sha256": "0" * 64})
    assert "delay" in text and "&lt;b&gt;" in text and "<b>" not in text


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_thinned_case_has_every_sixth_row(tmp_path, kind):
    case, table = tmp_path / "case_0001", pd.DataFrame({"t": range(20), "i_a": range(20)})
    case.mkdir()
    (case / "drive.toml").write_text("[machine]\n")
    path = case / f"recording.{kind}"
    table.to_csv(path, index=False) if kind == "csv" else table.to_parquet(path, index=False)
    out = thin(case, tmp_path / "out", 6)
    read = pd.read_csv if kind == "csv" else pd.read_parquet
    assert read(out / path.name)["t"].tolist() == [0, 6, 12, 18] and (out / "drive.toml").read_text() == "[machine]\n"


def test_thinned_figures_count_what_operating_points_show():
    told = dict(ambiguity=[], verdict="explained")
    right, hidden = _truth(), _truth(names=("cogging",))
    assert visible(right) and not visible(hidden)
    pairs = [
        (right, told | {"effects": [{"name": "resistance"}]}),
        (right, told | {"effects": [], "verdict": "ambiguous", "ambiguity": [["resistance", "dead_time"]]}),
        (hidden, told | {"effects": [{"name": "friction"}]}),
        (_truth("healthy", ()), told | {"effects": [], "verdict": "no_mismatch"}),
        (right, {"verdict": "bad_recording"}),
    ]
    found = thinned_summary(pairs)
    counted = {name: (f["k"], f["n"]) for name, f in found.items() if isinstance(f, dict)}
    assert found["cases"] == 5 and found["refused"] == 1
    assert counted == {"exactly_right": (1, 2), "ambiguous": (1, 2), "truth_inside": (1, 1), "false_names": (1, 4),
                       "healthy_with_mismatch": (0, 1)}  # fmt: skip
