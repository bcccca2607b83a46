# SPDX-License-Identifier: BSD-3-Clause
"""The page of ``fluxproof watch``, which looks at the rows ten times a second."""

from __future__ import annotations

import asyncio
import io
from html import escape
from typing import Any, NamedTuple

import numpy as np
from bokeh.document import without_document_lock
from bokeh.layouts import column, row
from bokeh.models import Button, ColumnDataSource, CustomJS, Div, NumericInput, Select, Toggle
from bokeh.plotting import figure

from fluxproof.watch.answers import Answers
from fluxproof.watch.curves import COLOURS, PICTURE_MS, POINTS, WIDE, plot, thinned
from fluxproof.watch.explain import Explainer
from fluxproof.watch.live import Live, Look
from fluxproof.watch.responses import Responses
from fluxproof.watch.sinks import scales_of, table
from fluxproof.watch.sizes import Sizes
from fluxproof.watch.trigger import CHOICES, NOTHING, events, holds
from golden_model.drive import Drive
from golden_model.estimators.flux_monitor import CONDITIONS
from golden_model.units import si_per_lsb

WINDOWS_S = ("0.05", "0.2", "1", "5", "20")
SHOWN = ("i_d", "i_q", "i_q_ref", "omega_me", "omega_ref", "lambda_d", "lambda_q", "u_d", "u_q", "u_dc")
FLAGS = {"current_at_rail": "current converter at its end", "temp_lost": "no winding temperature",
         "psi_held": "psi_m held", "sat_d": "u_d at its limit", "sat_q": "u_q at its limit"}  # fmt: skip


class Scene(NamedTuple):
    """What a view shows of."""

    live: Live
    drive: Drive
    explainer: Explainer | None
    responses: Responses | None = None


def curves(look: Look, drive: Drive) -> dict[str, np.ndarray]:
    """SI values of the curves: currents, mechanical speed in rpm, torque, voltage."""
    si = {name: look.fields[name] * float(si_per_lsb(name, drive)) for name in SHOWN}
    poles, rpm = drive.machine.pole_pairs, 30.0 / np.pi / drive.machine.pole_pairs
    torque = 1.5 * poles * (si["lambda_d"] * si["i_q"] - si["lambda_q"] * si["i_d"])
    return si | {"speed": si["omega_me"] * rpm, "speed_ref": si["omega_ref"] * rpm, "torque": torque}


def state_of(fields: dict[str, np.ndarray]) -> str:
    """The flags of the last row in words."""
    last = {name: int(column[-1]) for name, column in fields.items()}
    said = ["gates on" if last["run"] else "gates off", "speed control" if last["speed_mode"] else "current control"]
    said += [words for name, words in FLAGS.items() if last[name]]
    found = [words for bit, words in enumerate(CONDITIONS) if last["flux_faults"] >> bit & 1]
    return ", ".join(said) + (f"; the flux estimate was disturbed: {', '.join(found)}" if found else "")


def parquet_of(look: Look, drive: Drive) -> bytes:
    """The rows as a Parquet file."""
    import pyarrow.parquet as pq  # half a second

    out = io.BytesIO()
    pq.write_table(table(look.counter, look.fields, scales_of(drive), drive.sample_time_s), out)
    return out.getvalue()


