# SPDX-License-Identifier: BSD-3-Clause
"""Telemetry dumps and their replay: equal without a fault, and the correct block and sample for one wrong bit.

The expected location is computed here from full replays of both variants, without the code under test.
"""

from __future__ import annotations

import dataclasses
import json
import struct

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.dumps import OWNERS, first_row, recording
from cocotb_tests.support.slow import halved
from fluxproof.cosim.golden_loop import run_controller
from fluxproof.cosim.inside import LEFT_OUT
from fluxproof.cosim.scenarios import everything
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError, from_columns
from fluxproof.diagnosis.replay import digital, telemetry
from fluxproof.diagnosis.replay import flow as digital_flow
from fluxproof.diagnosis.replay import local as digital_local
from fluxproof.diagnosis.replay.capture import capture
from fluxproof.diagnosis.replay.trims import as_ran
from fluxproof.plant import Inverter
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.io import telemetry_words
from golden_model.registers import registers
from golden_model.units import from_si, to_si

DRIVE = drives.load(PAPER)
DRIVE = dataclasses.replace(DRIVE, machine=dataclasses.replace(DRIVE.machine, resistance_temp_coeff_per_k=0.0039))
SET = registers(DRIVE)
FIELDS = fluxproof.Observed._fields
LIMITS = ("t_max", "i_max", "v_comp_max", "delta_max", "v_thr", "i_learn")
# Without influence on the recorded signals
SILENT = ("omega_given", "dead_time", "charge_samples", "t_min", "v_comp_max")
SILENT += ("watchdog", "i_trip", "sum_trip", "rail_samples", "u_dc_min", "u_dc_max", "jump_max", "fault_ignore")
SILENT += ("omega_trip", "omega_away", "runaway_samples", "omega_stall", "stall_samples", "i_open", "offset_max")
SILENT += ("way_stall", "heartbeat", "brake_off", "emf_min", "emf_l", "emf_i", "emf_w", "emf_samples", "regen_start")
SILENT += tuple(name for name in fluxproof.REGISTERS if name.startswith("residual_"))  # the recorded core has none
SILENT += ("position_mode", "position_kp", "position_band", "omega_most", "position_target", "move_speed", "move_step")
SILENT += ("jerk_bits", "use_stops", "stop_low", "stop_high", "torque_lead", "k_inertia", "k_viscous", "coulomb")
SILENT += ("use_table", "k_flux", "u_share", "k_voltage", "share_min", "k_torque", "omega_learn", "torque_step")
SILENT += ("table_word",)  # without the torque table
SILENT += ("voltage_mode", "u_d_ext", "u_q_ext", "u_step", "i_step", "omega_step")  # without the modes
SILENT += ("k_ripple",)  # without over-modulation
SILENT += tuple(name for name in fluxproof.REGISTERS if name.startswith("gear_"))  # without gearing
# Of these registers a recording has what each sample had; one without these signals is replayed with the registers.
TOLD = {"speed_given": "speed_was_given", "position_restart": "position_restarted"}


@pytest.fixture(scope="module")
def run():
    """(samples, observed, last state) of a scenario with all functions, with a warming winding."""
    scenario = everything(DRIVE)
    warm = np.linspace(25.0, 90.0, len(scenario))
    warm[1000:1100] = np.nan
    legs = Inverter(dead_time_s=2e-6, zero_current_a=0.05)
    return capture(DRIVE, SET, dataclasses.replace(scenario, temp_winding=warm), inverter=legs)


def dump(path, run, part=slice(None), names=FIELDS, **options):
    samples, observed, _ = run
    seen = {name: observed[name][part] for name in names}
    return telemetry.write_dump(path, DRIVE, SET, samples[part], seen, **options)


def replayed(samples, values=SET.values, state=None):
    """All outputs of the golden model, (n, 57), and its last state."""
    observed = np.zeros((len(samples), len(FIELDS)), np.int64)
    state = run_controller(state or fluxproof.State(), np.ascontiguousarray(samples), values, SET.config, observed)
    return observed, fluxproof.State(*state)


