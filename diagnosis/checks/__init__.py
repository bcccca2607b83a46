"""Checks of a recording, one a file; a new file here is found by itself.

A check has a STAGE and ``check(recording, nominal)``, which edits the recording in place: it appends Problems, clears
``usable`` or ``joined`` and mends what is unambiguous.  Notes, which are not findings, go to meta["notes"].
Stages run in this order, since each believes what the ones before it made right:

    values    missing and infinite numbers
    time      order of rows, sampling, gaps
    units     degrees, percent, milliamps, shaft for electrical
    complete  what is missing is derived from what is there
    geometry  phases, directions, angle against speed
    signals   clipped, stuck, repeated, sums
    extent    whether enough is left

Physics that the diagnosis is to find is no finding: offsets and gains of sensors, a turned encoder, dead time, noise.
A fatal problem ends the checking.
"""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np

STAGES = ("values", "time", "units", "complete", "geometry", "signals", "extent")


def checks() -> list:
    """Every check of this folder in the order it runs."""
    modules = [importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)]
    found = [m for m in modules if hasattr(m, "check")]
    return sorted(found, key=lambda m: (STAGES.index(m.STAGE), m.__name__))


def check_recording(recording, nominal) -> None:
    """Run every check on the recording, in place; stops at a fatal problem."""
    with np.errstate(all="ignore"):
        for module in checks():
            module.check(recording, nominal)
            if recording.fatal:
                return
