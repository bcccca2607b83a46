# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a recording: [columns] of drive.toml, ready-made maps, missing and derived columns."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import tomlkit

from cocotb_tests.support.recordings.from_equations import codes, dq_made, made, nominal_of, write
from fluxproof.diagnosis.conventions.apply import edit
from fluxproof.diagnosis.conventions.table import READINGS
from fluxproof.diagnosis.ground.recording import COLUMNS, RecordingError
from fluxproof.diagnosis.improve.improve import _set
from fluxproof.diagnosis.ingest.entries import entries_of
from fluxproof.diagnosis.ingest.units import OF_BUS
from fluxproof.diagnosis.ingest.usual_names import NAMES, TOLD_BY_UNIT, usual
from fluxproof.diagnosis.loading.load import load_recording


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def test_columns_of_drive_toml(tmp_path):
    table = made()
    raw = {
        "zeit": table["t"] * 1e6,
        "U": table["i_a"] * 1000 + 50,
        "V [mA]": table["i_b"] * 1000,
        "n": table["omega_e"] / 4,
    }
    raw |= {name: table[name] for name in ("i_c", "theta_e", "u_dc", "d_a", "d_b", "d_c")}
    nominal = nominal_of(
        tmp_path,
        """
zeit = {name = "t", unit = "us"}
U = {name = "i_a", factor = 0.001, offset = -0.05}
V = "i_b"
n = {name = "omega_e", unit = "rad/s mech"}
""",
    )
    recording = load_recording(write(tmp_path / "r.csv", raw), nominal)
    assert codes(recording) == [] and recording.meta["map"] == "[columns]"
    for name, values in table.items():
        np.testing.assert_allclose(recording[name], values, rtol=1e-9, atol=1e-9)


WRONG_COLUMNS = {
    'i_a = "i_z"': ("'i_a'", "'i_z' is not a canonical name", "nearest"),
    "i_a = 4": ("'i_a'", "must be a canonical name or a table"),
    'i_a = {name = "i_a", unit = "furlong"}': ("unit 'furlong' is unknown for i_a", "mA"),
    'i_a = {name = "i_a", unit = "mA", factor = 2}': ("either unit",),
    'i_a = {name = "i_a", gain = 2}': ("unknown key 'gain'",),
    'i_a = {name = "i_a", factor = 0}': ("must not be 0",),
    'i_a = {name = "i_a", factor = nan}': ("finite number",),
    'i_a = "i_a"\ni_x = "i_b"': ("'i_x' is not a column of", "nearest"),
    'i_a = "i_a"\ni_b = "i_a"': ("i_a is already assigned to 'i_a'",),
}


@pytest.mark.parametrize("lines", WRONG_COLUMNS)
def test_wrong_columns_name_the_entry(tmp_path, lines):
    with pytest.raises(RecordingError) as error:
        load_recording(write(tmp_path / "r.csv", made(500)), nominal_of(tmp_path, lines))
    message = str(error.value)
    assert "[columns]" in message and "\n" not in message
    for word in WRONG_COLUMNS[lines]:
        assert word in message


def test_an_option_names_a_column(tmp_path):
    assert entries_of(["Dev1_ai0=u_ab", "n = omega_e [rpm]", "a=b=i_q", "Spare="]) == {
        "Dev1_ai0": "u_ab", "n": {"name": "omega_e", "unit": "rpm"}, "a=b": "i_q", "Spare": "",
    }  # fmt: skip
    for text in ("u_ab", "Dev1_ai0=u_xy", "=u_ab"):
        with pytest.raises(RecordingError, match="--column .* expected NAME=CANONICAL"):
            entries_of([text])


def test_a_mapped_column_has_the_unit_in_its_name(tmp_path):
    nominal = nominal_of(tmp_path, 'omega_e_rad_s = "omega_e"\nia_mA = "i_a"')
    table = made(500)
    raw = {{"omega_e": "omega_e_rad_s", "i_a": "ia_mA"}.get(name, name): values for name, values in table.items()}
    recording = load_recording(write(tmp_path / "r.csv", raw | {"ia_mA": 1e3 * table["i_a"]}), nominal)
    assert {"omega_e", "i_a"} <= set(recording.meta["stated_units"])
    np.testing.assert_allclose(recording["i_a"], table["i_a"], rtol=1e-9, atol=1e-9)


