# SPDX-License-Identifier: BSD-3-Clause
"""The drive while it runs: packets out of broken streams, bounded memory, the replay beside them, the page."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from urllib.request import urlopen

import numpy as np
import pyarrow.parquet as pq
import pytest
from bokeh.client import pull_session

from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.command import main
from fluxproof.commission.responses import step_responses
from fluxproof.commission.session import Session, Step
from fluxproof.commission.simulated import Board, SimulatedBus, board_of
from fluxproof.cosim import golden_loop
from fluxproof.cosim.scenarios import everything, scenario
from fluxproof.cosim.step_response import LOOPS
from fluxproof.diagnosis.example import motor
from fluxproof.diagnosis.replay.capture import capture, packets
from fluxproof.diagnosis.replay.telemetry import MAGIC
from fluxproof.diagnosis.replay.telemetry_stream import values
from fluxproof.plant import IMPOSED_SPEED, Machine
from fluxproof.simulate.response import length
from fluxproof.simulate.run import inverter_of
from fluxproof.watch.answers import told
from fluxproof.watch.commissioning import Page, Story, Watched
from fluxproof.watch.curves import thinned
from fluxproof.watch.explain import Explainer, Explanation, sizes_of
from fluxproof.watch.live import Live, Look
from fluxproof.watch.packets import Note, Packets
from fluxproof.watch.page import Scene, curves, state_of, view
from fluxproof.watch.replay import LiveReplay
from fluxproof.watch.responses import Responses, steps_in
from fluxproof.watch.server import allowed, serve, token_for
from fluxproof.watch.sinks import PlotJuggler
from fluxproof.watch.sizes import Sizes
from fluxproof.watch.source import Tcp, source_of
from fluxproof.watch.trigger import GATES, LEVELS, NOTHING, REFERENCE, events, holds
from golden_model import drive as drives
from golden_model.drive_keys import DriveError
from golden_model.estimators.flux_monitor import CONDITIONS, FAULTS
from golden_model.generated.register_names import ADDRESSES as REGISTER_ADDRESSES
from golden_model.io.fault_latch import NAMES
from golden_model.io.telemetry_words import COUNT, LAYOUT, NOTE_WORD
from golden_model.registers import registers
from golden_model.units import from_si
from studies.live import browser
from studies.live.browser import TEXT

DRIVE = drives.load(PAPER)
SET = registers(DRIVE)


@pytest.fixture(scope="module")
def words():
    """The packets of 2500 samples."""
    samples, observed, _ = capture(DRIVE, SET, everything(DRIVE))
    return packets(samples, observed)


class Pieces:
    """A source that gives what it is told, piece by piece."""

    def __init__(self, *pieces: bytes):
        self.pieces, self.breaks = list(pieces), 0

    def read(self) -> bytes:
        return self.pieces.pop(0) if self.pieces else b""

    def close(self) -> None:
        pass


def raw(rows) -> bytes:
    return np.ascontiguousarray(rows, "<u4").tobytes()


def watched(*pieces: bytes, capacity: int = 1000, registers=SET) -> Live:
    live = Live(Pieces(*pieces), capacity, LiveReplay(registers))
    while live.source.pieces:
        live.pump()
    return live


def test_packets_in_pieces(words):
    """Cut anywhere, a stream gives the same packets; bad bytes cost the packets that they hit, and no other."""
    rng, note = np.random.default_rng(1), raw([NOTE_WORD, 120, 1 << NAMES.index("stall"), *[0] * (COUNT - 3)])
    data = note + raw(words[:120]) + note + note + raw(words[120:200]) + note[:40]
    cuts = [0, *sorted(rng.integers(0, len(data), 60).tolist()), len(data)]
    packets = Packets()
    got = np.concatenate([packets.feed(data[a:b]) for a, b in zip(cuts, cuts[1:], strict=False)])
    assert np.array_equal(got, words[:200]) and (packets.skipped, packets.rest) == (0, note[:40])
    assert packets.notes == [Note(120, 1 << NAMES.index("stall"))] * 3

    bad = words[:200].copy()
    bad[50, 8] |= 1 << 31  # theta_me is unsigned
    data = b"noise" + raw(bad[:120])[:-40] + raw(bad[120:]) + raw(words[:1])[:30]  # packet 119 is torn
    packets = Packets()
    got = np.concatenate([packets.feed(data[k : k + 1000]) for k in range(0, len(data), 1000)])
    assert got[:, 1].tolist() == [k for k in range(200) if k not in (50, 119)]
    assert packets.skipped == 5 + 96 + 56 and len(packets.rest) == 30


def test_equal_gap_and_bit(words):
    """Equal to the end; a gap is marked and costs what is not known; a wrong bit is found and named."""
    live = watched(raw(words[:1300]), raw(words[1300:]))
    assert live.replay.told() == "digital: equal over 2,500 samples"
    assert (live.total, live.lost) == (2500, 0) and len(live.look(10**6).counter) == 1000  # the memory is bounded
    assert live.look(10).counter.tolist() == list(range(2490, 2500))

    live = watched(raw(words[:100]), raw(words[110:400]), raw(words[:50]), capacity=5000)
    assert (live.lost, live.restarts) == (10, 1) and live.replay.equal == 100 + 50
    assert [text for _, text in live.events if "gates" not in text] == [
        "10 samples are missing",
        "the numbers begin anew: the core was reset",
    ]
    assert live.look(5000).cuts.tolist() == [100, 390]

    wrong = words.copy()
    wrong[700, 11] ^= 4
    live = watched(raw(wrong[:650]), raw(wrong[650:]))
    assert live.replay.difference.startswith("block park, sample 700, signal i_d, bit 2: ")
    assert live.replay.equal == 700 and live.total == 2500


def test_a_stream_that_begins_late(words):
    """Of a core that ran before, blocks without state are compared: a wrong bit and registers of another drive show."""
    told = watched(raw(words[1:])).replay.told()
    assert told.startswith("digital: 0 samples compared") and "of 2,499 samples only blocks without state" in told
    wrong = words[1:].copy()
    wrong[700, 11] ^= 4
    assert watched(raw(wrong)).replay.told().startswith("digital: block park, sample 701, signal i_d, bit 2: ")
    other = SET._replace(config=SET.config._replace(carrier_half=SET.config.carrier_half // 2))
    live = watched(raw(words[1:1300]), raw(words[1300:]), registers=other)
    assert "signal duty_a" in live.replay.told() or "signal compare_a" in live.replay.told()


def test_command_on_a_file(words, tmp_path, capsys):
    """A file that grows while it is read: every row, as CSV too; status 1 for a wrong bit."""
    path = tmp_path / "capture.bin"
    path.write_bytes(raw(words[:900]))

    def grow():
        time.sleep(0.3)
        with open(path, "ab") as file:
            file.write(raw(words[900:])[:-7])

    thread = threading.Thread(target=grow)
    thread.start()
    command = ["watch", str(path), "--drive", str(PAPER), "--no-page", "--every", "0", "--seconds", "0.9"]
    assert main([*command, "--csv", str(tmp_path / "rows.csv")]) == 0
    thread.join()
    assert "digital: equal over 2,499 samples" in capsys.readouterr().out
    lines = (tmp_path / "rows.csv").read_text().splitlines()
    column = lines[0].split(",").index('"i_q [A]"')
    assert len(lines) == 2500
    assert float(lines[1001].split(",")[column]) == pytest.approx(
        np.int32(words[1000, 12]) * DRIVE.bases.current_a / 65536
    )
    assert main(["watch", str(tmp_path / "none.bin"), "--drive", str(PAPER), "--no-page"]) == 2
    for wrong in ("tcp://host", "tcp://host:0", "tcp://:5"):
        with pytest.raises(DriveError, match="expected tcp://HOST:PORT"):
            source_of(wrong)


def test_what_brings_no_row_is_told(tmp_path, capsys):
    """A dump, a file of something else, an empty one, a port where nobody answers: one line, exit status 2."""
    dump, text, empty = tmp_path / "run.fluxdump", tmp_path / "run.csv", tmp_path / "run.bin"
    dump.write_bytes(MAGIC + bytes(100))
    text.write_text("time,i_a,i_b\n" * 20)
    empty.write_bytes(b"")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        nobody = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    said = {str(dump): "this is a dump", str(text): "none of its 260 bytes is a packet"}
    said |= {str(empty): "the file is empty", nobody: "no row has come: nobody answers (Connection refused)"}
    for source, words in said.items():
        command = ["watch", source, "--drive", str(PAPER), "--no-page", "--every", "0", "--seconds", "0.2"]
        assert main(command) == 2
        told = capsys.readouterr()
        assert words in told.err and source in told.err, told
        assert ("nobody answers" in told.out) == (source == nobody), told


def test_a_pipe_loses_nothing_to_the_look_at_its_begin(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_bytes, args=(b"0123456789abcdef",))
    writer.start()
    source = source_of(str(pipe))
    assert source.read() == b"0123456789abcdef"
    writer.join()
    source.close()


def test_server_in_c(words, tmp_path):
    """docs/software/telemetry_server.c: the packets arrive; a broken connection is made again, its gap marked, and the
    first fault told."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    code = ROOT / "docs" / "software" / "telemetry_server.c"
    subprocess.run(["gcc", "-O2", "-Wall", "-Wextra", "-Werror", code, "-o", tmp_path / "server"], check=True)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    window = bytearray(4096)
    window[REGISTER_ADDRESSES["first_fault"]] = 1 << NAMES.index("overcurrent") | 1 << NAMES.index("u_dc_high")
    (tmp_path / "uio").write_bytes(window)
    command = [tmp_path / "server", "-", str(port), "127.0.0.1", tmp_path / "uio"]
    server = subprocess.Popen(command, stdin=subprocess.PIPE)
    live = Live(Tcp("127.0.0.1", port), 5000, LiveReplay(SET))

    def until(total):
        end = time.monotonic() + 20.0
        while live.total < total and time.monotonic() < end:
            live.pump()
        return live.total

    try:
        while live.source.socket is None:
            live.pump()
        time.sleep(0.1)  # the server accepts
        server.stdin.write(raw(words[:1000]))
        server.stdin.flush()
        assert until(1000) == 1000 and live.replay.equal == 1000
        live.source.close()  # as a cable that is pulled
        live.source.breaks += 1
        time.sleep(0.1)
        server.stdin.write(raw(words[1000:1200]))
        server.stdin.flush()
        time.sleep(0.3)
        while live.source.socket is None:
            live.pump()
        time.sleep(0.1)
        off = int(np.flatnonzero(np.diff(values(words, LAYOUT["run"])) < 0)[0]) + 1
        server.stdin.write(raw(words[1200 : off + 100]))
        server.stdin.close()
        until(off - 100)
        assert live.total + live.lost == off + 100 and 0 < live.lost <= 200 and live.packets.skipped == 0
        assert live.events[-1] == (off, "gates off: overcurrent, u_dc_high")
        assert server.wait(10) == 0
    finally:
        server.kill()
        live.source.close()


