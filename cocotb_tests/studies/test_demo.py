# SPDX-License-Identifier: BSD-3-Clause
"""The demo's pieces: numbers on made-up data, a self-contained page, a recording through its codes."""

from __future__ import annotations

import base64
import io
import re
import threading
import time
from collections import namedtuple
from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.slow import slowly
from fluxproof.cosim import recording as recordings
from fluxproof.cosim import runs, verilog
from fluxproof.cosim.golden_loop import run_controller
from fluxproof.cosim.scenarios import RPM, fig9
from fluxproof.diagnosis.example import motor
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.fluxproof import Observed
from golden_model.registers import registers
from golden_model.units import from_si, to_si
from studies.demo import __main__ as demo
from studies.demo import concealed, lanes, plots, report
from studies.demo.example import in_the_loop


@pytest.fixture(scope="module")
def drive():
    return drives.with_carrier(drives.load(PAPER), 1000)


def edges_of_a_run(periods: int) -> np.ndarray:
    """Leg a switches at clocks 500 and 1500 of each period with 40 clocks of dead time; b and c stay low."""
    others = 0b110000
    one = [(500, others), (540, others | 1), (1500, others), (1540, others | 8)]
    return np.array([(k, clock, word) for k in range(periods) for clock, word in one], np.int64)


@pytest.fixture(scope="module")
def made_up(drive):
    """A run whose speed is 2 rpm low throughout but dips by 50 rpm 10 ms after the load step."""
    scenario, n = fig9(drive), len(fig9(drive))
    zeros = np.zeros(n, np.int64)
    arrays = {f"observed_{name}": zeros for name in Observed._fields}
    for name, value in (("i_q_ref", 2.0), ("u_max", 300.0), ("u_alpha", 150.0)):
        arrays[f"observed_{name}"] = np.full(n, from_si(name, value, drive))
    arrays["gate_edges"] = edges_of_a_run(n)
    omega = to_si("omega_ref", scenario.omega_ref, drive) / drive.machine.pole_pairs - 2 * RPM
    load_step = int(np.flatnonzero(scenario.load)[0])
    omega[load_step + 100] -= 48 * RPM
    arrays |= {"plant_omega_m": omega, "plant_i_d": np.full(n, 0.3), "plant_i_q": np.full(n, 1.6)}
    return report.run_view(arrays, drive, scenario, registers(drive))


def test_metrics(made_up):
    m = report.metrics(made_up)
    assert m["speed_error_rpm"]["worst"] == pytest.approx(2.0, abs=0.02)
    assert m["speed_dip_rpm"] == pytest.approx(50.0, abs=0.02)
    assert m["speed_dip_after_ms"] == pytest.approx(10.0)
    assert m["i_d_tracking_a"] == pytest.approx(dict(rms=0.3, worst=0.3, settled_rms=0.3, settled_worst=0.3))
    assert m["i_q_tracking_a"]["rms"] == pytest.approx(0.4, abs=1e-3)
    assert m["peak_current_a"] == pytest.approx(np.hypot(0.3, 1.6), abs=1e-4)
    assert m["voltage_of_circle_percent"] == pytest.approx(50.0, abs=0.01)
    assert (m["both_gates_on"], m["shortest_dead_time_us"]) == (0, 2.0)


def test_dead_times_notice_a_shoot_through():
    edges = edges_of_a_run(3)
    assert report.dead_times(edges, 1000) == (0, 40)
    edges[5, 2] |= 8  # lower gate still on when the upper one comes
    assert report.dead_times(edges, 1000)[0] == 1


def test_gate_view_finds_the_dead_time(made_up):
    gates = report.gate_view(made_up, 7)
    assert gates.words[0] == 0b111000  # what the period before left
    assert gates.dead_us == pytest.approx((25.0, 27.0))


def example(**changed) -> dict:
    """The summary's part on the motor that differs, with one hidden difference."""
    row = dict(name="magnet_flux", hidden="magnets -8 %", true=0.15, found=0.151, sigma=0.001, unit="Wb", deviation=1.0)
    row |= dict(true_text="0.15 Wb", found_text="0.1510 ± 0.0010 Wb")
    misfit = dict(holdout_before=9.0, holdout_after=0.5, train_before=9.5, train_after=0.4, noise_floor=0.3)
    found = dict(verdict="explained", sentence="Magnets.", replayed=99, replay_equal=True, misfit=misfit, effects=[row])
    counts = dict(periods_compared=99, differences=0, first_difference=None, seconds=1.0, diagnosis_seconds=2.0)
    return {**counts, **found, "current_error_a": 0.01, "false_names": [], **changed}