def test_files_of_several_loggers_share_the_columns(tmp_path):
    nominal = nominal_of(tmp_path, '"I U [mA]" = "i_a"\n"Motor current U" = "i_a"')
    table = made(500)
    i_a = table.pop("i_a")
    for name, values in {"I U [mA]": i_a * 1e3, "Motor current U": i_a}.items():
        recording = load_recording(write(tmp_path / "r.csv", {**table, name: values}), nominal)
        np.testing.assert_allclose(recording["i_a"], i_a, rtol=1e-9, atol=1e-9)


def test_a_torque_of_unknown_name_is_noted(tmp_path, nominal):
    table = made(500)
    recording = load_recording(write(tmp_path / "r.csv", {**table, "flange [Nm]": 0.0 * table["i_a"]}), nominal)
    assert "column 'flange [Nm]' is not used; if it is torque, assign it in [columns]" in recording.meta["notes"]
    spare = nominal_of(tmp_path, '"flange [Nm]" = ""\ni_a = "i_a"')
    recording = load_recording(write(tmp_path / "r.csv", {**table, "flange [Nm]": 0.0 * table["i_a"]}), spare)
    assert not any("is not used" in note for note in recording.meta["notes"])


BENCHES = {  # header: canonical column, and how much larger its values are
    "German": {
        "Zeit [ms]": ("t", 1e3), "Id [A]": ("i_d", 1.0), "Iq [A]": ("i_q", 1.0),
        "n [U/min]": ("omega_e", 60 / 8 / np.pi),
        "Ud_soll [V]": ("u_d_ref", 1.0), "Uq_soll [V]": ("u_q_ref", 1.0), "U_ZK [V]": ("u_dc", 1.0),
    },
    "CAN": {
        "time_ms": ("t", 1e3), "id_mA": ("i_d", 1e3), "iq_mA": ("i_q", 1e3), "speed_rpm": ("omega_e", 60 / 8 / np.pi),
        "ud_ref_mV": ("u_d_ref", 1e3), "uq_ref_mV": ("u_q_ref", 1e3), "vbus_mV": ("u_dc", 1e3),
    },
    "controller": {
        "Timestamp": ("t", 1.0), "Id-meas": ("i_d", 1.0), "Iq-meas": ("i_q", 1.0), "IdRef": ("i_d_ref", 1.0),
        "Drehzahl (1/min)": ("omega_e", 60 / 8 / np.pi), "Vd [V]": ("u_d_ref", 1.0), "Vq [V]": ("u_q_ref", 1.0),
        "Channel D (Vdc)": ("u_dc", 1.0),
    },
    "Simulink": {
        "xAxis [s]": ("t", 1.0), "id_meas": ("i_d", 1.0), "iq_meas": ("i_q", 1.0),
        "wm_rpm": ("omega_e", 60 / 8 / np.pi),
        "vd_ref": ("u_d_ref", 1.0), "vq_ref": ("u_q_ref", 1.0), "Vdc": ("u_dc", 1.0),
    },
    "LabVIEW": {
        "X_Value": ("t", 1.0), "Id": ("i_d", 1.0), "Iq": ("i_q", 1.0), "omega_m (rad/s)": ("omega_e", 1 / 4),
        "Vd": ("u_d_ref", 1.0), "Vq": ("u_q_ref", 1.0), "Vbus": ("u_dc", 1.0),
    },
    "electrical": {
        "elapsed": ("t", 1.0), "Id": ("i_d", 1.0), "Iq": ("i_q", 1.0), "f_el (Hz)": ("omega_e", 0.5 / np.pi),
        "Vd": ("u_d_ref", 1.0), "Vq": ("u_q_ref", 1.0), "Vbus": ("u_dc", 1.0),
    },
}  # fmt: skip


@pytest.mark.parametrize("bench", BENCHES)
def test_usual_names_of_dq_logs(tmp_path, nominal, bench):
    table = dq_made()
    table["i_d_ref"], table["u_dc"] = table["i_d"], np.full(len(table["t"]), 563.0)
    raw = {header: table[name] * factor for header, (name, factor) in BENCHES[bench].items()}
    recording = load_recording(write(tmp_path / "log.csv", raw, sep=";"), nominal)
    for name, _ in BENCHES[bench].values():
        np.testing.assert_allclose(recording[name], table[name], rtol=1e-9, atol=1e-9)
    (note,) = (note for note in recording.meta["notes"] if "usual names" in note)
    assert all(f"from {header!r}" in note for header in raw)