def test_plotjuggler(words):
    """The JSON that PlotJuggler's UDP server reads."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(5.0)
        sink = PlotJuggler(f"127.0.0.1:{listener.getsockname()[1]}", DRIVE)
        live = Live(Pieces(raw(words[:500])), 1000, LiveReplay(SET), [sink])
        live.pump()
        said = [json.loads(listener.recv(4096)) for _ in range(20)]
    assert [said[0]["timestamp"], said[-1]["timestamp"]] == pytest.approx([0.0, 499 * DRIVE.sample_time_s])
    assert said[-1]["i_q"] == pytest.approx(np.int32(words[499, 12]) * DRIVE.bases.current_a / 65536)
    sink.close()


@contextlib.contextmanager
def served(shown):
    """The address of a page with a token, served by a thread."""
    server, url = serve(shown, "127.0.0.1", 0, "secret")
    thread = threading.Thread(target=server.io_loop.start)
    thread.start()
    try:
        yield url
    finally:
        server.io_loop.add_callback(server.io_loop.stop)
        thread.join()
        server.stop()


LAST = "window.Bokeh?.documents?.[0]?.get_model_by_name('i_q')?.data_source.data.x.at(-1)"
FOCUSED = """(() => { let e = document.activeElement;
  while (e.shadowRoot?.activeElement) e = e.shadowRoot.activeElement; return e; })()"""


@pytest.mark.slow
def test_page_in_a_browser(words, tmp_path):
    """The page as a user has it: curves move, a trip and a wrong bit are told, every control has a name and a key."""
    if browser.CHROMIUM is None:
        pytest.skip("chromium is not installed (Debian package chromium)")
    source = Pieces(raw(words[:600]))
    live = Live(source, 5000, LiveReplay(SET))
    live.pump()
    explainer = Explainer(live, DRIVE, str(PAPER), SET, 1.0)
    scene = Scene(live, DRIVE, explainer)

    def more(rows) -> float:
        source.pieces.append(raw(rows))
        live.pump()
        return time.monotonic()

    with served(lambda doc: view(doc, scene)) as url, browser.Browser(url, tmp_path) as page:
        page.until(f"document.title == 'Fluxproof' && {LAST} > 0")
        period = DRIVE.sample_time_s
        assert page.js(LAST) == pytest.approx(599 * period, abs=10 * period)
        more(words[600:1200])
        page.until(f"{LAST} > {1180 * period}")
        assert "digital: equal over 1,200 samples" in page.js(TEXT) and "gates on" in page.js(TEXT)

        off = int(np.flatnonzero(np.diff(live_run := values(words, LAYOUT["run"])) < 0)[0]) + 1
        assert off > 1200 and live_run[off] == 0
        told = more(words[1200 : off + 50])
        page.until(f"{TEXT}.includes('sample {off}: gates off')")
        assert time.monotonic() - told < 5.0  # a busy machine; `make live` measures it
        wrong = words[off + 50 : off + 60].copy()
        wrong[2, 11] ^= 4
        more(wrong)
        page.until(f"{TEXT}.includes('sample {off + 52}, signal i_d, bit 2')")
        size = {"dead_time: v_dead_v": (3.1, 0.2, "V")}
        explainer.found.append(Explanation(off, "explained", "Dead time: 3.1 <V>", size))
        page.until(f"{TEXT}.includes('explained: Dead time: 3.1 <V>')")
        page.until("Bokeh.documents[0].get_model_by_name('size').value == 'dead_time: v_dead_v'")

        named = {name for _, name in page.names("button", "combobox", "spinbutton", "textbox")}
        assert named >= {
            "Window [s]",
            "Hold",
            "Hold when",
            "Pre-trigger",
            "Size over time of",
            "Export what is shown (Parquet)",
        }
        assert all(named)
        focus_on(page, "Hold")
        page.key(" ")
        page.until("Bokeh.documents[0].get_model_by_name('hold').active")
        shown = page.js(LAST)
        more(words[off + 60 : off + 200])
        page.until(f"{TEXT}.includes('{off + 200:,} rows')")
        assert page.js(LAST) == shown
        focus_on(page, "Export what is shown (Parquet)")
        page.key("Enter")
        end = time.monotonic() + 30.0
        while not (saved := list(tmp_path.glob("*.parquet"))) and time.monotonic() < end:
            time.sleep(0.05)
        assert pq.read_table(saved[0]).num_rows == off + 60


def focus_on(page: browser.Browser, label: str) -> None:
    """Tab until the control with this label has the focus."""
    for _ in range(60):
        page.key("Tab")
        if page.js(f"{FOCUSED}?.textContent == {json.dumps(label)}"):
            return
    raise AssertionError(f"{label} has no place among the keys")


@pytest.mark.slow
def test_token(words):
    """Without the token a session has nothing of the drive."""
    live = watched(raw(words[:100]))
    with served(lambda doc: view(doc, Scene(live, DRIVE, None))) as url:
        assert b"Fluxproof" in urlopen(url, timeout=10).read()
        bare = url.split("?")[0]
        for arguments, seen in (({"token": "secret"}, True), ({}, False), ({"token": "secre"}, False)):
            session = pull_session(url=bare, arguments=arguments)
            assert (session.document.select_one({"name": "i_q"}) is not None) == seen
            session.close()
    assert token_for("127.0.0.1") is None and len(token_for("0.0.0.0")) >= 20
    assert not allowed("a", {}) and allowed(None, {})


def running(inertia: float) -> Live:
    """A speed step and a step of i_q of the paper's drive, whose inertia is that of the file times ``inertia``."""
    steps = {"rpm": {0.0: 183, 0.2: 732}, "i_q": {0.50: 1.5}, "torque_mode": ((0.45, 0.55),)}
    given = scenario(DRIVE, 0.55, load={0.05: 1.0}, **steps)
    machine = Machine.from_mapping(vars(DRIVE.machine))
    machine = replace(machine, inertia_kgm2=inertia * machine.inertia_kgm2)
    options = {"dead_time_s": DRIVE.inverter.dead_time_s, "inverter": inverter_of(DRIVE)}
    seen = golden_loop.simulate(DRIVE, SET, given, machine, **options).observed
    fields = {name: getattr(given, name) for name in ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode")}
    fields |= {"run": given.enable, **{name: seen[name] for name in ("i_q", "theta_me", "omega_me", "u_dc", "v_comp")}}
    live = watched(capacity=10)
    live.total = len(given)
    live.look = lambda count, names: Look(np.arange(len(given)), fields, np.zeros(0, np.int64))
    return live


@pytest.mark.parametrize("inertia", [1.0, 2.0])
def test_a_step_is_cut_out_and_stands_beside_its_prediction(inertia):
    """Equal where the drive is that of the file; a larger inertia is seen in the speed's response alone."""
    responses = Responses(running(inertia), DRIVE, SET)
    responses.renew()
    assert {name: r.counter for name, r in responses.latest.items()} == {"current loop": 5000, "speed loop": 2000}
    for name, response in responses.latest.items():
        apart = np.abs(response.measured.values[20:] - response.predicted.values).max()
        rise, told = (float(row[1].split()[0]) for row in response.told())
        if inertia == 1.0 or name == "current loop":
            assert apart < 0.06 * (response.after - response.before), name
        else:
            assert rise > 1.3 * told
    before = dict(responses.latest)
    responses.renew(lambda *_: pytest.fail("a step that is known is predicted again"))
    assert responses.latest == before


def test_a_step_counts_only_at_rest_and_until_the_loop_has_settled():
    """Not within a gap, not before the speed of the step before has come, not where another reference moves."""
    drive, loop = DRIVE, LOOPS[1]
    n, size = 9000, int(from_si("omega_ref", 100.0, DRIVE))
    quiet = {name: np.zeros(n, np.int64) for name in ("i_d_ref", "i_q_ext", "i_q", "u_dc")}
    fields = quiet | {name: np.ones(n, np.int64) for name in ("run", "speed_mode")}
    fields["omega_ref"] = np.where(np.arange(n) < 3000, 0, size)
    fields["omega_me"] = fields["omega_ref"].copy()
    rows = lambda cuts=(), **others: steps_in(  # noqa: E731
        Look(np.arange(n), fields | others, np.array(cuts, np.int64)), drive, loop
    )
    behind = 3000 + length(drive, loop, 100.0)
    assert rows() == [(3000, behind)]
    assert rows((3500,)) == [] and rows((2990,)) == [] and rows((behind,)) == [(3000, behind)]
    assert rows(omega_me=fields["omega_me"] + size // 4) == []
    assert rows(i_d_ref=(np.arange(n) > 3100).astype(int)) == []
    assert rows(speed_mode=quiet["i_q"]) == [] and rows(run=quiet["i_q"]) == []


def test_flags_in_words(words):
    """The flags of the last row by name; the flux monitor's bits too."""
    fields = watched(raw(words[:50])).look(10).fields | {"flux_faults": np.array([36]), "sat_q": np.array([1])}
    assert state_of(fields | {"run": np.array([0])}).startswith("gates off, ")
    said = state_of(fields)
    assert "u_q at its limit" in said and said.endswith("current model at its range, compensation at its limit")
    assert len(CONDITIONS) == FAULTS.int_bits


def test_an_event_holds_the_picture_where_the_rows_before_it_are_seen():
    """Gates, references and levels; once, when the event has come to its place in the window, and not again."""
    fields = {"run": np.ones(100), **{name: np.zeros(100) for name in ("omega_ref", "i_d_ref", "i_q_ext")}}
    fields["run"][40:] = 0
    fields["i_d_ref"][60:] = 5
    si = {"i_q": np.where((np.arange(100) >= 20) & (np.arange(100) < 30), 3.0, 1.0)}
    assert [events(what, 2.0, fields, si).tolist() for what in (NOTHING, GATES, REFERENCE)] == [[], [40], [60]]
    assert events("i_q rises above", 2.0, fields, si).tolist() == [20]
    assert events("i_q falls below", 2.0, fields, si).tolist() == [30]
    row = np.array([50])
    assert holds(row, 101, 0.5, 10) and not holds(row + 1, 101, 0.5, 10)
    assert holds(row - 9, 101, 0.5, 10) and not holds(row - 10, 101, 0.5, 10)
    assert set(LEVELS) <= set(curves(watched().look(0), DRIVE))


def test_the_size_of_what_is_named_over_time():
    """Each explanation that names the parameter is a point with two sigma; the page shows the one named last."""
    parameters = {"resistance_ohm": {"value": 1.5, "sigma": 0.1, "unit": "ohm"},
                  "slope": {"value": 0.0, "sigma": None, "unit": "1"}}  # fmt: skip
    name, first = "resistance: resistance_ohm", sizes_of([{"name": "resistance", "parameters": parameters}])
    assert first == {name: (1.5, 0.1, "ohm")}
    seen, found = Sizes(DRIVE), [Explanation(1000, "no_mismatch", "")]
    seen.renew(found)
    assert not seen.plot.visible
    found += [Explanation(n, "explained", "", {name: (r, 0.1, "ohm")}) for n, r in ((2000, 1.5), (4000, 2.2))]
    seen.renew(found)
    assert seen.plot.visible and seen.chosen.value == name
    assert seen.source.data["y"] == [1.5, 2.2] and seen.source.data["high"] == pytest.approx([1.7, 2.4])
    assert seen.source.data["x"] == pytest.approx([2000 * DRIVE.sample_time_s, 4000 * DRIVE.sample_time_s])
    found.append(Explanation(5000, "explained", "", {"magnet_flux: magnet_flux_wb": (0.15, 0.01, "Wb")}))
    seen.renew(found)  # what was chosen stays chosen
    assert seen.source.data["y"] == [1.5, 2.2] and "magnet_flux: magnet_flux_wb" in seen.chosen.options


def test_thinned_keeps_peaks():
    """The curve of a view has its smallest and largest value."""
    curve = np.zeros(40_003)
    curve[12_345], curve[30_000] = 7.0, -9.0
    x, y = thinned(np.arange(40_003), curve)
    assert len(x) == len(y) <= 1000 and (y.max(), y.min()) == (7.0, -9.0) and COUNT == 24


@pytest.mark.slow
def test_the_explanation_of_the_last_seconds_names_what_is_hidden(tmp_path):
    """The example's motor, its telemetry as a stream: three differences that the regulators conceal."""
    drive = drives.load(motor.DRIVE_FILE)
    register_set, (path, options) = registers(drive), (tmp_path / "drive.toml", {"mode": IMPOSED_SPEED})
    path.write_bytes(motor.DRIVE_FILE.read_bytes())
    options |= {"machine": motor.machine(drive), "inverter": motor.inverter(), "sensors": motor.sensors(drive)}
    samples, observed, _ = capture(drive, register_set, motor.scenario(drive), **options)
    live = Live(Pieces(raw(packets(samples, observed))), len(samples), LiveReplay(register_set))
    while live.source.pieces:
        live.pump()
    found = Explainer(live, drive, str(path), register_set, 1.0).explain()
    assert found.verdict == "explained" and found.counter == len(samples) - 1, found
    assert all(name in found.text for name in ("Dead time", "ncoder offset", "agnet flux")), found.text


def test_what_the_page_of_a_commissioning_tells():
    """Steps, what runs and the end in order; a page that does not keep up costs rows of the picture alone."""
    story = Story()
    for message in (("now", "offsets"), ("row", (0.1, (1, 2, 3, 4, 5, 6))), ("row", (0.2, (1, 2, 3, 4, 5, 7)))):
        story.take(*message)
    assert "offsets" in story.told() and story.picture()[1].tolist() == [[1, 2, 3, 4, 5, 6], [1, 2, 3, 4, 5, 7]]
    story.take("step", Step("offsets", {}, "b 2007 < codes"))
    story.take("end", "refused: the shaft is held")
    told = story.told()
    assert told.index("b 2007 &lt; codes") < told.index("refused: the shaft is held") and ">now<" not in told

    page = Page.__new__(Page)  # without its process
    page.messages, page.left_out = queue.Queue(2), 0
    bus = Watched(SimulatedBus(DRIVE, board_of(DRIVE)), page)
    rows = [bus.snapshot() for _ in range(3)]
    assert page.left_out == 1 and page.messages.qsize() == 2
    kind, (_, integers) = page.messages.get()
    assert kind == "row" and integers[0] == rows[0]["i_d"] and integers[-1] == rows[0]["theta_me"]


def test_step_responses_of_a_commissioning_stand_beside_their_predictions():
    """The drive is that of the file: rise and overshoot of both loops are those of the prediction."""
    drive = replace(DRIVE, inverter=replace(DRIVE.inverter, dead_time_s=0.0))  # with one, the rotor's angle counts
    bus, story = SimulatedBus(drive, Board(Machine.from_mapping(vars(drive.machine)))), Story()
    step = step_responses(Session(bus, drive), drive)
    assert bus.read("enable") == 0 and not step.notes and [at.loop for _, at, _ in step.responses] == list(LOOPS)
    story.predict(step)
    for response in story.latest.values():
        assert len(response.measured.time) > 50
        expected = np.interp(response.measured.time, *response.predicted)
        apart = np.abs(expected - response.measured.values).max()
        assert apart < 0.06 * (response.after - response.before), response.told()
    at = step.responses[0][1]
    assert f"{at.loop.name} 0 to {at.after:.4g} A in " in step.said and "speed loop" in step.said
    assert told(story.latest).count("predicted") == 2


@pytest.mark.slow
def test_a_commissioning_in_a_browser(tmp_path):
    """The first step appears while the others run, and the end."""
    if browser.CHROMIUM is None:
        pytest.skip("chromium is not installed (Debian package chromium)")
    command = [sys.executable, "-m", "fluxproof", "commission", str(DRIVES / "servo_24v.toml")]
    command += ["--watch", "--port", "0"]
    child = subprocess.Popen([*command, "--out", str(tmp_path / "out")], stdout=subprocess.PIPE, text=True)
    try:
        with browser.Browser(child.stdout.readline().split()[-1], tmp_path) as page:
            page.until(f"{TEXT}.includes('codes') && {TEXT}.includes('now')", 300.0)
            assert "accepted" not in page.js(TEXT)
            page.until(f"{TEXT}.includes('accepted')", 300.0)
    finally:
        child.kill()
        child.wait()