def summary_of(run) -> dict:
    counts = dict(periods_compared=3000, differences=0, sample_to_duty_clocks=38, gate_edges=9)
    counts |= dict(ghdl_seconds=1.0, verilator_seconds=3.0, ghdl_periods=200, ghdl_carrier_half_clocks=250)
    counts |= dict(example=example(), example_carrier_half_clocks=100)
    return {**counts, **report.metrics(run), "recording": {"skipped": "not here"}, "seconds": 2.0}


def voltages():
    """Two operating points, with a misfit of 3 V before and none after; the second one is held out."""
    n = np.arange(200)
    i_q, none = np.where(n < 100, 0.0, 4.0), 0.0 * n
    currents = dict(i_d=none, i_q=i_q + 0.1, i_d_ref=none, i_q_ref=i_q)
    misfit = dict(block_ms=0.1 * n, held=n >= 100, before=(none + 3.0, none - 3.0), after=(none, none))
    return SimpleNamespace(ms=0.1 * n, **currents, **misfit)


def test_metrics_of_the_motor_that_differs():
    """Currents 0.1 A off in every settled row; the estimates beside the truth in their own units."""
    drive = drives.load(motor.DRIVE_FILE)
    secrets = motor.hidden(drive)[:2]
    effects = [
        {"name": s.effect, "parameters": {s.parameter: {"value": 1.02 * s.value, "sigma": 0.01 * s.value, "unit": "V"}}}
        for s in secrets
    ]
    answer = dict(verdict="explained", sentence="", fit={}, effects=[*effects, {"name": "friction", "parameters": {}}])
    answer["digital"] = {"checked": True, "samples": 200, "first_difference": None}
    found = concealed.metrics(voltages(), answer, 200)
    assert found["current_error_a"] == pytest.approx(0.1)
    assert [row["deviation"] for row in found["effects"]] == [2.0, 2.0, None]
    assert found["false_names"] == ["friction"] and found["replay_equal"]


def test_report_is_self_contained(made_up, drive, tmp_path):
    figures = plots.draw(made_up, report.gate_view(made_up, 7))
    figures["concealed"] = plots.styled(concealed.figure, voltages())
    context = dict(good=True, problems=[], view=None, real=drive, emrax=None, drive_file="paper001.toml")
    context |= dict(clock=drive, registers=registers(drive))
    page = report.write(tmp_path / "report.html", figures, summary_of(made_up), **context).read_text()
    assert "3,000 periods in Verilator and 200 in GHDL, 0 differences" in page and "Skipped: not here" in page
    images = re.findall(r'src="data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)"', page)
    assert len(images) == page.count("src=") == len(figures) - 1  # all but the README's picture
    assert re.findall(r'href="(.*?)"', page) == ["diagnosis/report.html"]  # the diagnosis's own page, beside this one
    assert not re.search(r"url\(|@import|<script|<link", page)
    for image in images:  # inside a drawing, only its own parts are referred to
        assert not re.search(rb'href="(?!#)|url\((?!#)|@import', base64.b64decode(image))


def test_verdict_and_exit_status(made_up):
    summary = summary_of(made_up)
    assert demo.passed(summary, []) and not demo.passed(summary, ["Fig. 9: a problem"])
    assert not demo.passed({**summary, "periods_compared": 2999}, [])
    assert not demo.passed({**summary, "ghdl_periods": 149}, [])
    assert not demo.passed({**summary, "recording": {"differences": 1}}, [])
    assert "1 difference," in report.verdict({**summary, "differences": 1})
    assert "1 of 1 differences named" in report.verdict(summary)
    assert len(report.text(summary, drives.load(demo.PAPER)).splitlines()) == 6