@pytest.mark.parametrize("names", [FIELDS, telemetry_words.PACKET], ids=["all signals", "packet"])
def test_correct_dump_has_no_difference(names, run, tmp_path):
    got, notes = digital.replay(recording(dump(tmp_path / "a.dump", run, names=names)))
    assert got.checked and got.samples == len(run[0]) == 2500 and got.first_difference is None
    assert f"{len(names)} signals" in notes[0]


def test_dump_from_the_middle_of_a_run_with_its_state_has_no_difference(run, tmp_path):
    samples, _, _ = run
    _, state = replayed(samples[:700])
    path = dump(tmp_path / "a.dump", run, slice(700, None), counter=np.arange(700, 2500), first_state=state)
    got, _ = digital.replay(recording(path))
    assert got.checked and got.samples == 1800 and got.first_difference is None


def test_columns_equal_the_converter_values(run, tmp_path):
    samples, observed, _ = run
    columns, meta = telemetry.read_dump(dump(tmp_path / "a.dump", run))
    assert telemetry.is_dump(tmp_path / "a.dump") and not telemetry.is_dump(PAPER) and not telemetry.is_dump(tmp_path)
    assert meta["registers"] == SET.values._asdict() and meta["start"] == "reset" and not meta["gaps"]
    for name in ("i_a", "i_b", "i_c", "u_dc"):
        lsb = to_si(name, 1, DRIVE)
        np.testing.assert_allclose(columns[name], observed[name] * lsb, atol=0.51 * lsb)
    np.testing.assert_allclose(columns["theta_e"], to_si("theta_me", observed["theta_me"], DRIVE))
    np.testing.assert_allclose(columns["t"], np.arange(2500) * 1e-4)
    np.testing.assert_array_equal(columns["d_b"], observed["compare_b"] / 10000)
    assert np.isnan(columns["temp_winding"][1000:1100]).all()
    assert columns["temp_winding"][999] == pytest.approx(50.98, abs=0.02)
    assert columns["i_q_ref"][1475] == pytest.approx(-1.5, abs=1e-4)
    assert np.corrcoef(columns["omega_e"], np.gradient(np.unwrap(columns["theta_e"]), 1e-4))[0, 1] > 0.99
    # Without the core's speed: the angle's.
    chord, _ = telemetry.read_dump(dump(tmp_path / "b.dump", run, names=("compare_a", "compare_b", "compare_c")))
    assert np.abs(chord["omega_e"] - columns["omega_e"]).mean() < 10.0


@pytest.mark.parametrize("name", halved(fluxproof.REGISTERS))
def test_a_flipped_register_names_its_block_and_sample(name, run, tmp_path):
    samples, _, _ = run
    bit = 3 if fluxproof.REGISTERS[name].fmt.width > 3 else 0
    if name in LIMITS:  # a little more or less changes nothing in most recordings
        bit = abs(getattr(SET.values, name)).bit_length() - 1
    changed = SET.values._replace(**{name: getattr(SET.values, name) ^ (1 << bit)})
    seen = {n: column for n, column in run[1].items() if name not in TOLD or n not in TOLD.values()}
    path = telemetry.write_dump(tmp_path / "a.dump", DRIVE, SET._replace(values=changed), samples, seen)
    shown = [FIELDS.index(n) for n in seen]
    wanted = first_row(replayed(samples)[0][:, shown], replayed(samples, changed)[0][:, shown])
    got, _ = digital.replay(recording(path))
    if wanted is None:
        assert got.first_difference is None, "the register does nothing in this recording"
        assert name in SILENT
        return
    found = got.first_difference
    assert found["sample"] == got.samples == wanted
    assert found["block"] in OWNERS[name], found
    assert found["cause"]["kind"] == "register" and found["cause"]["name"] == name
    assert bit in found["cause"]["bits"] and found["cause"]["explains_rows_to"] == 2500
    if found["cause"]["bit"] == bit:
        assert found["cause"]["behaved_as"] == getattr(SET.values, name)


