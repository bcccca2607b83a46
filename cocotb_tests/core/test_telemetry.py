# SPDX-License-Identifier: BSD-3-Clause
"""The telemetry stream end to end: core and stream in GHDL, capture, reader, dump, replay; and damaged captures."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import subprocess

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.in_simulator.telemetry_top import NAME, write_top
from cocotb_tests.support.recordings.dumps import OWNERS, first_row, recording
from fluxproof import dump_capture
from fluxproof.checkout import ROOT, RTL
from fluxproof.command import main
from fluxproof.cosim import ghdl
from fluxproof.cosim.golden_loop import run_controller
from fluxproof.cosim.scenarios import everything
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.replay import digital
from fluxproof.diagnosis.replay.capture import capture as golden_capture
from fluxproof.diagnosis.replay.capture import packets
from fluxproof.diagnosis.replay.telemetry import MAGIC
from fluxproof.diagnosis.replay.telemetry_stream import SIZE, parse, read_capture, write_piece
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.io import telemetry_words
from golden_model.io.telemetry_words import COUNT, FIELDS, HEADER_WORD, LAYOUT, PACKET, pack
from golden_model.registers import registers
from scripts import generate, generate_telemetry

CARRIER_HALF = 72
DEPTH_BITS = 7
DRIVE = drives.load(PAPER)
SET = registers(DRIVE)


@pytest.fixture(scope="module")
def folder():
    """Folder with capture.bin and observed.npz of a run of dut_telemetry."""
    generics = {name.upper(): value for name, value in SET.config._asdict().items()}
    generics |= {"CARRIER_HALF": CARRIER_HALF, "DEPTH_BITS": DEPTH_BITS}
    environment = {
        "FLUXPROOF_DRIVE": str(PAPER),
        "FLUXPROOF_CARRIER_HALF": str(CARRIER_HALF),
        "FLUXPROOF_DEPTH_BITS": str(DEPTH_BITS),
        "FLUXPROOF_SEED": os.environ.get("FLUXPROOF_SEED", "1"),
    }
    module = "cocotb_tests.support.in_simulator.dut_telemetry"
    found = ghdl.run(NAME, module, generics, environment, extra=[write_top()])
    problem = ghdl.failure(found)
    assert problem is None, problem
    return found


@pytest.fixture(scope="module")
def golden():
    """(words (2500, COUNT) uint32, samples, observed) of the scenario in which everything happens, without RTL."""
    samples, observed, _ = golden_capture(DRIVE, SET, everything(DRIVE))
    return packets(samples, observed), samples, observed


def raw(words) -> bytes:
    return np.ascontiguousarray(words, "<u4").tobytes()


def renumbered(words, first):
    """The same packets with the numbers from ``first`` on."""
    words = words.copy()
    words[:, 1] = (first + np.arange(len(words))) % 2**32
    return words


@pytest.mark.slow
def test_stream_to_replay(folder, tmp_path, capsys):
    """The core's own stream: dump, replay equal in every bit; one bit of one register flipped: block and sample."""
    drive = drives.with_carrier(DRIVE, CARRIER_HALF)
    register_set = registers(drive)
    (tmp_path / "registers.json").write_text(
        json.dumps({"registers": register_set.values._asdict(), "generics": register_set.config._asdict()})
    )
    command = ["dump", str(folder / "capture.bin"), "--drive", str(PAPER)]
    command += ["--registers", str(tmp_path / "registers.json"), "-o", str(tmp_path / "run.fluxdump")]
    assert main(command) == 0
    assert "160 samples, numbers 0 to 159, 0 lost" in capsys.readouterr().out
    found = recording(tmp_path / "run.fluxdump")
    observed = np.load(folder / "observed.npz")
    assert all(np.array_equal(found.meta["observed"][name], observed[name]) for name in PACKET)
    got, notes = digital.replay(found)
    assert (got.checked, got.samples, got.first_difference) == (True, 160, None)
    assert f"{len(PACKET)} signals" in notes[0]

    assert main(["diagnose", str(tmp_path / "run.fluxdump"), "--drive", str(PAPER), "--out", str(tmp_path)]) == 0
    assert "controller: 160 samples equal to the golden model in every bit" in capsys.readouterr().out

    acting = 0
    for name in ("kp_q", "gain_a", "theta_offset", "k_delay", "r_s"):
        for bit in (4, 9):
            old = getattr(register_set.values, name)
            change_header(tmp_path, f'"{name}": {old}', f'"{name}": {old ^ 1 << bit}')
            flipped = register_set.values._replace(**{name: old ^ 1 << bit})
            wanted = first_row(
                replayed_packet(found.meta["samples"], register_set.values, register_set.config),
                replayed_packet(found.meta["samples"], flipped, register_set.config),
            )
            said = digital.replay(recording(tmp_path / "flipped.fluxdump"))[0].first_difference
            if wanted is None:
                assert said is None, "the bit does nothing in this recording"
                continue
            acting += 1
            assert said["sample"] == said["counter"] == wanted and said["block"] in OWNERS[name]
            assert said["cause"]["name"] == name and bit in said["cause"]["bits"]
    assert acting >= 8


