# SPDX-License-Identifier: BSD-3-Clause
"""`make synth`: counts, kept values, and the size of the blocks against the kept values."""

from __future__ import annotations

import json

import pytest

from fluxproof.checkout import RTL
from fluxproof.cosim import verilog
from scripts.synth import ecp5, kept, report
from scripts.synth.__main__ import figures, rows_of
from scripts.synth.count import Count, count, read_cells
from scripts.synth.groups import CORE, GROUPS, check, instances
from scripts.synth.parts import SMALL
from scripts.synth.yosys import Design, modules_of, part_of

ROW = {"lut": 1000, "ff": 500, "dsp": 20, "bram": 2}


def one(**figures) -> dict:
    """Counts of one family and one row, made up."""
    return {"xc7": {"svm": {**ROW, **figures}}}


# The groups


def test_every_instance_has_one_group():
    check(list(instances(RTL / f"{CORE}.vhd")))


@pytest.mark.parametrize(
    ("labels", "groups", "words"),
    [
        (["a", "b"], {"x": ("a",)}, "b is in no group"),
        (["a"], {"x": ("a", "b")}, "b is in a group and not in the file"),
        (["a", "b"], {"x": ("a", "b"), "y": ("b",)}, "b is in two groups"),
    ],
)
def test_a_wrong_assignment_is_named(labels, groups, words):
    with pytest.raises(ValueError, match=words):
        check(labels, groups)


def test_instances_are_read_without_comments(tmp_path):
    file = tmp_path / "x.vhd"
    file.write_text("  A_1 : entity work.one\n  -- b : entity work.two\n  c: entity WORK.three generic map (\n")
    assert instances(file) == {"a_1": "one", "c": "three"}


# The cells


def test_cells_are_counted_by_kind():
    cells = {"LUT2": 3, "INV": 2, "FDRE": 5, "FDSE": 1, "DSP48E1": 2, "RAMB18E1": 3, "RAMB36E1": 1}
    cells |= {"SRL16E": 4, "RAM64M": 1, "CARRY4": 2, "CARRY8": 1, "MUXF7": 6, "$scopeinfo": 9, "LDCE": 1}
    assert count(cells) == Count(
        lut=3 + 2 + 4 + 4, ff=6, dsp=2, bram=2.5, lut_memory=8, muxf=6, carry_bits=16, latches=1
    )


def test_an_unknown_cell_is_an_error():
    with pytest.raises(ValueError, match="URAM288"):
        count({"URAM288": 1})


def test_instances_are_not_cells(tmp_path):
    modules = {
        "\\top": {"num_cells_by_type": {"LUT2": 1, "sub": 2}},
        "\\sub": {"num_cells_by_type": {"INV": 1}},
    }
    (tmp_path / "s.json").write_text(json.dumps({"modules": modules}))
    assert read_cells(tmp_path / "s.json") == {"top": {"LUT2": 1}, "sub": {"INV": 1}}


def test_modules_belong_to_the_longest_name():
    text = "module speed_16\nmodule speed_pi\nmodule speed_pi_3\nmodule speed\nmodule speeds\n"
    entities = ["speed", "speed_pi"]
    assert modules_of(text, "speed", entities) == ["speed_16", "speed"]
    assert modules_of(text, "speed_pi", entities) == ["speed_pi", "speed_pi_3"]


def test_part_includes_its_instances():
    text = "".join(
        f"module {name}\n  (input a);\n{body}endmodule\n"
        for name, body in (
            ("leaf", ""),
            ("other", ""),
            ("one", "  leaf x (\n    .a(a));\n"),
            ("top", "  one y (\n    .a(a));\n"),
        )
    )
    part = part_of("/* heading */\n" + text, ["top"])
    assert [line for line in part.splitlines() if line.startswith("module")] == [
        "module top",
        "module one",
        "module leaf",
    ]


# The kept file


@pytest.mark.parametrize("name", kept.FIGURES)
@pytest.mark.parametrize("before", range(0, 120, 7))
def test_changes_at_the_limit(name, before):
    """Every count near every kept one: a change is reported exactly if it is above 3 %, in both directions."""
    for after in range(0, 130):
        off = 100 * abs(after - before) > 3 * before
        assert bool(kept.changes(one(**{name: before}), one(**{name: after}))) == off, (before, after)


def test_a_change_names_family_row_figure_and_both_values():
    assert kept.changes(one(), one(lut=1031)) == ["xc7 svm lut: 1000 kept, 1031 counted"]
    assert len(kept.changes(one(), one(lut=900, ff=600, dsp=19, bram=0))) == 4


def test_added_and_removed_rows():
    there, absent = one(lut=1000), {"xc7": {"svm": None}}
    assert kept.changes(absent, absent) == []
    assert kept.changes(absent, there) == ["xc7 svm: was not there"]
    assert kept.changes(there, absent) == ["xc7 svm: was there"]
    assert kept.changes({}, there) == ["xc7 svm: never kept"]
    assert kept.changes({"xc7": {"svm": {"lut": 1000}}}, there)[0] == "xc7 svm ff: none kept, 500 counted"
    assert kept.changes(there, {}) == []  # a family that was not counted


