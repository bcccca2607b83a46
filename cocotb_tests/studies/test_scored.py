# SPDX-License-Identifier: BSD-3-Clause
"""The judge of answers: each rule on a small answer; and the mishaps, which are many and change what they name."""

from __future__ import annotations

import numpy as np
import pytest

from studies.mishaps.__main__ import MISHAPS, PLAIN
from studies.mishaps.bases import BASES, FORMS
from studies.mishaps.log import Log, stated
from studies.scored.answers import answers, job_of, kept_answers
from studies.scored.judge import judge
from studies.scored.truth import Cause, Truth

MACHINE = {"resistance_ohm": 1.0, "magnet_flux_wb": 0.1}
WARM = Cause(("resistance",), {"resistance_ohm": (1.28, 1.34)}, may=("current_scale",), reading="resistance_line",
             may_read="currents_half", words="resistance")  # fmt: skip
TRUTH = Truth((WARM,), (Cause(("dead_time",)),), readings="the time is in ms", limit="gates are off", never="mWb")
NO_CAUSE = Truth((), TRUTH.beside, TRUTH.readings, TRUTH.limit, tells="rpm")


def effect(name="resistance", key="resistance_ohm", value=1.31, sigma=0.01, unit="ohm"):
    return {"name": name, "parameters": {key: {"value": value, "sigma": sigma, "unit": unit}}}


def answer(verdict="explained", effects=(), groups=(), conventions=(), sentence="It is so.", problems=(), advice=""):
    return {
        "verdict": verdict, "sentence": sentence, "advice": advice, "effects": list(effects),
        "ambiguity": [list(g) for g in groups], "conventions": list(conventions), "unknown_term": None,
        "recording": {"problems": list(problems)},
    }  # fmt: skip


def read(code, *rivals):
    return {"code": code, "rivals": list(rivals), "says": "so it is"}


def corrected(message):
    return {"message": message, "action": "converted", "fatal": False}


def word(given, truth=TRUTH):
    return judge(given, truth, MACHINE)[0]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (answer(effects=[effect()]), "right"),
        (answer(effects=[effect(), effect("dead_time", "v_dead_v", 0.8, 0.1, "V")]), "right"),
        (answer(conventions=[read("resistance_line")]), "right"),
        (answer("ambiguous", groups=[("resistance", "magnet_flux")]), "covering"),
        (answer("ambiguous", groups=[("current_scale", "magnet_flux")]), "covering"),
        (answer("ambiguous", conventions=[read("currents_half", "resistance_line")]), "covering"),
        (answer("unexplained", sentence="Perhaps the resistance, 1.3 ohm."), "covering"),
        (answer("unexplained"), "withheld"),
        (answer("partly_explained", [effect("dead_time", "v_dead_v", 0.8, 0.1, "V")]), "withheld"),
        ({"refused": "the gates are off from row 7"}, "honest limit"),
        (answer("bad_recording", sentence="Cannot be used: the gates are off."), "honest limit"),
        ({"refused": "gates_are_off.csv: record longer"}, "withheld"),
        ({"refused": "record longer; found columns the gates are off; name them"}, "withheld"),
        ({"crash": "LinAlgError"}, "wrong"),
        ({"refused": "as if psi is in mWb"}, "wrong"),
        (answer("no_mismatch"), "wrong"),
        (answer(effects=[effect(value=1.1)]), "wrong"),
        (answer(effects=[effect(sigma=0.2)]), "wrong"),  # compatible with zero
        (answer(effects=[effect(value=0.5, sigma=0.2)]), "wrong"),
        (answer(effects=[effect(), effect("delay", "delay_s", 1e-5, 1e-6, "s")]), "wrong"),
        (answer(effects=[effect(), effect("dead_time", "v_dead_v", 0.8, 0.5, "V")]), "wrong"),
        (answer(effects=[effect("dead_time", "v_dead_v", 0.8, 0.1, "V")]), "wrong"),  # explained without the cause
        (answer("ambiguous", groups=[("delay", "iron_loss")]), "wrong"),
        (answer(effects=[effect("current_scale", "scale", -0.24, 0.01, "1")]), "wrong"),  # alone and certain
        (answer(conventions=[read("currents_half")]), "wrong"),
        (answer(effects=[effect()], problems=[corrected("phases b and c are swapped")]), "wrong"),
    ],
)
def test_an_answer_where_a_cause_is_true(given, expected):
    assert word(given) == expected


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (answer("no_mismatch", sentence="They agree, the speed is in rpm."), "right"),
        (answer("no_mismatch", sentence="rpm", problems=[corrected("the time is in ms")]), "right"),
        (answer("explained", [effect("dead_time", "v_dead_v", 0.8, 0.1, "V")], sentence="rpm"), "covering"),
        (answer("no_mismatch"), "wrong"),  # the guess is not told
        (answer("unexplained", sentence="rpm"), "wrong"),
        (answer("unexplained", sentence="rpm, the gates are off from row 7"), "honest limit"),
        (answer("explained", [effect()], sentence="rpm"), "wrong"),
    ],
)
def test_an_answer_where_all_agrees(given, expected):
    assert word(given, NO_CAUSE) == expected