@pytest.mark.parametrize(
    "changed",
    [
        {"differences": 1},
        {"replay_equal": False},
        {"verdict": "ambiguous"},
        {"false_names": ["friction"]},
        {"effects": [{**example()["effects"][0], "deviation": 3.1}]},
        {"effects": [{**example()["effects"][0], "found": None, "deviation": None}]},
    ],
)
def test_a_wrong_diagnosis_fails_the_demo(made_up, changed):
    summary = summary_of(made_up)
    assert not demo.passed({**summary, "example": example(**changed)}, [])


def test_progress_lines():
    """Plain lines at every 10 %; on a terminal one line that fits, with the time left."""
    kind = namedtuple("Job", "name total begun starts", defaults=["building"])
    loop, replay = kind("Fig. 9", 3000, True), kind("recording", 14595, True)
    waiting = kind("recording in GHDL", 300, False)
    plain = lanes.Progress([loop, replay, waiting], io.StringIO())
    plain.show({loop: 0, replay: 0, waiting: 0}, 0.0)
    plain.show({loop: 60, replay: 290, waiting: 0}, 1.0)
    plain.show({loop: 360, replay: 300, waiting: 0}, 11.0)
    lines = plain.out.getvalue().splitlines()
    assert lines[:2] == ["Fig. 9: building", "recording: building"]
    assert lines[2:] == ["Fig. 9: 10 %, 360 of 3000 periods, 30/s, 88 s left"]
    for columns in (60, 79, 200):
        line = plain.line({loop: 1500, replay: 300, waiting: 0}, 61.0, columns)
        assert len(line) <= columns and "1500/3000" in line
        assert columns < 79 or line.endswith("s left")


def test_the_preparation_says_what_it_does():
    """A line at the begin of each step before the first period, before the step has ended, and once."""
    out = io.StringIO()
    job = demo.InVerilator(
        "Fig. 9 in Verilator", demo.Named("fluxproof.cosim.runs:closed_loop", (str(PAPER), 100, "short"))
    )
    steps = [demo.kernels("golden"), demo.kernels("plant"), job.build, demo.InGhdl.analyse]
    assert {lanes.step_name(step) for step in steps} == set(lanes.PREPARED)

    def wait() -> None:
        for _ in range(100):
            if out.getvalue():
                break
            time.sleep(0.01)
        else:
            out.write("nothing was said in a second")

    wait.__name__ = "kernels of the golden"
    lanes.watch([lanes.Lane(lanes.Plan([(wait, ())]))], [], out, pause=0.01)
    assert out.getvalue() == "compiling the golden model; up to some minutes the first time\n"


def test_a_step_waits_for_those_before_it_and_for_no_other():
    """Two lanes; a step that fails holds up none that comes after it."""
    began, go_on = [], threading.Event()

    def slow():
        began.append("slow")
        assert go_on.wait(10.0)

    def quick():
        began.append("quick")
        go_on.set()
        raise SystemExit  # ends its lane

    def last():
        began.append("last")

    plan = lanes.Plan([(slow, ()), (quick, ()), (last, (slow, quick))])
    lanes.watch([lanes.Lane(plan), lanes.Lane(plan)], [], io.StringIO(), pause=0.01)
    assert sorted(began[:2]) == ["quick", "slow"] and began[2:] == ["last"]


@pytest.fixture
def log(tmp_path):
    """A made-up log, through standstill and both directions."""
    columns = dict.fromkeys(recordings.COLUMNS.values(), np.zeros(60))
    columns |= {"iq_A": np.linspace(-330, 330, 60), "id_A": np.full(60, -20.0)}
    columns |= {"n_rpm": np.linspace(-2000, 2000, 60), "current_cmd": np.linspace(0, 1, 60)}
    columns["u_dc_V"] = np.full(60, 400.0)
    path, table = tmp_path / "log.csv", np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="")
    return path


def needs_conversion() -> None:
    """Skip the test without a GHDL that converts the VHDL to Verilog."""
    try:
        verilog.find_ghdl()
    except RuntimeError as reason:
        pytest.skip(str(reason))