def test_update_keeps_the_rest_and_logs(tmp_path):
    path = tmp_path / "counts.json"
    kept.update({"xc7": {"a": ROW, "b": ROW}}, "first", "Yosys 1", path, "2026-01-01")
    moved = kept.update({"xc7": {"a": {**ROW, "lut": 1029, "ff": 400}}}, " second ", "Yosys 2", path, "2026-01-02")
    now = kept.read(path)
    assert moved == ["xc7 a ff: 500 kept, 400 counted"]
    assert now["counts"] == {"xc7": {"a": {**ROW, "lut": 1029, "ff": 400}, "b": ROW}}
    assert now["tool"] == "Yosys 2"
    assert [(e["date"], e["reason"]) for e in now["log"]] == [
        ("2026-01-01", "first"),
        ("2026-01-02", "second"),
    ]
    assert now["log"][1]["changes"] == moved


def test_update_requires_a_reason(tmp_path):
    with pytest.raises(ValueError, match="reason"):
        kept.update(one(lut=1), "  ", "Yosys 1", tmp_path / "counts.json")
    assert not (tmp_path / "counts.json").exists()


@pytest.mark.parametrize(
    ("text", "words"), [("{", "line 1"), ("{}", "'counts'"), ('{"counts": {}, "log": 3}', "'log'")]
)
def test_a_broken_file_is_named(tmp_path, text, words):
    path = tmp_path / "counts.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=f"counts.json.*{words}"):
        kept.read(path)


def test_small_changes_do_not_add_up():
    """Two steps of 2 % without an update are reported at the second, because the kept figure has not changed."""
    assert kept.changes(one(), one(lut=1020)) == []
    assert kept.changes(one(), one(lut=1040)) != []


# The report


def test_sums_and_targets():
    groups = {name: Count(lut=1300, dsp=17) for name in GROUPS} | {"registers_telemetry": None}
    groups["protection"] = Count()
    total = report.sums(groups)
    assert (total["foc"].lut, total["core"].lut, total["sum"].lut) == (2600, 5200, 5200)
    assert [line.rsplit(": ", 1)[1] for line in report.against_targets(groups)] == ["met"] * 4
    groups["io_svm"] = Count(lut=1301, dsp=18)
    assert [line.rsplit(": ", 1)[1] for line in report.against_targets(groups)][:2] == ["missed by 1"] * 2
    assert "not there" in report.table(groups)


def test_a_family_without_groups_has_its_total_only():
    assert figures({}, Count(lut=7)) == {"total": {"lut": 7, "ff": 0, "dsp": 0, "bram": 0}}
    assert list(rows_of({}, Count(lut=7))) == ["total, in one piece"]
    groups = {name: Count(lut=1) for name in GROUPS} | {"registers_telemetry": None, "between_blocks": Count()}
    assert figures(groups, Count())["registers_telemetry"] is None and len(figures(groups, Count())) == len(GROUPS) + 2
    rows = rows_of(groups, Count(lut=9))
    assert (rows["FOC, SVM, gates"].lut, rows["sum"].lut) == (2, len(GROUPS)) and "between_blocks" not in rows


# The routed path


def nextpnr_report() -> dict:
    """What nextpnr 0.11 writes, cut down: one clock, its slowest path, and one from a port."""
    steps = [("clk-to-q", 0.5), ("routing", 1.25), ("logic", 0.25), ("routing", 2.0), ("setup", 0.0)]
    path = [{"type": kind, "delay": ns, "from": {"cell": "a", "port": "Q"}, "to": {"cell": "b", "port": "DI"}}
            for kind, ns in steps]  # fmt: skip
    path[0]["from"]["cell"], path[-1]["to"]["cell"] = "first", "last"
    paths = [{"from": "posedge aclk", "to": "posedge aclk", "path": path}]
    paths += [{"from": "<async>", "to": "posedge aclk", "path": path}]
    return {"fmax": {"aclk": {"achieved": 250.0, "constraint": 12.0}}, "critical_paths": paths}


def test_a_report_of_nextpnr_is_read():
    one = ecp5.read_report(nextpnr_report(), 7)
    assert one == ecp5.Routed(7, 250.0, "first", "last", 0.75, 3.25)
    summary = ecp5.summary([one, ecp5.Routed(8, 240.04, "a", "b", 1.0, 3.0), ecp5.Routed(9, 245.0, "a", "b", 1.0, 3.0)])
    assert (summary["median_mhz"], summary["fmax_mhz"]) == (245.0, [250.0, 240.0, 245.0])
    assert "median 245.0 MHz, 240.0 to 250.0" in ecp5.verdict(summary)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda report: report["fmax"].update(other={"achieved": 1.0}), "2 clocks"),
        (lambda report: report["critical_paths"].pop(0), "0 slowest paths"),
    ],
)
def test_a_report_without_one_clock_and_its_path_is_an_error(change, words):
    report = nextpnr_report()
    change(report)
    with pytest.raises(ValueError, match=words):
        ecp5.read_report(report, 1)


# The real thing


@pytest.mark.slow
def test_small_blocks_match_the_stored_results():
    """Three blocks through GHDL 5 and yosys, against docs/synth/counts.json."""
    try:
        verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
    counted = {n: c.kept() for n, c in Design(quiet=True).blocks(SMALL, "xc7").items()}
    kept_counts = {"xc7, block alone": kept.read()["counts"]["xc7, block alone"]}
    assert kept.changes(kept_counts, {"xc7, block alone": counted}) == [], "make synth ARGS='--update REASON'"
    assert all(row["lut"] > 0 for row in counted.values())