@pytest.mark.parametrize("names", [FIELDS, telemetry_words.PACKET], ids=["all signals", "packet"])
@pytest.mark.parametrize(("name", "block"), [
    ("kp_q", "current_pi"), ("k_delay", "svm_delay_compensation"), ("min_pulse", "pwm_compare"),
    ("omega_0", "flux_merge"), ("k_ramp", "speed_reciprocal"), ("k_ahead", "current_directions"),
    ("r_s", "winding_resistance"), ("eta_psi", "psi_adaline"), ("speed_ki", "speed_pi"),
])  # fmt: skip
def test_registers_of_hidden_blocks(name, block, names, run, tmp_path):
    """Bit 4: most outputs of these blocks are not in the packet, and they are named nevertheless."""
    changed = SET.values._replace(**{name: getattr(SET.values, name) ^ 16})
    samples, observed, _ = run
    seen = {n: observed[n] for n in names}
    path = telemetry.write_dump(tmp_path / "a.dump", DRIVE, SET._replace(values=changed), samples, seen)
    found = digital.replay(recording(path))[0].first_difference
    assert found["block"] == block and found["cause"]["name"] == name


@pytest.mark.parametrize(("signal", "bit", "block"), [
    ("i_b", 0, "current_conditioning"), ("theta_me", 17, "position"), ("omega_me", 2, "speed"), ("i_q", 1, "park"),
    ("u_int_d", 20, "current_pi"), ("u_q", 0, "voltage_limit"), ("duty_c", 5, "svm"), ("compare_a", 3, "pwm_compare"),
    ("lambda_m_beta", 0, "flux_merge"), ("v_dead", 1, "v_dead_adaline"), ("u_comp_q", 0, "park"),
    ("torque", 7, "torque"), ("flux_faults", 4, "flux_monitor"),
])  # fmt: skip
@pytest.mark.parametrize("row", [0, 1234, 2499])
def test_flipped_output(signal, bit, block, row, run, tmp_path):
    samples, observed, last = run
    changed = {name: values.copy() for name, values in observed.items()}
    changed[signal][row] ^= 1 << bit
    got, _ = digital.replay(recording(dump(tmp_path / "a.dump", (samples, changed, last))))
    found = got.first_difference
    assert (found["block"], found["sample"], found["signal"], found["bit"]) == (block, row, signal, bit)
    assert found["recorded"] == digital.hexadecimal(int(changed[signal][row]))
    assert found["golden"] == digital.hexadecimal(int(observed[signal][row])) and found["differing"] == [signal]
    assert found["cause"]["kind"] == "record"
    assert found["golden_si"] == pytest.approx(to_si(signal, int(observed[signal][row]), DRIVE))


def test_a_signal_of_a_block_that_the_core_has_not_is_zero(run, tmp_path):
    """A bit flipped in a file ended in an IndexError."""
    samples, observed, last = run
    changed = observed | {"residual_sum": np.zeros(len(samples), np.int64)}
    changed["residual_sum"][700] = 4
    found = digital.replay(recording(dump(tmp_path / "a.dump", (samples, changed, last))))[0].first_difference
    assert (found["signal"], found["sample"], found["golden"]) == ("residual_sum", 700, digital.hexadecimal(0))


@pytest.mark.parametrize(("field", "bit", "block"), [
    ("adc_a", 4, "current_conditioning"), ("adc_u_dc", 9, "u_dc_conditioning"), ("position_code", 5, "position"),
    ("omega_ref", 8, "speed_pi"), ("i_d_ref", 6, "current_limit"), ("temp_winding", 9, "winding_resistance"),
])  # fmt: skip
def test_a_flipped_raw_value(field, bit, block, run, tmp_path):
    samples, observed, last = run
    changed, row = samples.copy(), 400
    changed[row, fluxproof.Sample._fields.index(field)] ^= 1 << bit
    wanted = first_row(replayed(samples)[0], replayed(changed)[0])
    found = digital.replay(recording(dump(tmp_path / "a.dump", (changed, observed, last))))[0].first_difference
    late = int(field == "i_d_ref")  # it acts a sample later, see current_limit
    assert found["sample"] == wanted == row + late and found["block"] == block
    cause = found["cause"]
    assert (cause["kind"], cause["name"], cause["bit"], cause["explains_rows_to"]) == (
        "sample",
        field,
        bit,
        2500,
    )
    changed[row, 0] |= 1 << 20  # outside the converter's range
    found = digital.replay(recording(dump(tmp_path / "a.dump", (changed, observed, last))))[0].first_difference
    assert (found["block"], found["signal"], found["sample"]) == ("sample_latch", "adc_a", row)