def change_header(folder, old: str, new: str):
    """run.fluxdump with other words in its header, as flipped.fluxdump."""
    raw = (folder / "run.fluxdump").read_bytes()
    size = int.from_bytes(raw[8:12], "little")
    head = raw[12 : 12 + size].decode()
    assert head.count(old + ",") == 1
    head = head.replace(old + ",", new + ",").encode()
    (folder / "flipped.fluxdump").write_bytes(raw[:8] + len(head).to_bytes(4, "little") + head + raw[12 + size :])


def replayed_packet(samples, values, config):
    """What the packet holds of a replay, (n, len(PACKET))."""
    observed = np.zeros((len(samples), len(fluxproof.Observed._fields)), np.int64)
    run_controller(fluxproof.State(), np.ascontiguousarray(samples), values, config, observed)
    return observed[:, [fluxproof.Observed._fields.index(name) for name in PACKET]]


def test_packet_round_trip(golden):
    words, samples, observed = golden
    (piece,) = parse(raw(words)).pieces
    assert len(piece) == 2500 and piece.lost == 0 and piece.byte == 0
    for column, name in enumerate(fluxproof.Sample._fields):
        np.testing.assert_array_equal(piece.fields[name], samples[:, column])
    for name in PACKET:
        np.testing.assert_array_equal(piece.fields[name], observed[name])
    assert min(piece.fields["sat_q"]) == -1 and max(piece.fields["flux_faults"]) >= 0


def test_field_limits_round_trip():
    """Each field alone at its ends: it comes back, and no other field has moved."""
    for name in FIELDS:
        for value in {LAYOUT[name].port.fmt.lo, LAYOUT[name].port.fmt.hi}:
            values = dict.fromkeys(FIELDS, 0) | {name: value}
            (piece,) = parse(raw([pack(7, values)])).pieces
            assert {n: int(v[0]) for n, v in piece.fields.items()} == values and piece.counter[0] == 7


