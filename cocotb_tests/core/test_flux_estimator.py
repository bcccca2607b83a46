# SPDX-License-Identifier: BSD-3-Clause
"""The flux estimator in closed loop: the papers' findings, the equations behind them, faults and recovery."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import ROOT
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant import IMPOSED_SPEED, Sensors
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.drive_keys import DriveError
from golden_model.estimators.flux_monitor import FAULTS
from golden_model.registers import registers
from studies.papers.__main__ import EXPERIMENTS
from studies.papers.flux_bench import (
    CURRENT_MODEL,
    DRIVE,
    EARLIER,
    LAMBDA_N,
    MERGED,
    NOMINAL,
    T_S,
    TORQUE_N,
    held_at,
    mean_error,
    run,
    scaled,
    window,
    wrong_by,
)
from studies.papers.flux_stability import Gains

CURRENT, BUS, MODEL, MERGE, DELTA, COMPENSATION, ESTIMATE = (1 << k for k in range(FAULTS.width))


# `make papers` checks the findings of all experiments; these take 5 to 30 s each.
LONG = {"any_i_d", "both_papers", "brusa_map", "details", "eq_b3", "fig_2", "fig_5", "fig_11", "figs_12_13"}


@pytest.mark.parametrize("experiment", [e for e in EXPERIMENTS if e.__name__ not in LONG], ids=lambda e: e.__name__)
def test_papers(experiment):
    """Every result of `make papers` on the golden model is within its limits."""
    found = experiment().findings
    wrong = [f"{f.experiment}: {f.ours} {f.unit}" for f in found if not f.passed]
    assert found and not wrong, "\n".join(wrong)
    if any(isinstance(f.ours, str) and f.ours.startswith("skipped") for f in found):
        pytest.skip(found[0].ours)


@pytest.mark.parametrize("rpm", [239, -239, 732, 2000])
def test_last_bit(rpm):
    """Parameters x 1.3: delta_lambda averages to zero, the estimate to within 3 LSB of the plant's flux."""
    fine = NOMINAL._replace(config=NOMINAL.config._replace(position_bits=18))
    sensors = Sensors(
        current_bits=16, current_full_scale_a=12.5, u_dc_bits=16, u_dc_full_scale_v=1000, position_bits=18
    )
    scene = scenario(DRIVE, 2.0, rpm={0.0: rpm}, load={0.2: np.sign(rpm) * TORQUE_N}, start_rpm=rpm)
    wrong = scaled(fine, {"l_d": 1.3, "l_q": 1.3, "lambda_mg": 1.3})
    view, end, lsb = run(scene, wrong, sensors=sensors), window(1.0, 2.0), DRIVE.bases.flux_wb * 2.0**-16
    for axis in "dq":
        off = (view.estimate[axis][end] - view.actual[axis][end]) / lsb
        assert abs(view.delta[axis][end].mean()) / lsb < 0.05
        assert abs(off.mean()) < 3 and off.std() < 12, (axis, off.mean(), off.std())


def merge_gains(omega: float) -> tuple[complex, complex]:
    """G_v and G_c of paper 001 eq. (18) as complex numbers: eq. (7) at s = j*omega."""
    w_0, xi, s = 157.0, np.sqrt(0.5), 1j * omega
    both = s * s + 2 * xi * w_0 * s + w_0**2
    return s * s / both, (2 * xi * w_0 * s + w_0**2) / both