@pytest.mark.parametrize(("part", "field", "bit", "block"), [
    ("of_speed", "omega", 20, "speed"), ("of_speed_pi", None, 22, "speed_pi"),
    ("of_current_pi", "integral_q", 3, "current_pi"), ("of_flux_merge", None, 12, "flux_merge"),
    ("of_psi_adaline", "psi_m", 25, "psi_adaline"), ("lambda_m_alpha", None, 16, "flux_park"),
    ("s_beta", None, 16, "dead_time_compensation"), ("compare_b", None, 7, "applied_voltage"),
    ("v_comp", None, 6, "dead_time_compensation"),
])  # fmt: skip
def test_a_flipped_start_state(part, field, bit, block, run, tmp_path):
    samples, _, _ = run
    _, state = replayed(samples[:700])
    inner = getattr(state, part)
    if isinstance(inner, tuple):
        field = field or inner._fields[0]
        flipped = inner._replace(**{field: getattr(inner, field) ^ (1 << bit)})
    else:
        flipped = inner ^ (1 << bit)
    changed = state._replace(**{part: flipped})
    rest = slice(700, None)
    wanted = first_row(replayed(samples[rest], state=state)[0], replayed(samples[rest], state=changed)[0])
    path = dump(tmp_path / "a.dump", run, rest, counter=np.arange(700, 2500), first_state=changed)
    found = digital.replay(recording(path))[0].first_difference
    assert found["sample"] == wanted and found["counter"] == wanted + 700
    assert found["block"] == block
    assert found["cause"]["kind"] == "start_state" and found["cause"]["name"].startswith(part)


def test_two_wrong_registers_name_the_first_block_that_shows(run, tmp_path):
    """No single bit explains it: the block where it appears is named, with the hidden ones upstream."""
    changed = SET.values._replace(kp_d=SET.values.kp_d ^ 24, kp_q=SET.values.kp_q ^ 24)
    path = telemetry.write_dump(tmp_path / "a.dump", DRIVE, SET._replace(values=changed), *run[:2])
    found = digital.replay(recording(path))[0].first_difference
    assert found["block"] == "voltage_limit" and found["hidden"] == ["current_regulators"]
    assert found["sample"] == first_row(replayed(run[0])[0], replayed(run[0], changed)[0])


def lost(run, path, start, count, names=FIELDS):
    samples, observed, last = run
    kept = np.r_[0:start, start + count : len(samples)]
    return dump(path, run, kept, names, counter=kept), kept


@pytest.mark.parametrize("start", [0, 300, 1500, 2400])
def test_lost_samples_cause_no_difference(start, run, tmp_path):
    path, kept = lost(run, tmp_path / "a.dump", start, 7)
    found = recording(path)
    assert found.meta["gaps"] == ([(start, 7)] if start else [])
    assert np.flatnonzero(~found.joined).tolist() == ([start - 1] if start else []) + [len(kept) - 1]
    got, notes = digital.replay(found)
    assert got.first_difference is None
    assert got.samples >= start and got.samples <= len(kept)
    if got.samples < len(kept):
        assert "run-in" in " ".join(notes) or "could not be replayed" in " ".join(notes)


