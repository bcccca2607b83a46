# SPDX-License-Identifier: BSD-3-Clause
"""All steps in order; whatever happens, the gates are off afterwards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fluxproof.commission import alignment, current_scale, motion, responses, winding, wiring
from fluxproof.commission.bus import Bus, BusError
from fluxproof.commission.session import LEAST_HEARTBEAT_S, Refusal, Session, Step
from golden_model.board_registers import board_generics
from golden_model.drive import Drive
from golden_model.registers import registers


def check_generics(bus: Bus, drive: Drive) -> None:
    """The core is the one of the drive file; Refusal where it was built for other widths, clocks or pins."""
    config = registers(drive).config
    # Commissioning works with currents: whether the core has a torque table or a position loop does not matter.
    beside = ("references", "position_loop", "gearing")
    asked = {name: value for name, value in config._asdict().items() if name not in beside}
    wanted = asked | {"clock_hz": round(drive.core.clock_hz)} | board_generics(drive)
    for name, value in wanted.items():
        if (found := bus.read(name)) != value:
            raise Refusal(
                f"the core has {name} = {found}, the drive file gives {value}: build it anew or check [core], "
                "[encoder], [converters]"
            )


def check_heartbeat(drive: Drive) -> None:
    """The host looks every few milliseconds; Refusal where the core would not wait as long."""
    if 0.0 < drive.protection.heartbeat_s < LEAST_HEARTBEAT_S:
        raise Refusal(
            f"[protection] heartbeat_s = {drive.protection.heartbeat_s:g}: expected at least {LEAST_HEARTBEAT_S:g} s, "
            "or none, since commissioning is no real-time program; a shorter one would trip as host_lost"
        )


def commission(
    bus: Bus,
    drive: Drive,
    reverse_given: bool | None = None,
    progress: Callable[[str], None] = lambda text: None,
    done: Callable[[Step], None] = lambda step: None,
    hold_a: float | None = None,
    respond: bool = False,
) -> tuple[Drive, list[Step]]:
    """(the drive with the measured values, the steps); Refusal with a reason.

    ``reverse_given``: the encoder's direction where the drive file states it.  ``done`` is told each step.
    ``hold_a``: only a direct current [A] for an ammeter; the drive is then the given one.  ``respond``: step responses
    too, which measure nothing of the drive.
    """
    # With one update a period: the equations of a snapshot are those of a voltage that stands a whole period.  Without
    # the torque table: i_d_ref and i_q_ext are currents.
    plain = replace(drive, core=replace(drive.core, updates_per_period=1, references=False))
    session, steps = Session(bus, plain, progress), []

    def add(step: Step) -> Step:
        steps.append(step)
        done(step)
        return step

    try:
        check_generics(bus, drive)
        check_heartbeat(drive)
        add(wiring.offsets(session))
        add(wiring.phases(session))
        if hold_a is not None:
            add(current_scale.hold(session, hold_a))
            return drive, steps
        aligned = add(alignment.align(session, reverse_given))
        wound = add(winding.measure(session, aligned.notes["volts_per_a"]))
        moved = add(motion.inertia(session))
        add(motion.magnet(session, moved, wound.values["v_dead"].value))
        add(motion.closed_loop(session))
        found = _finished(session.drive, drive)
        if respond:
            add(responses.step_responses(session, found))
        add(current_scale.compare(drive, found))
    except BusError as error:
        raise Refusal(str(error)) from None
    finally:
        bus.write("enable", 0)
        bus.write("position_source", 0)
    return found, steps


def _finished(found: Drive, given: Drive) -> Drive:
    """The file's own update rate again; its slopes of the devices, which the measured R contains, taken off."""
    i = given.inverter
    ohm = found.machine.resistance_ohm - (i.r_switch_ohm + i.r_diode_ohm) / 2.0
    if ohm <= 0.0:
        raise Refusal(
            f"R = {found.machine.resistance_ohm:.4g} ohm with the devices, expected more than [inverter] r_switch_ohm "
            "and r_diode_ohm; check these keys"
        )
    return replace(found, core=given.core, machine=replace(found.machine, resistance_ohm=ohm))
