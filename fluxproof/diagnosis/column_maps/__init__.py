# SPDX-License-Identifier: BSD-3-Clause
"""Column maps for well-known logs, one file each; every module in this folder is used.

A map has

    NAME       its name in messages
    SIGNATURE  file columns (in the notation of ``key``) that identify this log
    COLUMNS    {file column: (canonical column, unit)}
    KEY        optional: function that simplifies a file column's name before the look-up
    ASSUMED    optional: {canonical column: constant} for columns that the log lacks
    SAMPLE_TIME_S  optional: for logs without a time column
    RUN        optional: file column whose change starts a new run
    NOTES      optional: notes for the reader of the diagnosis

The docstring of a map gives the source of its facts.
"""

from __future__ import annotations

import importlib
import pkgutil


def maps() -> list:
    """All maps of this folder."""
    return [importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)]


def plain(name: str) -> str:
    """The name in lower case, the default key of a look-up."""
    return name.strip().lower()


def last_part(name: str) -> str:
    """The last part of a path of a tree of signals, in lower case: "odrv0.axis0.motor.foc.Iq_measured"."""
    return plain(name).replace("/", ".").strip('."').rsplit(".", 1)[-1]
