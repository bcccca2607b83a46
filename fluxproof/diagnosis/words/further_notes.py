# SPDX-License-Identifier: BSD-3-Clause
"""Notes on what a session did beside the physics: the prior, the written files, the closed loop."""

from __future__ import annotations

from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.ground.recording import Problem
from fluxproof.diagnosis.ground.result import Fleet

FLUX_MAP = (
    "flux_map.csv contains the flux linkage over the recorded currents; "
    'use it by [plant.machine] flux_map = "flux_map.csv".'
)
OVERLAY_SIGNALS = ("u_d_ref", "u_q_ref")  # not the currents: the controller regulates them to their references

WORSE = "in the closed loop its voltage is further from the recorded one than that of the nominal drive"


def prior_note(fleet: Fleet, decision: Decision) -> str:
    """That a fleet was the prior, and what it did."""
    if decision.basis is None:
        did = "it was not used, as the physics was not diagnosed"
    elif decision.posterior is None:
        did = "it was not used, as one operating point is judged without a prior"
    else:
        did = "it changed the prior odds of the effects, to even odds at most, so the fleet alone is no evidence"
    return f"The population of {fleet.drives} drives in {fleet.path} was the prior: {did}."


def not_improved(name: str, error: Exception | str) -> str:
    """Why the improved drive file was not written."""
    return f"No {name}: {error}."


def not_simulated(error: Exception) -> str:
    return f"The closed loop was not simulated: {error}."


def ran_with(differ: dict) -> Problem:
    """That a dump was recorded with other trims than the drive file has; differ: {key: (that ran, of the file)}."""
    numbers = lambda values: ", ".join(f"{v:.6g}" for v in values)  # noqa: E731
    each = "; ".join(f"{key} = {numbers(ran)}, not {numbers(file)}" for key, (ran, file) in differ.items())
    message = (
        f"recorded with other trims than the drive file has: {each}; what is found is the error with those that ran"
    )
    return Problem("other_trims", message, action="new trims count from those that ran")


def not_trimmed(keys) -> Problem:
    """That the error found is the one that a trim of the drive file cancels."""
    names = " and ".join(keys)
    message = f"the error found is the one that {names} of the drive file cancels: recorded without that trim"
    return Problem("other_trims", message, action="not applied twice")


def trims_unknown(keys) -> Problem:
    """That a recording does not say whether it was made with the trims of the drive file."""
    message = (
        f"the drive file has trims ({', '.join(keys)}), which act only on recordings made with them, and this one does "
        "not say whether it was"
    )
    return Problem("other_trims", message, action="new trims assume that it was")


def loop_notes(laid_over: dict) -> list[str]:
    """How far the voltage commands of the closed loop are off, with the nominal and with the improved drive."""
    notes = []
    for signal in OVERLAY_SIGNALS:
        before = laid_over["rms_before"].get(signal)
        after = laid_over.get("rms_after", {}).get(signal)
        if before is not None:
            then = f" and by {after:.3g} V with the improved drive" if after is not None else ""
            notes.append(
                f"In closed-loop simulation, {signal} differs by {before:.3g} V rms with the nominal drive{then}."
            )
    return notes