@pytest.mark.parametrize("cut", [1, 3, 4, 50, 95, 96, 97, 191])
def test_capture_cut_at_any_byte(cut, golden, tmp_path):
    """Bytes of incomplete packets at both ends are skipped; no false difference is reported."""
    words, _, _ = golden
    data = raw(words)[cut:-cut]
    capture = parse(data)
    (piece,) = capture.pieces
    first = -(-cut // SIZE)
    assert piece.counter.tolist() == list(range(first, 2500 - first))
    assert sum(count for _, count in capture.left) == len(data) - SIZE * len(piece)
    if cut in (1, 97):
        got, notes = digital.replay(recording(write_piece(tmp_path / "a.fluxdump", piece, DRIVE, SET)))
        assert got.first_difference is None and "not recorded" in " ".join(notes)


@pytest.mark.parametrize(("start", "whole"), [(1, True), (400, True), (499, True), (530, False), (1500, False)])
def test_capture_started_before_or_during_the_run(start, whole, tmp_path, capsys):
    """Gates off since the reset: replayed completely. Begun in mid-run: only blocks without state, and reported."""
    scenario = everything(DRIVE)
    first = {f.name: getattr(scenario, f.name) for f in dataclasses.fields(scenario)}
    first = {name: v for name, v in first.items() if isinstance(v, np.ndarray)}
    held = {name: np.zeros(500, v.dtype) if name == "enable" else np.full(500, v[0]) for name, v in first.items()}
    longer = {name: np.concatenate((held[name], v)) for name, v in first.items()}
    samples, observed, _ = golden_capture(DRIVE, SET, dataclasses.replace(scenario, **longer))
    path = tmp_path / "capture.bin"
    path.write_bytes(raw(packets(samples, observed)[start:]))
    assert main(["dump", str(path), "--drive", str(PAPER)]) == 0
    assert ("begins with the gates off" if whole else "begins while the drive runs") in capsys.readouterr().out
    got, notes = digital.replay(recording(tmp_path / "capture.fluxdump"))
    assert got.first_difference is None and got.checked == whole
    assert got.samples == (3000 - start if whole else 0)
    assert whole or "Regulators and estimators were not checked" in " ".join(notes)


def test_lost_packets_and_number_wrap(golden, tmp_path):
    """Numbers across 2**32, packets missing before, at and after the wrap: gaps, not differences."""
    words, _, _ = golden
    kept = np.r_[0:90, 97:100, 101:2500]
    (piece,) = parse(raw(renumbered(words, 2**32 - 100)[kept])).pieces
    assert piece.lost == 8 and (piece.counter - piece.counter[0]).tolist() == kept.tolist()
    found = recording(write_piece(tmp_path / "a.fluxdump", piece, DRIVE, SET))
    assert found.meta["gaps"] == [(90, 7), (93, 1)] and found.meta["start"] == "unknown"
    assert digital.replay(found)[0].first_difference is None
    (piece,) = parse(raw(words[kept])).pieces
    found = recording(write_piece(tmp_path / "b.fluxdump", piece, DRIVE, SET))
    got, _ = digital.replay(found)
    assert found.meta["start"] == "reset" and got.checked and got.samples >= 90 and got.first_difference is None


def test_decreasing_numbers_split_the_recording(golden, tmp_path, capsys):
    """A reset, after a packet and inside one; a ring buffer: pieces, the longest unless another one is requested."""
    words, _, _ = golden
    data = raw(words[:40]) + raw(words[40])[:20] + raw(words[:30]) + raw(words[:1])[:93] + raw(words[:50])
    capture = parse(data, "x")
    assert [len(piece) for piece in capture.pieces] == [40, 30, 50]
    assert capture.left == [(40 * SIZE, 20), (70 * SIZE + 20, 93)]
    path = tmp_path / "capture.bin"
    path.write_bytes(data)
    for option, count in (([], 50), (["--piece", "2"], 30)):
        assert main(["dump", str(path), "--drive", str(PAPER), *option]) == 0
        said = capsys.readouterr().out
        assert f"{count} samples" in said and "93 bytes at byte 6740 belong to no whole packet" in said
        got, _ = digital.replay(recording(tmp_path / "capture.fluxdump"))
        assert got.samples == count and got.checked and got.first_difference is None
    assert main(["dump", str(path), "--drive", str(PAPER), "--piece", "4"]) == 2
    assert "has pieces 1 to 3" in capsys.readouterr().err


@pytest.mark.parametrize("word", range(COUNT))
def test_wrong_bit_is_refused_or_detected(word, golden, tmp_path):
    """One bit anywhere: an error, a missing packet, or a difference that the replay locates there."""
    words, _, _ = golden
    rng = np.random.default_rng(word)
    for bit in rng.choice(32, 3, replace=False):
        changed = words[:60].copy()
        changed[20, word] ^= np.uint32(1) << np.uint32(bit)
        try:
            capture = parse(raw(changed), "c.bin")
        except RecordingError as error:
            assert str(error).startswith(f"c.bin: the packet at byte {20 * SIZE} is damaged: word {word} is 0x")
            assert "\n" not in str(error)
            continue
        if word == 0:
            (piece,) = capture.pieces
            assert capture.left == [(20 * SIZE, SIZE)] and piece.lost == 1
            continue
        if word == 1:
            assert len(capture.pieces) > 1 or capture.pieces[0].lost
            continue
        (piece,) = capture.pieces
        got, _ = digital.replay(recording(write_piece(tmp_path / "a.fluxdump", piece, DRIVE, SET)))
        found = got.first_difference
        fields = {name for name, field in LAYOUT.items() if field.word == word}
        if found is None:  # an input that acts on nothing here
            assert fields & set(telemetry_words.INPUTS)
        else:
            assert found["sample"] >= 20 and (found["signal"] in fields or fields & set(telemetry_words.INPUTS))


def test_files_that_are_no_capture_are_refused(golden, tmp_path, capsys):
    words, _, _ = golden
    other = renumbered(words[:5], 0)
    other[:, 0] = telemetry_words.MAGIC << 16 | telemetry_words.VERSION + 1 << 8 | COUNT
    rng = np.random.default_rng(3)
    for content, wanted in (
        (b"", "0 bytes are too few for a telemetry packet"),
        (raw(words[0])[:-1], "95 bytes are too few for a telemetry packet"),
        (MAGIC + rng.bytes(500), "this is a dump already, which `fluxproof diagnose` reads"),
        (rng.bytes(5000), f"no word 0x{HEADER_WORD:08x}"),
        (
            b"\0" * 9 + raw(other),
            f"byte 9: telemetry packets of version {telemetry_words.VERSION + 1} with {COUNT} words: this reader knows",
        ),
    ):
        path = tmp_path / "capture.bin"
        path.write_bytes(content)
        assert main(["dump", str(path), "--drive", str(PAPER)]) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"fluxproof: {path}: ") and wanted in said and said.count("\n") == 1
        assert not (tmp_path / "capture.fluxdump").exists()
    with pytest.raises(RecordingError, match="cannot be read"):
        read_capture(tmp_path / "absent.bin")


