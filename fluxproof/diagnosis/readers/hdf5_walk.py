# SPDX-License-Identifier: BSD-3-Clause
"""What an HDF5 file contains, found without following it anywhere else (not itself a reader).

h5py would open other files that a link, an external data set or a virtual one names, and load a plugin for a filter
that the library does not have.  All of these are refused by name, before any number is read.
"""

from __future__ import annotations

import math
import os

from fluxproof.diagnosis.ground.limits import most_cells
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.quote import shown

MOST_OBJECTS = 20_000
MOST_DEPTH = 32  # groups inside each other
FILTERS = {1, 2, 3, 4, 5, 6, 32000}  # deflate, shuffle, Fletcher, szip, n-bit, scale and offset, LZF: in h5py itself


def safe_datasets(file, path) -> dict:
    """{path in the file: data set} of all data sets stored in this file, each once; RecordingError for the rest."""
    return tree(file, path)[0]


def tree(file, path) -> tuple[dict, set]:
    """(safe_datasets, addresses of all objects that have a name)."""
    import h5py

    found, seen = {}, set()
    left = [("", file, 0)]
    while left:
        prefix, group, depth = left.pop()
        for name in _links(group, path):
            item = group[name]
            address = _address(item.id)
            if address in seen:
                continue  # another name of the same, or a ring
            seen.add(address)
            if len(seen) > MOST_OBJECTS:
                raise RecordingError(f"{path}: more than {MOST_OBJECTS} groups and data sets")
            where = f"{prefix}{name}"
            if isinstance(item, h5py.Dataset):
                if item.external or item.is_virtual:
                    raise RecordingError(
                        f"{path}: data set {shown(where)} stores its data in another file; such links are not followed"
                    )
                found[where] = item
            elif isinstance(item, h5py.Group):
                if depth == MOST_DEPTH:
                    raise RecordingError(f"{path}: more than {MOST_DEPTH} groups inside each other ({shown(where)})")
                left.append((f"{where}/", item, depth + 1))
    return dict(sorted(found.items())), seen


def check_references(datasets, known, path) -> None:
    """RecordingError for a reference to an object that has no name in the file, and so was not seen by ``tree``."""
    import h5py

    for name, dataset in datasets.items():
        if h5py.check_ref_dtype(dataset.dtype) is None or not dataset.size:
            continue
        if dataset.size > MOST_OBJECTS:
            raise RecordingError(f"{path}: data set {shown(name)} has more than {MOST_OBJECTS} references")
        for reference in dataset[()].ravel():
            if reference and _address(h5py.h5r.dereference(reference, dataset.id)) not in known:
                raise RecordingError(f"{path}: data set {shown(name)} refers to an object that has no name")


def check_readable(dataset, path) -> None:
    """RecordingError for a data set that needs a plugin, unpacks to too much at once, or was mostly never written."""
    where = f"{path}: data set {shown(dataset.name)}"
    settings = dataset.id.get_create_plist()
    for k in range(settings.get_nfilters()):
        code, _, _, name = settings.get_filter(k)
        if code not in FILTERS:
            label = shown(name.decode("utf-8", "replace"), 24)
            raise RecordingError(
                f"{where} is packed with filter {code} ({label}), which needs a plugin; plugins are not loaded: "
                f"repack it with gzip"
            )
    most = 8 * most_cells(os.stat(path).st_size)
    if math.prod(dataset.chunks or (1,)) * dataset.dtype.itemsize > most:
        raise RecordingError(f"{where} has chunks above {most / 1e6:.0f} MB, the limit of the file's size")
    if dataset.chunks is None:
        stored, declared, unit = dataset.id.get_storage_size(), dataset.size * dataset.dtype.itemsize, "bytes"
    else:
        parts = zip(dataset.shape, dataset.chunks, strict=True)
        stored, declared, unit = dataset.id.get_num_chunks(), math.prod(-(-n // c) for n, c in parts), "chunks"
    if 2 * stored < declared:  # the rest would come as the fill value
        raise RecordingError(f"{where} declares {declared} {unit} and stores {stored}: it was not written")


def _links(group, path) -> list[str]:
    """The names of the hard links; soft links lead to what has another name; RecordingError for external ones."""
    import h5py

    if group.id.get_num_objs() > MOST_OBJECTS:
        raise RecordingError(f"{path}: more than {MOST_OBJECTS} groups and data sets")
    names = []
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            target = shown(link.filename)
            raise RecordingError(
                f"{path}: {shown(name)} is a link to another file ({target}); such links are not followed"
            )
        if isinstance(link, h5py.HardLink):
            names.append(name)
    return names


def _address(identifier) -> tuple:
    from h5py import h5o  # pyright: ignore[reportAttributeAccessIssue]  # compiled, without types

    info = h5o.get_info(identifier)
    return info.fileno, info.addr
