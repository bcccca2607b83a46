"""All steps in order; whatever happens, the gates are off afterwards."""

from __future__ import annotations

from collections.abc import Callable

from fluxproof.commission import alignment, motion, winding, wiring
from fluxproof.commission.bus import Bus, BusError
from fluxproof.commission.session import Refusal, Session, Step
from fluxproof.golden_model.drive import Drive
from fluxproof.golden_model.registers import registers


def check_generics(bus: Bus, drive: Drive) -> None:
    """The core is the one of the drive file; Refusal where it was built for other widths, carrier or clock."""
    config = registers(drive).config
    wanted = config._asdict() | {"clock_hz": round(drive.core.clock_hz)}
    for name, value in wanted.items():
        if (found := bus.read(name)) != value:
            raise Refusal(f"the core has {name} = {found}, the drive file gives {value}: build it anew or check [core]")


def commission(
    bus: Bus,
    drive: Drive,
    reverse_given: bool | None = None,
    progress: Callable[[str], None] = lambda text: None,
    done: Callable[[Step], None] = lambda step: None,
) -> tuple[Drive, list[Step]]:
    """(the drive with the measured values, the steps); Refusal with a reason.

    ``reverse_given``: the encoder's direction where the drive file states it.  ``done`` is told each step.
    """
    session, steps = Session(bus, drive, progress), []

    def add(step: Step) -> Step:
        steps.append(step)
        done(step)
        return step

    try:
        check_generics(bus, drive)
        add(wiring.offsets(session))
        add(wiring.phases(session))
        aligned = add(alignment.align(session, reverse_given))
        wound = add(winding.measure(session, aligned.notes["volts_per_a"]))
        moved = add(motion.inertia(session))
        add(motion.magnet(session, moved, wound.values["v_dead"].value))
        add(motion.closed_loop(session))
    except BusError as error:
        raise Refusal(str(error)) from None
    finally:
        bus.write("enable", 0)
        bus.write("position_source", 0)
    return session.drive, steps