def view(doc: Any, scene: Scene) -> None:
    """One browser's view."""
    live, drive = scene.live, scene.drive
    sources: dict[str, ColumnDataSource] = {}

    plots = [
        plot("Currents", ("i_d", "i_q", "i_q_ref"), "A", sources),
        plot("Speed", ("speed", "speed_ref"), "rpm", sources),
        plot("Torque from the flux", ("torque",), "Nm", sources),
    ]
    for other in plots[1:]:
        other.x_range = plots[0].x_range
    plots[-1].xaxis.axis_label = "s since the reset"
    circle = figure(title="Voltage, its limit u_dc / sqrt 3", height=320, width=320, match_aspect=True, tools="")
    circle.toolbar_location = None
    sources["voltage"] = ColumnDataSource({"x": [], "y": []})
    sources["limit"] = ColumnDataSource({"x": [], "y": []})
    circle.line("x", "y", source=sources["limit"], color="#000000", name="limit")
    circle.scatter("x", "y", source=sources["voltage"], size=2, color="#d55e00", name="voltage")
    said, digital, why, flags, answers = (Div(width=WIDE - 10) for _ in range(5))
    answered, sizes = Answers(drive), Sizes(drive)
    window = Select(title="Window [s]", value="1", options=list(WINDOWS_S), name="window", width=80)
    hold = Toggle(label="Hold", name="hold")
    trigger = Select(title="Hold when", value=NOTHING, options=list(CHOICES), name="trigger", width=160)
    level = NumericInput(title="Level [SI, rpm]", value=0.0, mode="float", name="level", width=100)
    before = Select(title="Pre-trigger", value="0.5", options=["0.1", "0.5", "0.9"], name="before", width=80)
    export = Button(label="Export what is shown (Parquet)", name="export")
    carried = ColumnDataSource({"file": []})
    carried.js_on_change("data", CustomJS(args={"s": carried}, code=SAVE))
    held: list[Look] = []
    seen = [live.total]  # rows of the last picture

    def rows() -> int:
        return max(2, round(float(window.value) / drive.sample_time_s))

    def renew() -> None:
        said.text, digital.text = escape(live.told()), f"<b>{escape(live.replay.told())}</b>"
        why.text = _explained(scene.explainer)
        if scene.explainer is not None:
            sizes.renew(scene.explainer.found)
        if scene.responses is not None:
            answers.text = escape(scene.responses.problem) or answered.renew(scene.responses.latest)
        if hold.active or live.total < 2:
            return
        look = live.look(rows())
        si, fresh = curves(look, drive), live.total - seen[0]
        at = events(trigger.value, float(level.value or 0.0), look.fields, si)
        if holds(at, len(look.counter), float(before.value), fresh):
            hold.active = True
        held[:], seen[:] = [look], [live.total]
        _show(look, si, drive, sources)
        flags.text = escape(state_of(look.fields))

    @without_document_lock
    async def save() -> None:
        """In a thread: the first export loads pyarrow, and the pictures go on meanwhile."""
        if held:
            file = await asyncio.to_thread(parquet_of, held[0], drive)
            data = {"file": [np.frombuffer(file, np.uint8).tolist()]}
            doc.add_next_tick_callback(lambda: carried.update(data=data))

    def ask_save() -> None:
        doc.add_next_tick_callback(save)

    export.on_click(ask_save)
    said_of = (digital, said, flags, why, sizes.chosen, answers, circle)
    controls = column(row(window, hold, export), row(trigger, level, before), *said_of, width=WIDE)
    steps = row(*answered.plots.values(), sizing_mode="stretch_width")
    left = column(*plots, sizes.plot, steps, sizing_mode="stretch_width")
    doc.add_root(row(left, controls, sizing_mode="stretch_width"))
    doc.add_root(carried_root(carried))
    doc.add_periodic_callback(renew, PICTURE_MS)


SAVE = """
if (s.data.file.length === 0) return;
const link = document.createElement("a");
link.href = URL.createObjectURL(new Blob([new Uint8Array(s.data.file[0])]));
link.download = "fluxproof.parquet";
link.click();
"""


def carried_root(carried: ColumnDataSource) -> Div:
    """An element that brings the source of the export to the browser."""
    return Div(text="", tags=[carried])


def _show(look: Look, si: dict[str, np.ndarray], drive: Drive, sources: dict[str, ColumnDataSource]) -> None:
    time_s = look.counter * drive.sample_time_s
    for name in sources.keys() & COLOURS.keys():
        x, y = thinned(time_s, si[name])
        sources[name].data = {"x": x, "y": y}
    some = slice(-POINTS, None)
    sources["voltage"].data = {"x": si["u_d"][some], "y": si["u_q"][some]}
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    radius = float(si["u_dc"][-1]) / np.sqrt(3.0)
    sources["limit"].data = {"x": radius * np.cos(turn), "y": radius * np.sin(turn)}


def _explained(explainer: Explainer | None) -> str:
    if explainer is None:
        return "explanation: off"
    if not explainer.found:
        return "explanation: comes with the first seconds"
    last = [
        f"<li>to sample {e.counter}: {escape(e.verdict)}: {escape(e.text)}</li>" for e in list(explainer.found)[-5:]
    ]
    return f"explanation of the last seconds, the newest first<ol>{''.join(reversed(last))}</ol>"