def test_a_known_log_without_its_voltages_has_those_with_usual_names(tmp_path, nominal):
    table = dq_made()
    names = {"t": "ms_today", "i_d": "d_axis_current", "i_q": "q_axis_current", "omega_e": "erpm", "u_d_ref": "vd",
             "u_q_ref": "vq"}  # fmt: skip
    raw = {names[n]: table[n] * {"t": 1e3, "omega_e": 30 / np.pi}.get(n, 1.0) for n in names}
    recording = load_recording(write(tmp_path / "log.csv", raw, sep=";"), nominal)
    for name in ("i_q", "omega_e", "u_d_ref", "u_q_ref"):
        np.testing.assert_allclose(recording[name], table[name], rtol=1e-9, atol=1e-9)


def test_usual_names_of_phases_and_torque(tmp_path, nominal):
    table = made(500) | {"torque": np.linspace(0.0, 3.0, 500)}
    phases = zip("abc", "UVW", strict=True)
    headers = {f"{x}_{old}": f"{new}_{mark}" for old, mark in phases for x, new in (("i", "I"), ("d", "duty"))}
    headers |= {"theta_e": "theta_el [rad]", "u_dc": "Ubat [V]", "torque": "M_Welle [Nm]"}
    raw = {headers.get(name, name): values for name, values in table.items()}
    recording = load_recording(write(tmp_path / "r.csv", raw), nominal)
    for name, values in table.items():
        np.testing.assert_allclose(recording[name], values, rtol=1e-9, atol=1e-9)


def test_names_that_may_mean_something_else_need_their_unit():
    unsure = ("n", "M", "speed", "speed [rad/s]", "M [%]", "T_stator", "theta [deg]", "uv [V]", "I [A]")
    assert [column for column in unsure if usual(column, "")] == []
    assert usual("speed", "rpm")[:2] == ("omega_e", "rpm")  # by a line of units
    assert usual("U_V", "")[0] == "u_b" and usual("u_uv [V]", "")[0] == "u_ab"  # phase V; line U-V
    assert usual("I_A", "")[:2] == ("i_a", "")  # not a current in amperes


IN_WORDS = {  # a header: canonical column and unit
    "rpm": ("omega_e", "rpm"), "Motor Speed / rpm": ("omega_e", "rpm"), "n/min-1": ("omega_e", "min-1"),
    "Electrical speed (rpm)": ("omega_e", "erpm"), "Output Speed (rad/s)": ("omega_e", "rad/s mech"),
    "T measured (Nm)": ("torque", "Nm"), "Output Torque, N.mm": ("torque", "N.mm"),
    "Test motor q-axis current": ("i_q", ""), "QAxisCurrent [A]": ("i_q", "A"), "I_d/A": ("i_d", "A"),
    "Iq setpoint motor (A)": ("i_q_ref", "A"), "q-axis voltage reference (V)": ("u_q_ref", "V"),
    "Motor phase current A": ("i_a", ""), "phase current C (A)": ("i_c", "A"), "Duty cycle phase U [%]": ("d_a", "%"),
    "bus v (V) at drive": ("u_dc", "V"), "DC Link Voltage [V]": ("u_dc", "V"),
    "Test Motor Temperature (Deg C)": ("temp_winding", "Deg C"),
}  # fmt: skip
OF_OTHERS = (
    "Absorber q-axis current", "Test motor FET temp (C)", "Motor drive temperature (C)", "Output Speed set-point (rpm)",
    "Motor ID", "motor speed (rad/s)", "shaft electrical speed (rad/s)", "bus i DC (A)", "battery current (A)",
    "motor phase-phase voltage (V) rms", "brake (V)", "Output Torque", "Motor current (A)",
)  # fmt: skip


def test_names_in_words_are_told_by_every_word():
    for column, expected in IN_WORDS.items():
        assert (usual(column, "") or ())[:2] == expected, column
    assert [column for column in OF_OTHERS if usual(column, "")] == []
    assert usual("Output Torque", "N.mm")[:2] == ("torque", "N.mm")  # by a line of units


def test_two_names_in_words_of_one_quantity(tmp_path, nominal):
    table = dq_made(400)
    twice = table | {"Stator temperature (C)": np.full(400, 30.0), "Winding temperature (C)": np.full(400, 31.0)}
    recording = load_recording(write(tmp_path / "r.csv", twice), nominal)
    assert "temp_winding" not in recording.columns
    assert any("could both be temp_winding: none is used" in note for note in recording.meta["notes"])
    speeds = {k: v for k, v in table.items() if k != "omega_e"} | dict.fromkeys(("Shaft rpm", "Motor rpm"), 9.0)
    with pytest.raises(RecordingError, match="'Motor rpm' and 'Shaft rpm' could both be omega_e"):
        load_recording(write(tmp_path / "s.csv", speeds), nominal)