@pytest.mark.parametrize(("signal", "block"), [
    ("theta_me", "position"), ("i_q", "park"), ("lambda_q", "flux_estimate"), ("u_dec_d", "decoupling"),
    ("u_beta", "inverse_park"), ("duty_a", "svm"), ("compare_b", "pwm_compare"), ("u_applied_beta", "applied_voltage"),
    ("torque", "torque"),
])  # fmt: skip
def test_stateless_blocks_are_checked_without_a_start_state(signal, block, run, tmp_path):
    samples, observed, last = run
    part, changed = slice(900, 1700), {name: values.copy() for name, values in observed.items()}
    changed[signal][1300] ^= 2
    for answers, wrong in ((observed, False), (changed, True)):
        path = dump(tmp_path / "a.dump", (samples, answers, last), part, counter=np.arange(900, 1700))
        got, notes = digital.replay(recording(path))
        if wrong:
            found = got.first_difference
            assert (found["block"], found["sample"], found["signal"]) == (block, 400, signal)
            assert found["counter"] == 1300 and found["bit"] == 1
        else:
            assert got.first_difference is None and not got.checked
            assert "not recorded" in notes[0] and signal in notes[0]


def test_stateless_checks_equal_the_core(run):
    """Every signal of the list, for all rows, from the recorded ones."""
    from fluxproof.diagnosis.replay.chain import run_of

    one = run_of(run[0], run[1], SET.values._asdict(), SET.config._asdict())
    assert digital_local.check_rows(one, 0, 2500) == (2500, [], {})
    assert set(digital_local.checkable(FIELDS)) == set(digital_local.MADE)


def test_duties_alone_are_compared(run):
    """A recording with raw samples, registers and duty columns, as from a test bench."""
    samples, observed, _ = run
    columns = {f"d_{x}": observed[f"compare_{x}"] / 10000 for x in "abc"} | {"t": np.arange(2500) * 1e-4}
    found = from_columns(columns, 1e-4)
    found.meta = {
        "registers": SET.values._asdict(),
        "config": SET.config._asdict(),
        "samples": samples,
        "start": "reset",
    }
    got, _ = digital.replay(found)
    assert got.checked and got.samples == 2500 and got.first_difference is None
    found.meta["registers"] = found.meta["registers"] | {"kp_d": SET.values.kp_d ^ 32}
    assert digital.replay(found)[0].first_difference["block"] == "current_pi"
    for key in ("registers", "samples"):
        got, notes = digital.replay(dataclasses.replace(found, meta={k: v for k, v in found.meta.items() if k != key}))
        assert not got.checked and key in notes[0]
    assert not digital.replay(from_columns(columns, 1e-4))[0].checked


def test_every_signal_has_one_block_and_the_trace_agrees_with_the_core(run):
    samples, observed, _ = run
    assert set(digital_flow.OWNER) == set(FIELDS)
    state = fluxproof.State()
    for row in range(30):
        sample = fluxproof.Sample(*map(int, samples[row]))
        said = digital_flow.trace(state, sample, SET.values, SET.config)
        for name in FIELDS:
            owner = digital_flow.OWNER[name]
            if owner in LEFT_OUT:
                assert not said[owner] and observed[name][row] == 0, name
                continue
            assert said[owner][digital_flow.outputs_of(owner).index(name)] == observed[name][row], name
        _, state = replayed(samples[: row + 1])


def header_of(path):
    raw = path.read_bytes()
    (length,) = struct.unpack("<I", raw[8:12])
    return raw, length, json.loads(raw[12 : 12 + length])


def test_a_bit_of_a_register_in_the_file_itself(run, tmp_path):
    """Not rejected by the checksum but reported, and found by the replay."""
    path = dump(tmp_path / "a.dump", run)
    raw = bytearray(path.read_bytes())
    at = raw.index(b'"kp_d": ') + 8
    raw[at] ^= 1
    path.write_bytes(raw)
    got, notes = digital.replay(recording(path))
    wanted = SET.values._replace(kp_d=recording(path).meta["registers"]["kp_d"])
    assert got.first_difference["sample"] == first_row(replayed(run[0])[0], replayed(run[0], wanted)[0])
    assert got.first_difference["block"] == "current_pi"
    assert got.first_difference["cause"]["behaved_as"] == SET.values.kp_d
    assert "changed after it was written" in notes[0]


