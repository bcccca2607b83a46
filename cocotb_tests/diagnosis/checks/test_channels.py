# SPDX-License-Identifier: BSD-3-Clause
"""Channels that are stuck, late, of another sign or in codes, and what the rows of a file without a time rest on."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from cocotb_tests.support.drives import BUS, L_D, L_Q, PLAIN, PSI, R
from cocotb_tests.support.recordings.from_equations import T, codes, dq_made, made, nominal_of, write
from fluxproof.diagnosis.checks import check_recording
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.loading.load import load_recording

THIRDS = np.exp(2j * np.pi / 3 * np.arange(3))


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def dq_log():
    """``made`` as a control logs it in dq: references are valid in the middle of their period."""
    x = made()
    turn = np.exp(1j * x["theta_e"])
    i = 2 / 3 * sum(x[f"i_{p}"] * t for p, t in zip("abc", THIRDS, strict=True)) / turn
    u = 2 / 3 * sum(x[f"d_{p}"] * t for p, t in zip("abc", THIRDS, strict=True)) * x["u_dc"] / turn
    u = u * np.exp(-1.5j * x["omega_e"] * T)
    kept = {name: x[name] for name in ("t", "theta_e", "omega_e", "u_dc")}
    return kept | {"i_d": i.real, "i_q": i.imag, "u_d_ref": u.real, "u_q_ref": u.imag}


def stepped():
    """A dq log of a current control at 400 rad/s, with steps of both currents that settle within 20 rows."""
    rng, n, omega = np.random.default_rng(5), 4000, 400.0
    levels = rng.uniform(-4.0, 4.0, (8, 2)) @ np.array([1.0, 1j])
    i = np.repeat(levels, n // 8)
    for k in range(1, n):
        i[k] = i[k - 1] + 0.25 * (i[k] - i[k - 1])
    ahead, mean = np.append(i[1:], i[-1]), 0.5 * (i + np.append(i[1:], i[-1]))
    flux = L_D * mean.real + 1j * L_Q * mean.imag + PSI
    u = R * mean + (L_D * (ahead - i).real + 1j * L_Q * (ahead - i).imag) / T + 1j * omega * flux
    u = np.roll(u, -1)  # in force one period later
    table = {"t": np.arange(n) * T, "theta_e": np.mod(omega * T * np.arange(n), 2 * np.pi)}
    table |= {"omega_e": np.full(n, omega), "u_dc": np.full(n, BUS)}
    noisy = {"i_d": (i.real, 0.004), "i_q": (i.imag, 0.004), "u_d_ref": (u.real, 0.05), "u_q_ref": (u.imag, 0.05)}
    return table | {name: x + size * rng.normal(size=n) for name, (x, size) in noisy.items()}


def load(tmp_path, nominal, table):
    return load_recording(write(tmp_path / "r.parquet", table), nominal)


def from_middle(values, value=None):
    values = values.copy()
    values[2000:] = values[2000] if value is None else value
    return values


@pytest.mark.parametrize("name", ["i_d", "i_q"])
def test_a_dq_current_that_sticks_while_the_other_goes_on(tmp_path, nominal, name):
    table = dq_log()
    recording = load(tmp_path, nominal, table | {name: from_middle(table[name])})
    assert codes(recording) == ["stuck"] and recording.problems[0].column == name
    assert not recording.usable[2000:].any() and recording.usable[:1999].all()


def test_a_dq_current_that_was_never_measured_is_not_stuck(tmp_path, nominal):
    assert "stuck" not in codes(load(tmp_path, nominal, dq_log() | {"i_d": np.zeros(4000)}))


@pytest.mark.parametrize("name, value, code", [("theta_e", None, "stuck"), ("u_dc", 0.0, "u_dc_range")])
def test_half_a_channel_is_no_wrong_machine(tmp_path, nominal, name, value, code):
    table = made()
    recording = load(tmp_path, nominal, table | {name: from_middle(table[name], value)})
    assert codes(recording) == [code] and "restated" not in recording.meta
    assert recording.usable[:1999].all()


@pytest.mark.parametrize("name, rows", [("i_q", 3), ("i_d", 2), ("u_q_ref", 2), ("u_d_ref", 4)])
def test_a_late_column_is_realigned(tmp_path, nominal, name, rows):
    table = stepped()
    late = np.append(np.full(rows, table[name][0]), table[name][:-rows])
    recording = load(tmp_path, nominal, table | {name: late})
    assert codes(recording) == ["late"] and f"{name} is {rows} rows late" in recording.problems[0].message
    np.testing.assert_allclose(recording[name][:-rows], table[name][:-rows])
    assert not recording.usable[-rows:].any()


@pytest.mark.parametrize("late", [0, 1, 2])
def test_both_voltages_late_are_a_delay_of_the_drive(tmp_path, nominal, late):
    table = stepped()
    for name in ("u_d_ref", "u_q_ref"):
        table[name] = np.roll(table[name], late)
    assert "late" not in codes(load(tmp_path, nominal, table))


def test_one_of_two_currents_of_the_wrong_sign(tmp_path, nominal):
    table = made()
    two = {name: values for name, values in table.items() if name != "i_c"} | {"i_b": -table["i_b"]}
    recording = load(tmp_path, nominal, two)
    assert codes(recording) == ["sign"] and recording.problems[0].column == "i_b"
    np.testing.assert_allclose(recording["i_b"], table["i_b"])


def test_currents_in_codes_around_their_middle_are_refused(tmp_path, nominal):
    table = made()
    recording = load(tmp_path, nominal, table | {c: 2048.0 + 100 * table[c] for c in ("i_a", "i_b", "i_c")})
    assert recording.fatal and "codes" in recording.problems[-1].message and "offset" in recording.problems[-1].message


@pytest.mark.parametrize("bits", [12, 16])
def test_the_codes_of_an_encoder_are_an_angle(tmp_path, nominal, bits):
    table = made()
    codes_of = np.round(table["theta_e"] / (2 * np.pi) * 2**bits)
    recording = load(tmp_path, nominal, table | {"theta_e": codes_of})
    assert codes(recording) == ["unit"] and f"{bits} bits" in recording.problems[0].message
    np.testing.assert_allclose(recording["theta_e"], table["theta_e"], atol=2 * np.pi / 2**bits)


def test_an_index_of_moments_without_a_name_is_the_time(tmp_path, nominal):
    table = dq_made()
    stamps = pd.Timestamp("2026-11-20") + pd.to_timedelta(table["t"], unit="s")
    for index in (stamps, pd.to_timedelta(table["t"], unit="s")):
        frame = pd.DataFrame({n: v for n, v in table.items() if n != "t"}).set_index(pd.Index(index))
        frame.to_parquet(tmp_path / "r.parquet")
        recording = load_recording(tmp_path / "r.parquet", nominal)
        np.testing.assert_allclose(recording["t"], table["t"], atol=1e-6)
        assert any("index" in note for note in recording.meta["notes"])


def without(table, *names):
    return {n: v for n, v in table.items() if n not in names}


def test_a_missing_time_is_told_unless_angle_and_speed_confirm_it(tmp_path, nominal):
    assert codes(load(tmp_path, nominal, without(made(), "t"))) == []
    assert codes(load(tmp_path, nominal, without(dq_log(), "t", "theta_e"))) == ["assumed_time"]
    assert codes(load(tmp_path, nominal, without(made(), "t", "omega_e"))) == ["assumed_time"]


def test_a_missing_time_and_sample_time_are_told(tmp_path):
    (tmp_path / "drive.toml").write_text(PLAIN)
    recording = load(tmp_path, load_nominal(tmp_path / "drive.toml"), without(made(), "t"))
    assert codes(recording) == ["assumed_time"] and "sample_time_s is not stated" in recording.problems[0].message


def test_no_angle_shows_no_harmonics(tmp_path, nominal):
    recording = load(tmp_path, nominal, without(dq_log(), "theta_e"))
    assert "harmonics" in recording.lacks and recording.meta["angle"] == "integrated"
    check_recording(recording, nominal)
    assert codes(recording) == []


def test_single_lost_rows_are_filled_where_no_stretch_is_whole(tmp_path, nominal):
    table = made(noise=0.0)
    lost = np.flatnonzero(np.random.default_rng(6).random(3998) < 0.06) + 1
    recording = load(tmp_path, nominal, {n: np.delete(v, lost) for n, v in table.items()})
    assert codes(recording) == ["gap", "lost_rows"] and len(recording) > 3990
    rows = np.round(recording["t"] / T).astype(int)
    assert recording.joined[:-1].sum() >= len(recording) - 20 and np.array_equal(rows, np.unique(rows))
    settled = slice(100, 900)
    for name in ("i_a", "d_b", "theta_e"):
        off = np.abs(recording[name][settled] - table[name][rows[settled]])
        assert np.percentile(off, 98) < 0.01 * np.ptp(table[name])


def test_a_few_lost_rows_are_left_as_gaps(tmp_path, nominal):
    recording = load(tmp_path, nominal, {n: np.delete(v, [700, 1500, 3000]) for n, v in made().items()})
    assert codes(recording) == ["gap"] and len(recording) == 3997


@pytest.mark.parametrize("times, words", [(1.2, "ask for more than the bus gives"), (1.1, "up to six-step")])
def test_references_beyond_the_voltage_limit_are_not_at_the_machine(tmp_path, nominal, times, words):
    """A regulator that is not limited asks for more than the bus gives: its rows are set aside and told."""
    table = dq_made()
    most = table["u_dc"] / np.sqrt(3.0)
    beyond = slice(600, 700)
    table["u_q_ref"][beyond] = times * most[beyond]
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    found = [p for p in recording.problems if p.code == "voltage_limit"]
    assert len(found) == 1 and (found[0].row, found[0].count) == (600, 100) and not recording.fatal
    assert words in found[0].message
    assert not recording.usable[599:701].any() and recording.usable[:590].any()


def test_a_bus_that_was_not_recorded_may_be_higher_than_its_rating(tmp_path, nominal):
    table = dq_made()
    table["u_q_ref"][600:700] = 1.1 * table.pop("u_dc")[600:700] / np.sqrt(3.0)
    assert "voltage_limit" not in codes(load_recording(write(tmp_path / "r.parquet", table), nominal))


def test_references_beyond_the_limit_in_most_rows_have_another_unit(tmp_path, nominal):
    table = dq_made()
    table["u_q_ref"] = 1.2 * table["u_dc"] * np.ones(len(table["t"]))
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    assert "voltage_limit" not in codes(recording)


def blind_above(columns, window, nominal):
    """Currents of legs whose duty leaves no time to sample them are half of what they are."""
    out, delay = dict(columns), nominal.control.duty_applied_after_samples
    for x in "abc":
        late = np.roll(columns[f"d_{x}"], delay) > window
        out[f"i_{x}"] = np.where(late, 0.5 * columns[f"i_{x}"] + 1.0, columns[f"i_{x}"])
    return out


def test_currents_without_a_sampling_window_follow_from_the_other_two(tmp_path, nominal):
    table = made(speed=1250.0)
    highest = np.max([table[f"d_{x}"] for x in "abc"])
    window = highest - 0.04
    assert window > 0.8
    recording = load_recording(write(tmp_path / "r.csv", blind_above(table, window, nominal)), nominal)
    (found,) = [p for p in recording.problems if p.code == "shunt_window"]
    assert float(found.message.split("above ")[1].split()[0]) == pytest.approx(window, abs=0.005)
    for name in ("i_a", "i_b", "i_c"):
        np.testing.assert_allclose(recording[name], table[name], atol=0.1)
    assert codes(load_recording(write(tmp_path / "h.csv", table), nominal)) == []
    offset = table | {"i_a": table["i_a"] + 0.3}  # a sum that is off at all duties is the sensor's
    assert "shunt_window" not in codes(load_recording(write(tmp_path / "o.csv", offset), nominal))


def ridden(n=2000, most_a=np.inf, most_w=np.inf):
    """A log of 20 Hz with random throttle, which a limit of the current or the power cuts off."""
    rng = np.random.default_rng(8)
    t = np.arange(n) * 0.05
    knots = np.arange(0.0, t[-1] + 4.0, 2.0)
    omega = np.interp(t, knots, rng.uniform(50.0, 500.0, len(knots)))
    i_q = np.minimum(np.interp(t, knots, rng.uniform(0.2, 6.0, len(knots))), most_a)
    i_q = np.minimum(i_q, (np.sqrt((omega * PSI) ** 2 + 4 * R * most_w / 1.5) - omega * PSI) / (2 * R))
    table = {"t": t, "i_d": 0 * t, "i_q": i_q, "omega_e": omega}
    table |= {"u_d_ref": -omega * L_Q * i_q, "u_q_ref": R * i_q + omega * PSI, "u_dc": np.full(n, BUS)}
    return {k: v if k in ("t", "u_dc") else v + 0.002 * np.abs(v).max() * rng.normal(size=n) for k, v in table.items()}


@pytest.mark.parametrize("limit", [{"most_a": 4.0}, {"most_w": 250.0}, {}])
def test_rows_at_a_limit_are_told_and_used(tmp_path, nominal, limit):
    recording = load_recording(write(tmp_path / "r.csv", ridden(**limit)), nominal)
    found = [p for p in recording.problems if p.code in ("current_limit", "power_limit")]
    if not limit:
        assert found == []
        return
    ((name, value),) = limit.items()
    (problem,) = found
    assert problem.code == {"most_a": "current_limit", "most_w": "power_limit"}[name] and problem.action == "rows used"
    stated = float(problem.message.split("limit, ")[1].split()[0])
    assert stated == pytest.approx(value, rel=0.02) and recording.usable.all()


def test_the_highest_step_of_a_plan_is_no_limit(tmp_path, nominal):
    locked = dq_made() | {"omega_e": np.zeros(2000)}
    for name, table in {"r.csv": dq_made(), "locked.csv": locked}.items():
        recording = load_recording(write(tmp_path / name, table), nominal)
        assert not {"current_limit", "power_limit"} & set(codes(recording)), name


def warmed(way, n=3000, step_s=0.5):
    """A log of a winding that 4 A warm by 60 K above its housing, and that by 60 K, under a protection or a plan."""
    rng = np.random.default_rng(9)
    t, most, temp = np.arange(n) * step_s, np.full(n, 4.0), np.full(n, 25.0)
    over = housing = 0.0
    for k in range(1, n):
        most[k] = way(t[k], temp[k - 1])
        heat = 60.0 * (most[k] / 4.0) ** 2
        over += step_s / 30.0 * (heat - over)
        housing += step_s / 300.0 * (heat - housing)
        temp[k] = 25.0 + over + housing
    i_q, omega = most + 0.01 * rng.normal(size=n), 200.0 + 100.0 * np.sin(t / 9.0)
    table = {"t": t, "i_d": 0 * t, "i_q": i_q, "omega_e": omega, "temp_winding": np.round(temp, 1)}
    table |= {"u_d_ref": -omega * L_Q * i_q, "u_q_ref": R * (1 + 0.0039 * (temp - 20)) * i_q + omega * PSI}
    return table | {"u_dc": np.full(n, BUS)}


@pytest.mark.parametrize(
    ("way", "after"),
    [
        (lambda t, temp: 4.0 * np.clip((130.0 - temp) / 40.0, 0.0, 1.0), 3.134),  # 120 x^2 = 105 - 40 x
        (lambda t, temp: 4.0 * np.clip((92.0 - temp) / 4.0, 0.0, 1.0), 2.923),  # 120 x^2 = 67 - 4 x
    ],
)
def test_a_current_that_is_reduced_for_the_temperature_is_told(tmp_path, nominal, way, after):
    recording = load(tmp_path, nominal, warmed(way))
    (problem,) = [p for p in recording.problems if p.code == "temperature_limit"]
    assert problem.action == "rows used" and recording.usable.all()
    stated = [float(problem.message.split(word)[1].split()[0]) for word in ("temperature, from ", "A to ")]
    assert stated == pytest.approx([4.0, after], rel=0.03)


@pytest.mark.parametrize(
    "plan",
    [
        lambda t, temp: 4.0,
        lambda t, temp: 4.0 if t < 150.0 else 3.0,
        lambda t, temp: 4.0 - np.clip((t - 10.0) / 60.0, 0.0, 1.0),  # early: the winding warms on at 3 A
        lambda t, temp: 4.0 - np.clip((t - 600.0) / 200.0, 0.0, 1.0),  # late: it cools
        lambda t, temp: 4.0 - np.clip(t / 1200.0, 0.0, 1.0),
    ],
)
def test_a_plan_that_lowers_the_current_is_no_limit_of_temperature(tmp_path, nominal, plan):
    assert "temperature_limit" not in codes(load(tmp_path, nominal, warmed(plan)))


def test_a_speed_in_counts_a_second_is_refused(tmp_path, nominal):
    table = dq_made()
    recording = load_recording(write(tmp_path / "r.csv", table | {"omega_e": 8192.0 * table["omega_e"]}), nominal)
    assert [p.code for p in recording.problems if p.fatal] == ["speed_range"]
    assert "such as counts a second" in recording.problems[-1].message