def test_no_name_is_usual_for_two_columns():
    names = [name for of in NAMES.values() for name in of] + [name for of, _ in TOLD_BY_UNIT.values() for name in of]
    assert len(names) == len(set(names)) and set(NAMES) <= set(COLUMNS)


def test_the_first_of_two_usual_names_counts(tmp_path, nominal):
    table = {name: values for name, values in dq_made(400).items() if name != "u_dc"}
    table["Ubat [V]"], table["Udc [V]"] = np.full(400, 48.0), np.full(400, 563.0)
    recording = load_recording(write(tmp_path / "log.csv", table), nominal)
    assert recording.meta["columns"]["u_dc"] == "Udc [V]"
    table = {("Left/Udc" if name == "Ubat [V]" else name): values for name, values in table.items()}
    with pytest.raises(RecordingError, match=r"'Left/Udc' and 'Udc \[V\]' could both be u_dc"):
        load_recording(write(tmp_path / "log.csv", table), nominal)


def of_index(table, share, bus="u_dc"):
    """A dq log whose voltages are a modulation index."""
    return {**table, **{name: table[name] / (share * table[bus]) for name in ("u_d_ref", "u_q_ref")}}


@pytest.mark.parametrize("unit", OF_BUS)
def test_a_modulation_index_is_told_by_its_unit(tmp_path, unit):
    entries = [f"{name} = {{name = '{name}', unit = '{unit}'}}" for name in ("u_d_ref", "u_q_ref")]
    nominal, table = nominal_of(tmp_path, "\n".join(entries)), dq_made(400)
    log = of_index(table, OF_BUS[unit])
    recording = load_recording(write(tmp_path / "r.csv", log), nominal)
    assert codes(recording) == ["slow_sampling"]
    np.testing.assert_allclose(recording["u_q_ref"], table["u_q_ref"], rtol=1e-9, atol=1e-9)
    log["u_dc"] = ["off"] * len(log["t"])
    with pytest.raises(RecordingError, match="contains no numbers"):
        load_recording(write(tmp_path / "r.csv", log), nominal)
    del log["u_dc"]
    with pytest.raises(RecordingError, match=r"'u_d_ref' is a share of u_dc, which is missing"):
        load_recording(write(tmp_path / "r.csv", log), nominal)


def test_voltages_that_are_a_modulation_index_are_refused_with_the_way_out(tmp_path, nominal):
    recording = load_recording(write(tmp_path / "r.csv", of_index(dq_made(400), 0.5)), nominal)
    message = next(problem.message for problem in recording.problems if problem.fatal)
    assert "modulation index" in message and "unit = 'u_dc/2'" in message
    slow = {**dq_made(400)}  # 1 V at standstill is a voltage
    slow |= {name: 0.02 * slow[name] for name in ("u_d_ref", "u_q_ref", "omega_e")}
    assert not any("index" in p.message for p in load_recording(write(tmp_path / "s.csv", slow), nominal).problems)


def test_a_reading_of_a_modulation_index_goes_into_its_unit(nominal):
    """As u_dc the index is twice what fits: the improved drive says u_dc/2."""
    recording = SimpleNamespace(problems=[], meta={"columns": {"u_q_ref": "m_q"}, "of_bus": ["u_q_ref"]})
    half = next(r for r in READINGS if r.code == "voltages_double")
    document = tomlkit.document()
    edit(document, nominal, [half], recording, _set)
    assert document["columns"]["m_q"] == {"name": "u_q_ref", "unit": "u_dc/2"}
    rms, document = next(r for r in READINGS if r.code == "voltages_rms"), tomlkit.document()
    edit(document, nominal, [rms], recording, _set)
    assert "columns" not in document  # no unit says 1.41 times the bus


@pytest.mark.parametrize(
    "gone, words",
    [
        (("i_a",), ("currents", "i_a, i_b")),
        (("theta_e",), ("the angle theta_e",)),
        (("d_b",), ("voltages", "d_a, d_b, d_c or u_d_ref, u_q_ref")),
        (("i_a", "i_b", "d_a"), ("currents", "voltages")),
    ],
)
def test_missing_columns_are_listed_with_those_found(tmp_path, nominal, gone, words):
    table = {name: v for name, v in made(500).items() if name not in gone}
    if gone == ("i_a",):
        del table["i_b"]
    with pytest.raises(RecordingError) as error:
        load_recording(write(tmp_path / "r.csv", table), nominal)
    for word in (*words, "found columns t, ", "[columns]"):
        assert word in str(error.value)