def test_damaged_files_end_in_one_line(run, tmp_path):
    samples, observed, last = run
    path = dump(tmp_path / "a.dump", run, slice(0, 50))
    raw, length, header = header_of(path)
    rng = np.random.default_rng(1)
    wrong = [raw[:n] for n in (0, 5, 8, 11, 12, 12 + length // 2, 12 + length, len(raw) - 1)]
    wrong += [raw + b"\0", b"FLUXDUMP" + rng.bytes(200), rng.bytes(500), raw[:12] + b"[" * length]
    wrong += [raw[:8] + struct.pack("<I", 2**32 - 1) + raw[12:]]
    for key, value in {
        "version": 2, "samples": 51, "fields": [], "config": {}, "sample_time_s": "1e-4", "format": "other",
        "registers": {}, "checksum": {}, "bases": {"current_a": 1.0}, "first_state": [1, 2],
    }.items():  # fmt: skip
        text = json.dumps(header | {key: value}).encode()
        wrong.append(raw[:8] + struct.pack("<I", len(text)) + text + raw[12 + length :])
    for content in wrong:
        path.write_bytes(content)
        with pytest.raises(RecordingError) as caught:
            telemetry.read_dump(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    with pytest.raises(RecordingError, match="cannot be read"):
        telemetry.read_dump(tmp_path / "none.dump")


def test_every_flipped_header_bit_is_detected(run, tmp_path):
    path = dump(tmp_path / "a.dump", run, slice(0, 3))
    raw, length, _ = header_of(path)
    columns, meta = telemetry.read_dump(path)
    rng, kept = np.random.default_rng(2), 0
    for at in rng.integers(8, 12 + length, 800):
        changed = bytearray(raw)
        changed[at] ^= 1 << rng.integers(8)
        path.write_bytes(changed)
        try:
            _, got = telemetry.read_dump(path)
        except RecordingError:
            continue
        assert got["altered"] or (got["registers"], got["scales"]) == (meta["registers"], meta["scales"])
        kept += bool(got["altered"])
    assert kept > 5, "some flips must have hit a register's digits"


def test_the_counter_wraps(run, tmp_path):
    path = dump(tmp_path / "a.dump", run, slice(0, 10), counter=np.arange(2**32 - 5, 2**32 + 5))
    columns, meta = telemetry.read_dump(path)
    assert not meta["gaps"] and meta["start"] == "unknown"
    np.testing.assert_allclose(np.diff(columns["t"]), 1e-4)


def test_references_come_back(run, tmp_path):
    columns, _ = telemetry.read_dump(dump(tmp_path / "a.dump", run))
    wanted = from_si("i_d_ref", -2.0, DRIVE)
    assert columns["i_d_ref"][1350] == pytest.approx(to_si("i_d_ref", wanted, DRIVE))


def test_trims_are_those_that_ran(run, tmp_path):
    """A drive file that was improved since has others: an error found would be trimmed twice."""
    nominal = load_nominal(PAPER)
    made = recording(dump(tmp_path / "a.dump", run))
    assert as_ran(nominal, [made]) == (nominal, {})
    trims = {"theta_offset_rad": -0.5, "current_gain": (1.0, 0.98, 1.0), "u_dc_gain": 1.02}
    mid = 2.0 ** (nominal.sensors.adc_bits - 1)
    trims |= {"current_offset_code": (mid, mid + 2.0, mid), "u_dc_offset_code": 2.0}
    later = dataclasses.replace(nominal, sensors=dataclasses.replace(nominal.sensors, **trims))
    ran, differ = as_ran(later, [made])
    assert set(differ) == set(trims) and differ["theta_offset_rad"][1] == (-0.5,)
    assert ran.sensors.theta_offset_rad == pytest.approx(0.0, abs=1e-4) and ran.sensors.u_dc_offset_code == 0.0
    assert ran.sensors.current_gain == pytest.approx((1.0,) * 3, abs=1e-3)
    assert ran.sensors.current_offset_code == (mid,) * 3 and ran.sensors.u_dc_gain == pytest.approx(1.0, abs=1e-3)
