# SPDX-License-Identifier: BSD-3-Clause
"""Checks of a recording, one per file; every module in this folder with a ``check`` function is run.

A check has a STAGE and ``check(recording, nominal)``, which edits the recording in place: it appends Problems, clears
``usable`` or ``joined`` and corrects what is unambiguous.  Notes that are not findings go to meta["notes"].
One that relies on the corrections of others of its stage names their files in AFTER; nothing else orders a stage.
Stages run in this order, since each relies on the corrections of the earlier ones:

    values    missing and infinite numbers
    time      order of rows, sampling, gaps
    gates     rows in which the inverter is off
    units     degrees, percent, milliamps, shaft instead of electrical quantities
    complete  missing columns are derived from others
    channels  clipped and stuck ones, impossible values
    geometry  phases, directions, angle against speed
    signals   repeated, sums
    extent    whether enough rows remain

Effects that the diagnosis identifies are no findings: sensor offsets and gains, encoder offset, dead time, noise.
A fatal problem ends the checks.
"""

from __future__ import annotations

import importlib
import pkgutil
from graphlib import TopologicalSorter

import numpy as np

STAGES = ("values", "time", "gates", "units", "complete", "channels", "geometry", "signals", "extent")


def checks(backward: bool = False) -> list:
    """All check modules of this folder in their order; backward: those that have none, the other way round."""
    modules = {m.name: importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)}
    found = {name: module for name, module in modules.items() if hasattr(module, "check")}
    out = []
    for stage in STAGES:
        names = sorted((name for name, module in found.items() if module.STAGE == stage), reverse=backward)
        after = {name: getattr(found[name], "AFTER", ()) for name in names}
        out += [found[name] for name in TopologicalSorter(after).static_order()]
    return out


def check_recording(recording, nominal) -> None:
    """Run every check on the recording, in place; stops at a fatal problem."""
    recording.checked = True
    recording.meta.setdefault("notes", [])
    with np.errstate(all="ignore"):
        for module in checks():
            module.check(recording, nominal)
            if recording.fatal:
                return