@pytest.mark.parametrize("rpm", [100, 239, -549, 2000])
@pytest.mark.parametrize("mode", [MERGED, EARLIER])
def test_steady_errors_of_the_earlier_schemes(rpm, mode):
    """Merged models end where eq. (18) says, the scheme of eq. (16) where eq. (19) says: not on the flux."""
    view = run(held_at(rpm, -1.0, 3.0, 1.0), wrong_by(1.3, flux_mode=mode), mode=IMPOSED_SPEED)
    end = window(0.9, 1.0)
    actual, estimate = (complex(*(flux[x][end].mean() for x in "dq")) for flux in (view.actual, view.estimate))
    m, omega = DRIVE.machine, rpm * RPM * DRIVE.machine.pole_pairs
    g_v, g_c = merge_gains(omega)
    current = complex(view.i_d[end].mean(), view.i_q[end].mean())
    model = 1.3 * complex(m.magnet_flux_wb + m.inductance_d_h * current.real, m.inductance_q_h * current.imag)
    wanted = g_v * actual + g_c * model
    if mode == EARLIER:
        added = g_c * Gains().weight(omega)
        wanted = (wanted + added * actual) / (1 + added)
    assert abs(wanted - actual) > 0.01 * LAMBDA_N, "nothing to tell apart"
    assert abs(estimate - wanted) < 0.006 * LAMBDA_N


def test_current_model_mode_is_eq_6():
    view = run(held_at(500, -1.0, 3.0, 0.3), wrong_by(1.2, flux_mode=CURRENT_MODEL), mode=IMPOSED_SPEED)
    m, end = DRIVE.machine, window(0.2, 0.3)
    assert view.estimate["q"][end] == pytest.approx(1.2 * m.inductance_q_h * view.i_q[end], abs=5e-5)
    wanted = 1.2 * (m.magnet_flux_wb + m.inductance_d_h * view.i_d[end])
    assert view.estimate["d"][end] == pytest.approx(wanted, abs=5e-5)


def test_restart_on_the_fly_keeps_the_compensation():
    """Gates off and on below the crossover, nameplate x 1.3: the second start has the remaining error, not 30 %."""
    scene = scenario(DRIVE, 0.7, rpm={0.0: 0.0}, torque_mode=((0.0, 0.7),), off=((0.6, 0.65),), start_rpm=150)
    scene.load[:] = 150 * RPM
    view = run(scene, wrong_by(1.3), mode=IMPOSED_SPEED)
    assert view.worst(window(0.002, 0.01)) > 10
    assert view.worst(window(0.60, 0.7)) < 6


def test_no_jump_at_the_edge_of_the_compensation():
    """Slowly through +-2 rad/s with wrong parameters: no step of the estimate beyond its ripple."""
    scene = scenario(DRIVE, 2.0, rpm={0.0: 60}, load={0.0: 2.0}, start_rpm=60)
    course = np.interp(np.arange(len(scene)) * T_S, [0, 0.4, 1.6, 2.0], [60, 60, -60, -60])
    per_rpm = RPM * DRIVE.machine.pole_pairs / DRIVE.bases.omega_me_rad_s * 2**16
    scene.omega_ref[:] = np.round(course * per_rpm)
    view = run(scene, wrong_by(1.3))
    inside = np.abs(view.rpm * RPM) < 2.0
    edge = [k for k in np.flatnonzero(np.diff(inside.astype(int))) if k > 0.4 / T_S]
    assert len(edge) >= 2
    for axis in "dq":
        steps = 100 * np.abs(np.diff(view.error(axis)))
        assert all(steps[k - 20 : k + 20].max() < 0.3 for k in edge)


def faults_of(view, start: float, end: float) -> int:
    """Every fault bit seen in a part of a run."""
    return int(np.bitwise_or.reduce(view.faults[window(start, end)]))


def test_lost_bus_reading_is_reported_and_survived():
    """U_dc reads zero for 30 ms: flag, current model meanwhile, correct afterwards; the flag can be cleared."""
    gain = NOMINAL.values.u_dc_gain
    scene = scenario(
        DRIVE,
        1.2,
        rpm={0.0: 239},
        load={0.0: 1.0},
        start_rpm=239,
        changes={0.4: {"u_dc_gain": 0}, 0.43: {"u_dc_gain": gain}},
    )
    clear = np.zeros(len(scene), np.int64)
    clear[round(1.1 / T_S)] = 1
    view = run(dataclasses.replace(scene, clear_faults=clear))
    assert faults_of(view, 0.2, 0.4) == 0
    assert faults_of(view, 0.401, 0.41) & BUS and faults_of(view, 0.9, 1.09) & BUS
    assert max(np.abs(view.estimate[x]).max() for x in "dq") < 3 * LAMBDA_N
    assert mean_error(view, window(0.9, 1.0)) < 0.2
    assert faults_of(view, 1.11, 1.2) == 0


