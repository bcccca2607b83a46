# SPDX-License-Identifier: BSD-3-Clause
"""The page of ``fluxproof commission --watch``: each step as it runs, what it found, and why it refused.

The page is a process of its own, and what it is told waits in a queue: the host that watches over the currents waits
for no browser.  Where the queue is full, rows are left out of the picture and counted.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import queue
import threading
from collections import deque
from html import escape

import numpy as np

from fluxproof.commission.bus import Bus
from fluxproof.commission.session import Step
from fluxproof.cosim.step_response import Curve
from fluxproof.simulate.response import predicted
from fluxproof.watch.responses import Response
from golden_model.board_registers import board_set
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.units import to_si

KEPT, WAITING = 20_000, 50_000  # rows of the picture; messages in the queue
START_S, END_S = 60.0, 5.0
QUANTITIES = ("i_d", "i_q", "u_d", "u_q", "omega_me", "theta_me")


class Watched:
    """A bus whose snapshots are shown as well."""

    def __init__(self, bus: Bus, page: Page) -> None:
        self.bus, self.page = bus, page
        self.read, self.write, self.wait, self.now = bus.read, bus.write, bus.wait, bus.now

    def snapshot(self) -> dict[str, int]:
        row = self.bus.snapshot()
        self.page.tell("row", (self.bus.now(), tuple(row[name] for name in QUANTITIES)))
        return row


class Page:
    """The process of the page, as the commissioning sees it; DriveError where it does not start."""

    def __init__(self, drive: Drive, port: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.messages, self.left_out = context.Queue(WAITING), 0
        answers = context.Queue()
        self.process = context.Process(target=show, args=(self.messages, answers, drive, port), daemon=True)
        self.process.start()
        try:
            self.url, problem = answers.get(timeout=START_S)
        except queue.Empty:
            self.url, problem = "", f"it did not start within {START_S:.0f} s"
        if problem:
            self.process.kill()
            raise DriveError(f"--watch: {problem}")

    def tell(self, kind: str, what) -> None:
        """Say something; where the page does not keep up it is left out."""
        try:
            self.messages.put_nowait((kind, what))
        except queue.Full:
            self.left_out += 1

    def wait(self) -> None:
        """Until Ctrl-C: a reader wants to see the end."""
        try:
            self.process.join()
        except KeyboardInterrupt:
            pass
        finally:
            self.process.kill()


class Story:
    """What has happened so far: rows, steps, what runs now, how it ended."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.rows: deque[tuple[float, tuple[int, ...]]] = deque(maxlen=KEPT)
        self.steps: list[Step] = []
        self.now, self.end = "", ""
        self.latest: dict[str, Response] = {}

    def take(self, kind: str, what) -> None:
        """A message of the commissioning."""
        with self.lock:
            if kind == "row":
                self.rows.append(what)
            elif kind == "step":
                self.steps.append(what)
                if what.responses:
                    threading.Thread(target=self.predict, args=(what,), daemon=True).start()
            elif kind == "now":
                self.now = what
            else:
                self.now, self.end = "", what

    def predict(self, step: Step) -> None:
        """What `simulate` says of the step responses; seconds, in which rows go on coming."""
        for drive, at, measured in step.responses:
            expected = predicted(drive, board_set(drive), at)
            time = np.arange(len(expected)) * drive.sample_time_s
            self.latest[at.loop.name] = Response(at.loop, at.before, at.after, measured, Curve(time, expected))

    def listen(self, messages) -> None:
        """All messages, for ever."""
        while True:
            self.take(*messages.get())

    def picture(self) -> tuple[np.ndarray, np.ndarray]:
        """(time [s], integers (n, QUANTITIES)) of the rows."""
        with self.lock:
            rows = list(self.rows)
        times = np.array([t for t, _ in rows])
        return times, np.array([row for _, row in rows]).reshape(len(rows), len(QUANTITIES))

    def told(self) -> str:
        """The steps as HTML."""
        with self.lock:
            steps, now, end = list(self.steps), self.now, self.end
        rows = [(s.name, s.said) for s in steps] + [row for row in (("now", now), ("end", end)) if row[1]]
        cells = "<tr><th scope='row' align='left' valign='top'>{}</th><td>{}</td></tr>"
        return f"<table>{''.join(cells.format(escape(name), escape(said)) for name, said in rows)}</table>"


def show(messages, answers, drive: Drive, port: int) -> None:
    """The page's process: answers (address, problem) once, then serves for ever."""
    try:
        from fluxproof.watch.server import serve

        story = Story()
        server, url = serve(lambda doc: view(doc, story, drive), "127.0.0.1", port)
    except ImportError:
        answers.put(("", "the page needs bokeh: pip install 'fluxproof[fleet]'"))
        return
    except OSError as error:
        answers.put(("", f"--port {port}: {error.strerror or error}"))
        return
    threading.Thread(target=story.listen, args=(messages,), daemon=True).start()
    answers.put((url, ""))
    with contextlib.suppress(KeyboardInterrupt):
        server.io_loop.start()


def view(doc, story: Story, drive: Drive) -> None:
    """One browser's view."""
    from bokeh.layouts import column, row
    from bokeh.models import ColumnDataSource, Div

    from fluxproof.watch.answers import Answers
    from fluxproof.watch.curves import PICTURE_MS, WIDE, plot, thinned

    sources: dict[str, ColumnDataSource] = {}
    plots = [
        plot("Currents", ("i_d", "i_q"), "A", sources),
        plot("Voltages", ("u_d", "u_q"), "V", sources),
        plot("Speed", ("speed",), "rpm", sources),
        plot("Angle in use", ("theta_e",), "degrees", sources),
    ]
    for other in plots[1:]:
        other.x_range = plots[0].x_range
    plots[-1].xaxis.axis_label = "s of the commissioning"
    answered, answers = Answers(drive), Div(width=WIDE - 10)
    steps, rpm = Div(width=WIDE - 10), 30.0 / np.pi / drive.machine.pole_pairs

    def renew() -> None:
        steps.text, answers.text = story.told(), answered.renew(story.latest)
        times, rows = story.picture()
        if len(times) < 2:
            return
        si = {name: to_si(name, rows[:, k], drive) for k, name in enumerate(QUANTITIES)}
        si |= {"speed": si["omega_me"] * rpm, "theta_e": np.degrees(si["theta_me"]) % 360.0}
        for name, source in sources.items():
            x, y = thinned(times, si[name])
            source.data = {"x": x, "y": y}

    left = column(*plots, row(*answered.plots.values(), sizing_mode="stretch_width"), sizing_mode="stretch_width")
    doc.add_root(row(left, column(steps, answers), sizing_mode="stretch_width"))
    doc.add_periodic_callback(renew, PICTURE_MS)