def test_paths_of_a_model_tree_count_by_their_last_part(tmp_path, nominal):
    table = made(600)
    path = write(tmp_path / "r.csv", {f"Model Root/Control/{name} [{COLUMNS[name]}]": v for name, v in table.items()})
    assert codes(load_recording(path, nominal)) == []
    twice = {"Left/i_a": table["i_a"]} | {f"Right/{name}": v for name, v in table.items()}
    with pytest.raises(RecordingError, match="'Left/i_a' and 'Right/i_a' could both be i_a"):
        load_recording(write(tmp_path / "r.csv", twice), nominal)


def test_missing_columns_are_derived_and_noted(tmp_path, nominal):
    table = made()
    lean = {name: v for name, v in table.items() if name not in ("t", "omega_e", "u_dc", "i_b")}
    recording = load_recording(write(tmp_path / "r.csv", lean), nominal)
    assert codes(recording) == ["assumed_time"]  # no speed confirms it
    notes = " ".join(recording.meta["notes"])
    for word in ("no time column", "omega_e is not recorded", "u_dc is not recorded", "i_b is not recorded"):
        assert word in notes
    np.testing.assert_allclose(recording["t"], table["t"], atol=1e-12)
    np.testing.assert_allclose(recording["omega_e"][50:-50], table["omega_e"][50:-50], rtol=2e-3)
    np.testing.assert_allclose(recording["i_b"], table["i_b"], atol=0.05)


def test_numbered_columns_are_proposed_under_their_usual_names(tmp_path, nominal):
    table = {"t": np.arange(50) * 1e-4} | dict.fromkeys(("id1", "iq1", "vd1", "vq1", "omega"), np.ones(50))
    with pytest.raises(RecordingError) as refused:
        load_recording(write(tmp_path / "r.csv", table), nominal)
    for proposal in (
        "'id1' for i_d",
        "'vd1' for u_d_ref",
        "'vq1' for u_q_ref",
        "'omega' for omega_e if its unit is stated",
    ):
        assert proposal in str(refused.value)


def test_a_speed_without_a_unit_is_proposed_with_one(tmp_path, nominal):
    table = {name: np.ones(50) for name in ("i_d", "i_q", "u_d_ref", "u_q_ref", "n")}
    with pytest.raises(RecordingError, match="'n' for omega_e if its unit is stated"):
        load_recording(write(tmp_path / "r.csv", table), nominal)


def test_a_dyno_sheet_is_told_what_its_missing_voltages_would_add(tmp_path):
    (tmp_path / "dyno.csv").write_text("rpm,i (A),T measured (Nm),bus (A)\n" + "100,1.5,0.2,0.1\n" * 8)
    with pytest.raises(RecordingError, match=r"torque, i_q and omega_e \(a dyno sheet\) give flux and friction"):
        load_recording(tmp_path / "dyno.csv", nominal_of(tmp_path))


REFUSED = {
    "flux map": ("i_d_a i_q_a psi_d_wb psi_q_wb", r"\[plant.machine\] flux_map"),
    "no names": ("1 2 3 4", "one row per operating point"),
    "no voltages": ("t i_d i_q omega_e", "u_q_ref alone would show R and flux.*dyno sheet"),
    "one axis": ("t i_q u_d_ref u_q_ref omega_e", "i_d would show L_d and the angle"),
    "no speed": ("t i_d i_q u_d_ref u_q_ref", "omega_e would show steady effects"),
    "scope": ("TIME CH1 CH2 CH3 CH4", "CH1, CH2, CH3, CH4 are channels of an instrument.*--column CH1=u_ab"),
    "instrument": ("t Dev1_ai0", "'Dev1_ai0' may be terminal voltages.*--column 'Dev1_ai0=u_ab'"),
    "two probes": ("t ai0 ai1", "--column 'ai0=u_ab' --column 'ai1=u_bc'"),
    "supply": ("t i_dc u_dc", "supply alone show nothing.*EMF run"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refusal_says_what_would_do(tmp_path, nominal, kind):
    names, says = REFUSED[kind]
    rows = [",".join(str(0.01 * k + n) for n in range(len(names.split()))) for k in range(60)]
    path = tmp_path / "r.csv"
    path.write_text(("" if kind == "no names" else names.replace(" ", ",") + "\n") + "\n".join(rows) + "\n")
    with pytest.raises(RecordingError, match=says):
        load_recording(path, nominal)
