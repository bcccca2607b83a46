"""MDF measurement files (.mf4, .mdf), read with asammdf.

Channels on several rasters are resampled to one: that of the requested channel with the most samples, which in a
recording of a drive are the currents.  The others hold their last value, and a note reports it.  The time of the
raster is a column "time" in seconds.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.table import Table, chosen, row_limit, shown, too_long

FORMAT = "MDF"
SUFFIXES = (".mf4", ".mdf", ".dat4")
TIME = "time"
MOST_BYTES = 8_000_000_000


def matches(head: bytes, path) -> bool:
    return head.startswith((b"MDF     ", b"UnFinMF "))


def read(path, select=None) -> Table:
    """The requested channels on one raster."""
    import logging

    logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # it reports a damaged file's blocks one by one
    from asammdf import MDF

    with MDF(path) as mdf:
        places, units = _channels(mdf)
        wanted = [name for name in chosen(units | {TIME: "s"}, select, path) if name != TIME]
        if not wanted:
            raise RecordingError(f"{path}: contains no channel except the time")
        limit = row_limit(len(wanted) + 1)
        for group in {places[name][0] for name in wanted}:
            block = mdf.groups[group].channel_group
            if block.cycles_nr * max(1, block.samples_byte_nr) > MOST_BYTES:
                raise RecordingError(
                    f"{path}: channel group {group} declares {block.cycles_nr} samples, too many to read"
                )
        signals = mdf.select(
            [(None, *places[name]) for name in wanted], record_count=limit, copy_master=False
        )
        return _table(path, wanted, signals, units, limit)


def _channels(mdf):
    """({name: (group, channel)}, {name: unit}) of the value channels; duplicate names get their group."""
    places, units = {}, {}
    for g, group in enumerate(mdf.groups):
        master = mdf.masters_db.get(g)
        for c, channel in enumerate(group.channels):
            if c == master:
                continue
            name = channel.name if channel.name not in places else f"{channel.name} (group {g})"
            if name == TIME:
                name = f"{TIME} (group {g})"
            places[name] = g, c
            units[name] = (channel.unit or "").strip()
    return places, units


def _table(path, wanted, signals, units, limit) -> Table:
    text = [
        name
        for name, s in zip(wanted, signals, strict=True)
        if s.samples.dtype.kind not in "biuf" or s.samples.ndim != 1
    ]
    numeric = {name: s for name, s in zip(wanted, signals, strict=True) if name not in text and len(s)}
    if not numeric:
        raise RecordingError(f"{path}: none of the requested channels contains numbers")
    main = max(numeric, key=lambda name: len(numeric[name]))
    raster = np.asarray(numeric[main].timestamps, float)
    columns, other = {TIME: raster}, []
    for name, signal in numeric.items():
        stamps = np.asarray(signal.timestamps, float)
        values = np.asarray(signal.samples).astype(float)
        if len(stamps) != len(raster) or not np.array_equal(stamps, raster):
            other.append(name)
            at = np.searchsorted(stamps, raster, side="right") - 1
            values = np.where(at < 0, np.nan, values[np.maximum(at, 0)])
        columns[name] = values
    table = Table(columns, {n: u for n, u in units.items() if u and n in columns} | {TIME: "s"}, text=text)
    if other:
        names = ", ".join(shown(name, 24) for name in other[:6]) + (", ..." if len(other) > 6 else "")
        table.notes.append(
            f"{names} are on other rasters; their last value is repeated on the raster of {shown(main)}"
        )
    if len(raster) >= limit:
        table.problems.append(too_long(limit))
    return table
