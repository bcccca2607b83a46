# SPDX-License-Identifier: BSD-3-Clause
"""One simulation from a drive to its data and its page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fluxproof.simulate import figures, page, verdict
from fluxproof.simulate.margins import current_loop, margins, speed_loop, turning_current_loop
from fluxproof.simulate.move import move_scene, of_move
from fluxproof.simulate.regeneration import Regeneration, regeneration, told, trip_v
from fluxproof.simulate.ripple import ripple
from fluxproof.simulate.run import Run, run
from fluxproof.simulate.scene import current_step, fast_current_step, fastest, main_scene
from fluxproof.simulate.speed_range import speed_range
from fluxproof.simulate.trip import beyond, of_trip, top_speed, trip, unjudged
from golden_model.board_registers import core_changes
from golden_model.drive import Drive
from golden_model.registers import RegisterSet, registers


def simulate(
    drive: Drive, name: str, say: Callable[[str], None] = lambda text: None, plant: Sequence[str] = ()
) -> tuple[dict, Callable[[], str]]:
    """(simulation.json as data, a function that renders the page); DriveError where the drive cannot be simulated.

    ``say`` is told in a word or two what is being done; ``plant``: keys of [plant.*], which are not simulated.
    """
    register_set = registers(drive)
    if drive.encoder.kind == "hall":  # its code is electrical, its speed that between edges
        register_set = register_set._replace(values=register_set.values._replace(**core_changes(drive)))
    scene = main_scene(drive)
    say("compiling")
    step = run(drive, register_set, current_step(drive))
    fast = run(drive, register_set, fast_current_step(drive))
    main = run(drive, register_set, scene, lambda done, total: say(f"{100 * done // total} %"))
    moved = run(drive, register_set, move_scene(drive)) if drive.core.position_loop else None
    loops = {f"current loop, {axis} axis": current_loop(drive, register_set, axis) for axis in "dq"}
    loops["current loop, top speed"] = turning_current_loop(drive, register_set, fastest(drive))
    outer = speed_loop(drive, register_set)
    if outer is not None:
        loops["speed loop"] = outer
    found = {loop: margins(value) for loop, value in loops.items()}
    reached = speed_range(drive, top_speed(register_set, drive))
    say("ripple")
    loaded = main.scene.stages[2]
    rippled = ripple(drive, main, loaded.end, _turn(drive, main, loaded.end))
    back = regeneration(drive, _untripped(drive, register_set, main))
    tripped = trip(drive, register_set)
    runs = [main, step, fast, *([] if moved is None else [moved])]
    highest = max(float(each["true_u_dc"].max()) for each in runs)
    over = beyond(drive, tripped, highest)
    needed = told(drive, back) if "u_dc_high" in main.faults else ""
    status, reason = verdict.judge(drive, found, runs, over, needed)
    if status == "ok":
        reason = "; ".join(filter(None, (reason, unjudged(drive, tripped))))
    data = {
        "drive": name,
        "status": status,
        "reason": reason,
        "reference_unit": "A" if scene.imposed else "rpm",
        "scene": [_stage(drive, stage) for stage in scene.stages],
        "margins": {loop: value.to_json() for loop, value in found.items()},
        "figures": _figures(drive, (main, step, fast), rippled, back),
        "modelled": verdict.modelled(drive, [main]),
        "not_modelled": verdict.not_modelled(drive, [main], plant),
    }

    data["figures"]["Speed range"] = reached.figures()
    data["figures"]["Trip at the top speed"] = of_trip(drive, tripped, trip_v(drive))
    if moved is not None:
        data["figures"]["Position"] = of_move(drive, moved)
        data["move"] = [_stage(drive, stage) for stage in moved.scene.stages]

    def pages() -> str:
        from fluxproof.simulate import pictures  # matplotlib takes a second

        say("report")
        return page.render(data, drive, pictures.draw(drive, main, step, loops, rippled, reached, moved))

    return data, pages


def _untripped(drive: Drive, register_set: RegisterSet, main: Run) -> Run:
    """The run, or one on an ideal bus where the bus has tripped: what braking would feed back."""
    if "u_dc_high" not in main.faults:
        return main
    return run(replace(drive, supply=replace(drive.supply, source="ideal")), register_set, main_scene(drive))


def _figures(drive: Drive, runs: tuple[Run, Run, Run], rippled: dict, back: Regeneration) -> dict:
    main, step, fast = runs
    groups = {} if main.scene.imposed else {"Speed": figures.of_speed(main)}
    steps = figures.of_current_step(step) | figures.of_current_step(fast, "_at_top_speed")
    groups["Currents"] = steps | figures.of_currents(main) | figures.of_ripple(rippled, main, main.scene.stages[2])
    groups["Voltage and power"] = figures.of_voltage(drive, main)
    groups["Supply"] = figures.of_supply(drive, main, back)
    groups["Heat"] = figures.of_heat(drive, main)
    return groups


def _stage(drive: Drive, stage) -> dict:
    t_s = drive.sample_time_s
    return {
        "name": stage.name,
        "from_s": round(stage.first * t_s, 9),
        "to_s": round(stage.end * t_s, 9),
        "reference": stage.reference,
        "load_nm": stage.load,
    }


def _turn(drive: Drive, main: Run, end: int) -> int:
    """Samples of an electrical turn at the end of a stage, 200 at least: the ripple depends on the angle."""
    omega = float(np.abs(main["true_omega_m"][end - 1])) * drive.machine.pole_pairs
    return max(200, min(round(2.0 * np.pi / max(omega, 1.0) / drive.sample_time_s), end - 1))
