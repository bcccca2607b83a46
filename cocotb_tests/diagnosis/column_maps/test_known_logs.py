# SPDX-License-Identifier: BSD-3-Clause
"""Ready-made maps of the columns of known loggers."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import U_DC, codes, dq_made, nominal_of, write
from fluxproof.diagnosis.column_maps import maps
from fluxproof.diagnosis.ground.recording import COLUMNS, RecordingError
from fluxproof.diagnosis.loading.load import load_recording


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


LOGS = {
    "VESC Tool": (
        "ms_today=t*1000 d_axis_current=i_d q_axis_current=i_q d_axis_voltage=u_d_ref q_axis_voltage=u_q_ref"
        " erpm=omega_e*9.549296585513721 input_voltage=u_dc",
        {"fault_code": "FAULT_CODE_NONE"},
    ),
    "moteus": (
        "timestamp=t servo_stats.d_A=i_d servo_stats.q_A=i_q servo_control.d_V=u_d_ref servo_control.q_V=u_q_ref"
        f" servo_stats.velocity=omega_e*{1 / 8 / np.pi}",
        {},
    ),
    "moteus registers": (
        "time=t D_CURRENT=i_d Q_CURRENT=i_q VOLTAGE_DQ_D=u_d_ref VOLTAGE_DQ_Q=u_q_ref VOLTAGE=u_dc"
        f" VELOCITY=omega_e*{1 / 8 / np.pi}",
        {},
    ),
    "ODrive": (
        "time=t odrv0.axis0.motor.foc.Id_measured=i_d odrv0.axis0.motor.foc.Iq_measured=i_q odrv0.vbus_voltage=u_dc"
        " odrv0.axis0.motor.foc.v_current_control_integral_d=u_d_ref"
        " odrv0.axis0.motor.foc.v_current_control_integral_q=u_q_ref"
        f" odrv0.axis0.encoder.vel_estimate=omega_e*{1 / 8 / np.pi}",
        {},
    ),
    "pyvesc": (
        "time=t avg_id=i_d avg_iq=i_q avg_vd=u_d_ref avg_vq=u_q_ref rpm=omega_e*9.549296585513721 v_in=u_dc",
        {"avg_motor_current": 3.0, "temp_fet": 40.0},
    ),
    "SimpleFOC monitor": (
        "Time=t voltageQ=u_q_ref voltageD=u_d_ref currentQ=i_q*1000 currentD=i_d*1000 velocity=omega_e*0.25",
        {"target": 5.0, "angle": 1.0},
    ),
    "Kaggle electric motor temperature": (
        f"u_q=u_q_ref u_d=u_d_ref motor_speed=omega_e*{60 / 8 / np.pi} i_d=i_d i_q=i_q",
        {"coolant": 20.0, "stator_winding": 60.0, "pm": 50.0, "profile_id": 17},
    ),
    "WaveSculptor": (
        f"t_s=t id_A=i_d iq_A=i_q vd_V=u_d_ref vq_V=u_q_ref n_rpm=omega_e*{60 / 8 / np.pi} u_dc_V=u_dc",
        {"T_motor_C": 33.0},
    ),
    "openinverter": (
        f"time=t id=i_d iq=i_q ud=u_d_ref*{65536 / U_DC} uq=u_q_ref*{65536 / U_DC} udc=u_dc"
        f" fstat=omega_e*{0.5 / np.pi}",
        {"tmpm": 40.0, "opmode": 2.0},
    ),
    "LAAS omodri": ("Time=t Velocity=omega_e*0.25 Iq=i_q Uq=u_q_ref", {"Position": 0.0, "Vsupply": 0.47}),
}


@pytest.mark.parametrize("name", LOGS)
def test_known_logs_are_mapped(tmp_path, nominal, name):
    text, constants = LOGS[name]
    entries = [entry.replace("*", "=").split("=") for entry in text.split()]
    columns = {e[0]: (e[1], float(e[2]) if len(e) > 2 else 1.0) for e in entries}
    table = dq_made(step=0.5 if name.startswith("Kaggle") else 0.01)
    raw = {column: table[canonical] * factor for column, (canonical, factor) in columns.items()} | constants
    recording = load_recording(write(tmp_path / "log.csv", raw, sep=";"), nominal)
    assert recording.meta["map"] == name and recording.slow and not recording.fatal
    assert set(codes(recording)) <= {"slow_sampling"}
    for canonical, _ in columns.values():
        np.testing.assert_allclose(recording[canonical], table[canonical], rtol=1e-9, atol=1e-9)
    if name.startswith("Kaggle"):
        np.testing.assert_allclose(recording["t"], table["t"])
    assert all(p.column in (*COLUMNS, "") for p in recording.problems)


def test_every_map_is_tested():
    untried = {"Paderborn inverter data set"}
    assert {m.NAME for m in maps()} - untried == set(LOGS)
    for known in maps():
        for canonical, unit in known.COLUMNS.values():
            assert canonical in COLUMNS, (known.NAME, unit)


def test_runs_of_a_log_are_kept_apart(tmp_path, nominal):
    table = dq_made(step=0.5)
    raw = {"u_q": table["u_q_ref"], "u_d": table["u_d_ref"], "motor_speed": table["omega_e"] * 60 / 8 / np.pi}
    raw |= {
        "i_d": table["i_d"],
        "i_q": table["i_q"],
        "stator_winding": 50.0,
        "profile_id": np.repeat([4, 9], 1000),
    }
    recording = load_recording(write(tmp_path / "log.csv", raw), nominal)
    assert list(np.flatnonzero(~recording.joined)) == [999, 1999]
    assert codes(recording) == ["slow_sampling"]


def test_the_inverter_data_set_is_refused_with_its_reason(tmp_path, nominal):
    names = (
        [f"{s}_{x}_k{d}" for s in "i" for x in "abc" for d in ("", "-1")] + [f"d_{x}_k-2" for x in "abc"] + ["u_dc_k"]
    )
    with pytest.raises(RecordingError, match="missing the angle theta_e.*induction motor"):
        load_recording(write(tmp_path / "r.csv", {name: np.arange(500.0) for name in names}), nominal)


@pytest.mark.parametrize("column", ["torque", "TORQUE", "servo_stats.torque_Nm"])
def test_a_torque_that_a_controller_computes_is_not_one_of_the_shaft(tmp_path, nominal, column):
    """It would confirm the torque constant from which it was computed."""
    table = dq_made()
    names = {"t": "time", "i_d": "D_CURRENT", "i_q": "Q_CURRENT", "u_d_ref": "VOLTAGE_DQ_D", "u_q_ref": "VOLTAGE_DQ_Q"}
    log = {names[name]: table[name] for name in names} | {"VELOCITY": table["omega_e"] / 8 / np.pi}
    if column.startswith("servo"):
        log = {"time": table["t"], "servo_stats.d_A": table["i_d"], "servo_stats.q_A": table["i_q"],
               "servo_control.d_V": table["u_d_ref"], "servo_control.q_V": table["u_q_ref"],
               "servo_stats.velocity": table["omega_e"] / 8 / np.pi}  # fmt: skip
    recording = load_recording(write(tmp_path / "log.csv", log | {column: 0.2 * table["i_q"]}), nominal)
    assert "torque" not in recording.columns
    assert any("the controller computes it" in note for note in recording.meta["notes"])