@pytest.mark.parametrize(("text", "wanted"), [
    ("nonsense", "not JSON"),
    ("[1]", "expected an object of registers, found list"),
    ('{"kp": 1}', "register 'kp' is unknown; the nearest are kp_"),
    ('{"kp_d": -1}', "register kp_d = -1: expected an integer from 0 to 16777215"),
    ('{"kp_d": 1.5}', "register kp_d = 1.5: expected an integer"),
    ('{"kp_d": true}', "register kp_d = true: expected an integer"),
    ('{"registers": {}, "generics": {"adc_bits": 17}}', "generic adc_bits = 17: expected an integer from 12 to 16"),
    ('{"registers": {}, "generics": 3}', "generics: expected an object, found int"),
])  # fmt: skip
def test_bad_registers_give_a_one_line_error(text, wanted, golden, tmp_path, capsys):
    capture, path = tmp_path / "capture.bin", tmp_path / "registers.json"
    capture.write_bytes(raw(golden[0][:3]))
    path.write_text(text)
    assert main(["dump", str(capture), "--drive", str(PAPER), "--registers", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"fluxproof: {path}: ") and wanted in said and said.count("\n") == 1


def test_registers_as_the_command_writes_them(golden, tmp_path, capsys):
    """The output of ``fluxproof registers --json`` is accepted; bare integers change only the named registers."""
    assert main(["registers", str(PAPER), "--json", str(tmp_path / "r.json")]) == 0
    capsys.readouterr()
    assert dump_capture.with_registers(SET, tmp_path / "r.json")[:2] == SET[:2]
    (tmp_path / "s.json").write_text('{"kp_d": 77}')
    assert dump_capture.with_registers(SET, tmp_path / "s.json").values == SET.values._replace(kp_d=77)


def test_generated_files_are_fresh():
    """The word multiplexer too equals what Python declares."""
    for path, text in generate.outputs().items():
        assert path.read_text() == text, f"{path.name} is stale: run `make generate` and commit it"
    default = re.search(r"DEPTH_BITS +: positive range 5 to 16 +:= (\d+)", (RTL / "io/telemetry.vhd").read_text())
    assert int(default.group(1)) == generate_telemetry.DEPTH_BITS


def test_import_fails_if_a_latency_does_not_fit(monkeypatch):
    """A field read after the next sample may replace it is refused with the word's name."""
    words = telemetry_words.WORDS
    late = (*words[:3], *words[4:], words[3])  # raw codes in the last word: replaced by the next sample by then
    monkeypatch.setattr(telemetry_words, "WORDS", late)
    with pytest.raises(ValueError, match=r"telemetry: word 23 \(adc_c, adc_u_dc\) would be read"):
        telemetry_words._start()
    monkeypatch.setattr(telemetry_words, "WORDS", (("theta_me", "i_d"),))
    with pytest.raises(ValueError, match="theta_me and i_d do not fit into word 0"):
        telemetry_words._layout()


def test_c_reader_of_the_documentation(golden, tmp_path):
    """The C of docs/telemetry.md gives what the Python reader gives, for every field."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    (code,) = re.findall(r"```c\n(.*?)```", (ROOT / "docs" / "telemetry.md").read_text(), re.DOTALL)
    table = "".join(f"{{{f.word}, {f.lsb}, {f.width}, {int(f.signed)}}}, " for n, f in LAYOUT.items() if n in FIELDS)
    main_function = f"""
#include <stdio.h>
int main(void)
{{
    static const int t[][4] = {{ {table} }};
    struct packet p;
    while (fread(&p, sizeof p, 1, stdin) == 1)
        for (unsigned k = 0; k < sizeof t / sizeof *t; k++)
            printf("%d ", (int)field(&p, t[k][0], t[k][1], t[k][2], t[k][3]));
    return 0;
}}
"""
    (tmp_path / "reader.c").write_text(code + main_function)
    subprocess.run(["gcc", "-Wall", "-Wextra", "-Werror", "-o", "reader", "reader.c"], cwd=tmp_path, check=True)
    words, _, _ = golden
    done = subprocess.run([tmp_path / "reader"], input=raw(words[::100]), capture_output=True, check=True)
    (piece,) = parse(raw(words[::100])).pieces
    wanted = np.stack([piece.fields[name] for name in FIELDS], axis=1)
    np.testing.assert_array_equal(np.array(done.stdout.split(), np.int64).reshape(wanted.shape), wanted)