def test_a_guess_counts_where_a_note_tells_of_one():
    truth = Truth((WARM,), tells="rpm", guess="assumed")
    given = answer(effects=[effect()])
    assert word(given, truth) == "right"
    assert word(given | {"notes": ["it is assumed"]}, truth) == "wrong"


def test_an_improved_drive_that_changes_nothing():
    given = answer(effects=[effect()], advice="Use drive_improved.toml.") | {"improved": "same"}
    assert word(given) == "wrong" and word(given | {"improved": "changed"}) == "right"


def test_an_implausible_size_of_what_may_be_there():
    beside = Truth((WARM,), (Cause(("udc_gain",)),))
    gain = lambda value: effect("udc_gain", "udc_gain", value, 0.001, "1")  # noqa: E731
    assert word(answer(effects=[effect(), gain(0.03)]), beside) == "right"
    assert word(answer(effects=[effect(), gain(0.3)]), beside) == "wrong"


def same(log: Log, other: Log) -> bool:
    """Whether both would be written alike."""
    if log.columns.keys() != other.columns.keys() or not all(
        np.array_equal(v, other.columns[n]) for n, v in log.columns.items()
    ):
        return False
    rest = [{**vars(x), "columns": None} for x in (log, other)]
    return rest[0] == rest[1]


def test_the_mishaps_are_many_and_each_changes_what_it_says():
    """At least 80 besides the recordings without any, each on three drives; their truths follow from the drive file."""
    assert len(MISHAPS) - len(PLAIN) >= 80 and len(BASES) >= 3
    assert len({m.name for m in MISHAPS}) == len(MISHAPS)
    for base in BASES:
        for mishap in MISHAPS:
            log = Log(dict(FORMS[mishap.form](base)), BASES[base].drive())
            changed = mishap.change(log)
            assert same(log, changed) == (mishap in PLAIN), mishap.name
            mishap.truth(base, changed.drive)


def test_the_truth_follows_the_drive_file():
    mishap = next(m for m in MISHAPS if m.name == "R and L times 1.5")
    assert [c.names for c in mishap.truth("servo", BASES["servo"].drive()).causes] == []
    log = stated(resistance_ohm=1.5)(Log({}, BASES["servo"].drive()))
    (cause,) = mishap.truth("servo", log.drive).causes
    low, high = cause.sizes["resistance_ohm"]
    assert cause.names == ("resistance",) and low < 1.53 < high < 1.5 * 1.53


def test_answers_are_kept_with_code_and_files(tmp_path):
    files, drive = Log({"t": np.arange(9.0)}, {"machine": {"pole_pairs": 4}}).written(tmp_path)
    job = job_of("one", files, drive, None, tmp_path / "kept")
    ((_, first),) = answers([job], 1)
    assert "refused" in first and str(tmp_path) not in first["refused"]
    job.kept.write_text('{"refused": "kept"}')
    assert next(iter(answers([job], 1)))[1] == {"refused": "kept"} == next(kept_answers([job]))[1]
    drive.write_text("[machine]\npole_pairs = 5\n")
    assert job_of("one", files, drive, None, tmp_path / "kept").kept != job.kept