@pytest.mark.slow
def test_the_telemetry_of_the_rtl_is_that_of_the_golden_model(tmp_path, monkeypatch):
    """What the core was given on the motor that differs, replayed, gives what the RTL put out."""
    needs_conversion()
    monkeypatch.setattr(runs, "BUILD", tmp_path)
    periods = motor.RAMP + 50  # the speed has been ramped up, with the first current on its way
    named = runs.Named("studies.demo.example:in_the_loop", (demo.CARRIER, periods))
    job = runs.InVerilator("motor that differs", named)
    job.carry_out()
    assert job.problem is None and job.summary()["differences"] == 0
    arrays, settings = job.arrays(), in_the_loop(demo.CARRIER).registers
    assert arrays["plant_omega_m"][-1] == pytest.approx(motor.SPEEDS[0], rel=1e-6)  # as the bench imposes it
    assert arrays["samples"].shape == (periods, len(fluxproof.Sample._fields))
    observed = np.zeros((periods, len(Observed._fields)), np.int64)
    run_controller(fluxproof.State(), arrays["samples"], settings.values, settings.config, observed)
    for k, name in enumerate(Observed._fields):
        assert np.array_equal(observed[:, k], arrays[f"observed_{name}"]), name


@pytest.mark.parametrize("engine", [slowly(runs.InVerilator), slowly(runs.InGhdl)])
def test_replay(log, engine, tmp_path, monkeypatch):
    """A recording in both engines, equal in every bit of every sample, the demo's way."""
    if engine is runs.InVerilator:
        needs_conversion()
    monkeypatch.setattr(runs, "BUILD", tmp_path)
    named = runs.Named("fluxproof.cosim.recording:replay", (str(log), str(demo.EMRAX), demo.CARRIER))
    job = engine("made up", named)
    job.carry_out()
    assert job.problem is None
    counted = job.summary()
    assert (counted["periods_compared"], counted["differences"]) == (60, 0) and counted["gate_edges"] > 500
    assert job.done() == job.total == 60 and len(job.result().observed["i_q"]) == 60


def test_a_run_that_fails_says_why(tmp_path, monkeypatch):
    """A recording that disappears between the two processes: a problem in words, no result, none of an earlier run."""
    monkeypatch.setattr(runs, "BUILD", tmp_path)
    named = runs.Named("fluxproof.cosim.runs:closed_loop", (str(demo.PAPER), 100, "short", 3))
    (tmp_path / "runs" / "short").mkdir(parents=True)
    (tmp_path / "runs" / "short" / "summary.json").write_text("{}")
    job = runs.InVerilator("short", named)
    job.named = named._replace(arguments=("/nonexistent.toml", 100, "short"))
    job.carry_out()
    assert "/nonexistent.toml" in job.problem and job.summary() == {}


def test_first_periods(drive):
    scenario = fig9(drive)
    first = scenario.first(150)
    assert len(first) == 150 and np.array_equal(first.omega_ref, scenario.omega_ref[:150])
    assert scenario.first(None) is scenario


@pytest.fixture(scope="module")
def recording():
    path, skipped = recordings.recording_path()
    if skipped:
        pytest.skip(skipped)
    return recordings.load_recording(path)


def test_recording_survives_its_codes(recording):
    """What the golden model sees in the codes is the log, within what the formats of codes and core allow."""
    drive = drives.load(demo.DRIVES / "emrax228.toml")
    register_set = registers(drive)
    rows = recordings.sample_inputs(recording, drive)
    samples = np.column_stack([rows, np.ones(len(rows), np.int64)])
    observed = np.zeros((len(rows), len(Observed._fields)), np.int64)
    run_controller(fluxproof.State(), samples, register_set.values, register_set.config, observed)
    arrays = {f"observed_{name}": observed[:, k] for k, name in enumerate(Observed._fields)}
    bound = recordings.current_bound(recording, drive)
    view = report.recording_view(recording, bound, arrays, drive)
    assert np.all(view.current_error <= bound)
    assert bound.max() < 0.01 * view.top_current  # a bound that says something
    assert not arrays["observed_current_at_rail"].any()
    assert np.abs(view.omega_core - view.omega)[100:].mean() < 0.02 * view.top_speed


def test_replay_has_a_port_for_every_column():
    assert len(recordings.INPUT_PORTS) + 1 == len(fluxproof.Sample._fields)
    wanted = [name.removesuffix("_in") for name in recordings.INPUT_PORTS]
    assert wanted == list(fluxproof.Sample._fields[:-1])


def test_missing_recording_is_a_reason(monkeypatch):
    monkeypatch.setenv("FLUXPROOF_RECORDINGS", "/nonexistent")
    assert "coastdown_run.csv is not there" in recordings.recording_path()[1]