def test_saturated_current_converter_is_reported_and_survived():
    """A load beyond the converters' range for 0.3 s: flag, bounded, correct again when the current is back in range."""
    small = NOMINAL.values._replace(**{f"gain_{x}": round(65536 * 3.0 / 12.5) for x in "abc"})
    sensors = Sensors(current_bits=16, current_full_scale_a=3.0, u_dc_bits=16, u_dc_full_scale_v=1000, position_bits=16)
    scene = scenario(DRIVE, 1.5, rpm={0.0: 600}, load={0.0: 1.0, 0.4: 3.6, 0.7: 1.0}, start_rpm=600)
    clear = np.zeros(len(scene), np.int64)
    clear[round(0.15 / T_S)] = 1  # the start on the fly exceeds 3 A as well
    scene = dataclasses.replace(scene, clear_faults=clear)
    view = run(scene, NOMINAL._replace(values=small), sensors=sensors)
    assert faults_of(view, 0.2, 0.4) == 0
    assert faults_of(view, 0.41, 0.7) & CURRENT and view.faults[-1] & CURRENT
    assert max(np.abs(view.estimate[x]).max() for x in "dq") < 4 * LAMBDA_N
    assert mean_error(view, window(1.4, 1.5)) < 0.2


def test_wrong_parameters_are_reported_and_survived():
    """Inductances at the end of their registers for 0.1 s: limits, flags, no wrap, correct afterwards."""
    values = NOMINAL.values
    absurd = {"l_d": (1 << 24) - 1, "l_q": (1 << 24) - 1, "lambda_mg": 131071}
    scene = scenario(
        DRIVE,
        1.2,
        rpm={0.0: 400},
        load={0.0: 2.0},
        start_rpm=400,
        changes={0.4: absurd, 0.5: {name: getattr(values, name) for name in absurd}},
    )
    view = run(scene)
    assert faults_of(view, 0.2, 0.4) == 0 and faults_of(view, 0.41, 0.5) & (MODEL | MERGE | COMPENSATION)
    assert mean_error(view, window(1.1, 1.2)) < 0.2


def test_no_wrapping_operation_in_the_estimators():
    """Only angles wrap; an estimator that called wrap() would need the word-length analysis to say why."""
    for path in sorted((ROOT / "golden_model" / "estimators").glob("*.py")):
        assert "wrap" not in path.read_text().replace("never a wrap", ""), path.name


def test_flux_bandwidth_between_the_loops():
    path = PAPER
    drive = drives.load(path)
    for hz in (20.0, 600.0):
        control = dataclasses.replace(drive.control, flux_bandwidth_hz=hz)
        with pytest.raises(DriveError, match="flux_bandwidth_hz.*above speed_bandwidth_hz = 30 Hz"):
            dataclasses.replace(drive, control=control)
    control = dataclasses.replace(drive.control, flux_bandwidth_hz=100.0)
    rows = {row.name: row for row in registers(dataclasses.replace(drive, control=control)).rows}
    assert rows["flux_ki"].si == pytest.approx(2 * np.pi * 100)
    tau = (1.53 + 2 * np.pi * 500 * 15.94e-3) / (2 * np.pi * 500 * 1.53)
    assert rows["flux_kp"].si == pytest.approx(2 * np.pi * 100 * tau, rel=1e-3)


def test_estimator_runs_parallel_to_the_control_path():
    """The estimate is ready before the current regulators' output, and the voltage limit waits for the decoupling by it
    no longer than for the dead-time compensation; all results are there before the next sample may enter."""
    times = fluxproof.schedule()
    assert times["flux"][1] < times["current_regulators"][1]
    assert times["cross_coupling"][1] <= times["compensation_dq"][1] - 1
    assert fluxproof.SAMPLE_TO_DUTY <= 40 and fluxproof.SAMPLE_INTERVAL <= 64
