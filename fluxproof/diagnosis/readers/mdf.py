# SPDX-License-Identifier: BSD-3-Clause
"""MDF measurement files (.mf4, .mdf), read with asammdf.

Channels on several rasters are resampled to one: that of the requested channel with the most samples, which in a
recording of a drive are the currents.  The others hold their last value, and a note reports it.  The time of the
raster is a column "time" in seconds.  asammdf reads raw values only: conversions are applied by mdf_conversion.py, and
formulas, attachments and frames of buses are not touched.
"""

from __future__ import annotations

import contextlib
import os
from typing import Any

import numpy as np

from fluxproof.diagnosis.ground.limits import check_cells, most_cells
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.mdf_chains import check_chains
from fluxproof.diagnosis.readers.mdf_conversion import is_plain, physical, refusal
from fluxproof.diagnosis.readers.table import Table, chosen, row_limit, shown, too_long

FORMAT = "MDF"
SUFFIXES = (".mf4", ".mdf", ".dat4")
LIBRARIES = ("asammdf",)
TIME = "time"
REMOTE_MASTER = 1 << 3  # flag of a channel group in ASAM MDF 4.2
EXPORT = "export the file with its conversions applied"


def matches(head: bytes, path) -> bool:
    return head.startswith((b"MDF     ", b"UnFinMF "))


def read(path, select=None) -> Table:
    """The requested channels on one raster."""
    import logging

    logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # it reports a damaged file's blocks one by one
    from asammdf import MDF

    if str(path).lower().endswith((".zip", ".mf4z")):  # the name alone would make asammdf unpack it
        raise RecordingError(f"{path}: packed; unpack it first")
    check_chains(path)
    options: dict[str, Any] = {"process_bus_logging": False, "use_display_names": False}
    with _no_evaluation(), MDF(path, **options) as mdf:
        places, units = _channels(mdf)
        wanted = [name for name in chosen(units | {TIME: "s"}, select, path) if name != TIME]
        if not wanted:
            raise RecordingError(f"{path}: contains no channel except the time")
        limit = row_limit(len(wanted) + 1)
        _check_sizes(path, mdf, [places[name] for name in wanted], limit)
        conversions = _taken_out(path, mdf, {name: places[name] for name in wanted})
        signals = mdf.select(
            [(None, *places[name]) for name in wanted], record_count=limit, copy_master=False, raw=True
        )
        return _table(path, wanted, _physical(signals, conversions, mdf.version >= "4"), units, limit)


@contextlib.contextmanager
def _no_evaluation():
    """No formula can be evaluated by asammdf meanwhile, whichever way it takes to a conversion; bus frames neither."""
    from asammdf.blocks import v2_v3_blocks, v4_blocks

    def refuse(*_, **__):
        raise RecordingError("contains a formula, which is not evaluated")

    names = ("evaluate", "lambdify", "symbols")
    before = [(module, name, getattr(module, name)) for module in (v2_v3_blocks, v4_blocks) for name in names]
    for module, name, _ in before:
        setattr(module, name, refuse)
    try:
        yield
    finally:
        for module, name, function in before:
            setattr(module, name, function)


def _channels(mdf):
    """({name: (group, channel)}, {name: unit}) of the value channels; duplicate names get their group."""
    places, units = {}, {}
    for g, group in enumerate(mdf.groups):
        master = mdf.masters_db.get(g)
        for c, channel in enumerate(group.channels):
            if c == master:
                continue
            name = channel.name
            if name in places or name == TIME:
                name = f"{channel.name} (group {g})"
            if name in places:
                name = f"{channel.name} (group {g}, channel {c})"
            places[name] = g, c
            units[name] = (channel.unit or getattr(channel.conversion, "unit", "") or "").strip()
    return places, units


