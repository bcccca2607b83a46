# SPDX-License-Identifier: BSD-3-Clause
"""What is fuzzed, one module each, with

SECONDS      processor time that one case may take
TURN         cases of a turn
NAMES_FILE   whether a message must name the case's file
cases()      -> strategy of Hypothesis that draws a Case
run(path)    reads the file as a command does; returns, or raises RecordingError or DriveError
warm(folder) loads what run needs, with a valid input, before anything is watched or measured
"""

from __future__ import annotations

import importlib
import pkgutil


def names() -> list[str]:
    """The targets, in alphabetical order."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def by_name(name: str):
    """The module of a target."""
    return importlib.import_module(f"{__name__}.{name}")