def _check_sizes(path, mdf, places, limit: int) -> None:
    """RecordingError if the groups of the requested channels declare more than a file of this size can have."""
    cells, size = 0, os.stat(path).st_size
    for group in sorted({g for g, _ in places}):
        block = mdf.groups[group].channel_group
        what = f"channel group {group}"
        # What is not needed is unpacked, too.
        if block.cycles_nr * max(1, block.samples_byte_nr) > 8 * most_cells(size):
            raise RecordingError(f"{path}: {what} declares {block.cycles_nr} samples, too many for its {size} bytes")
        cells += min(block.cycles_nr, limit) * (1 + sum(g == group for g, _ in places))
        check_cells(path, cells, what)


def _taken_out(path, mdf, places) -> dict:
    """{name: (conversion, conversion of its master or None)}; afterwards no channel has one, nor an attachment.

    RecordingError names a requested channel whose conversion, or that of its time, cannot be applied.
    """
    newer = mdf.version >= "4"
    found = {}
    for name, (g, c) in places.items():
        conversion, clock = mdf.groups[g].channels[c].conversion, _master(mdf, g, newer)
        timed = getattr(clock, "conversion", None)
        if reason := refusal(conversion, newer):
            raise RecordingError(f"{path}: channel {shown(name)} has {reason}; {EXPORT}")
        if not is_plain(timed, newer):
            reason = refusal(timed, newer) or "a conversion that is not linear"
            raise RecordingError(f"{path}: the time of channel {shown(name)} has {reason}; {EXPORT}")
        if not newer and not getattr(clock, "bit_count", 1):
            timed = None  # counted rows times the sampling rate
        found[name] = conversion, timed
    for group in mdf.groups:
        for channel in group.channels:
            channel.conversion = None
            if newer:
                channel.attachment = None  # may name another file, which asammdf would open
    return found


def _master(mdf, g: int, newer: bool):
    """The channel that gives the time of a group, or None; it may be in another group."""
    block = mdf.groups[g].channel_group
    if newer and block.flags & REMOTE_MASTER:
        g = block.cg_master_index
    index = mdf.masters_db.get(g)
    return None if index is None else mdf.groups[g].channels[index]


def _physical(signals, conversions, newer: bool) -> list:
    """(timestamps, values) of each signal; values (n,) float, or None for what is no plain number."""
    result = []
    for signal, (conversion, timed) in zip(signals, conversions.values(), strict=True):
        values = np.asarray(signal.samples)
        numeric = values.dtype.kind in "biuf" and values.ndim == 1
        values = physical(conversion, values, newer) if numeric else None
        stamps = physical(timed, np.asarray(signal.timestamps, float), newer)
        result.append((np.asarray(stamps, float), None if values is None else values.astype(float)))
    return result


def _table(path, wanted, signals, units, limit) -> Table:
    text = [name for name, (_, values) in zip(wanted, signals, strict=True) if values is None]
    numeric = {n: s for n, s in zip(wanted, signals, strict=True) if n not in text and len(s[1])}
    if not numeric:
        raise RecordingError(f"{path}: none of the requested channels contains numbers")
    main = max(numeric, key=lambda name: len(numeric[name][1]))
    raster = numeric[main][0]
    columns, other = {TIME: raster}, []
    for name, (stamps, values) in numeric.items():
        if len(stamps) != len(raster) or not np.array_equal(stamps, raster):
            other.append(name)
            at = np.searchsorted(stamps, raster, side="right") - 1
            values = np.where(at < 0, np.nan, values[np.maximum(at, 0)])
        columns[name] = values
    table = Table(columns, {n: u for n, u in units.items() if u and n in columns} | {TIME: "s"}, text=text)
    if other:
        names = ", ".join(shown(name, 24) for name in other[:6]) + (", ..." if len(other) > 6 else "")
        table.notes.append(f"{names} are on other rasters; their last value is repeated on the raster of {shown(main)}")
    if len(raster) >= limit:
        table.problems.append(too_long(limit))
    return table
