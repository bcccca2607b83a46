# SPDX-License-Identifier: BSD-3-Clause
"""Addresses of recordings: which are of this machine, and which protocols may be opened by whose word.

An address that the user types is the user's word.  A manifest may come from a stranger: its addresses reach other
machines only by protocols that the user allows, as a request alone says who asks, and may send credentials.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO

import fsspec
from fsspec.utils import infer_compression

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.quote import shown
from golden_model.regular_file import open_regular

HERE = frozenset({"file", "local"})
ARCHIVES = frozenset({"zip", "tar"})  # of the address that follows them after ::
REFUSED = frozenset({"reference", "generic"})  # they open further addresses, which the address does not show
MOST_BYTES = 16 << 30  # of a recording that is fetched
MOST_NAME = 100
BLOCK = 1 << 20


def remote(recording: str) -> bool:
    """Whether it is in an object store or an archive, which fsspec opens."""
    return "://" in recording


def check_address(address: str, allowed: Iterable[str] | None = None) -> None:
    """RecordingError unless the address is of known parts and of allowed protocols; None allows every protocol.

    Of a chain, all parts but the last must be archives: the others that fsspec knows keep copies, or read from a file
    which further addresses to open.
    """
    parts = address.split("::")
    for part, inside in zip(parts, parts[1:], strict=False):
        if protocol_of(part) not in ARCHIVES:
            raise RecordingError(f"{shown(address, 200)}: {shown(part)!r} before '::'; expected zip://… or tar://…")
        if protocol_of(part) == "tar" and infer_compression(inside):  # to find its members means to unpack all of it
            raise RecordingError(f"{shown(address, 200)}: a compressed tar archive is not opened; expected tar or zip")
    last = parts[-1]
    protocol = protocol_of(last)
    if not protocol or protocol in ARCHIVES:
        expected = f"expected {protocol}://NAME::file://PATH" if protocol else "expected PROTOCOL://… after '::'"
        raise RecordingError(f"{shown(address, 200)}: {expected}")
    if protocol in HERE:
        return
    if protocol in REFUSED or protocol not in fsspec.available_protocols():
        raise RecordingError(f"{shown(address, 200)}: the protocol {shown(protocol)!r} is not opened")
    if allowed is not None and protocol not in allowed:
        raise RecordingError(f"{shown(address, 200)}: {protocol}:// in a manifest needs the option --allow {protocol}")


def protocol_of(part: str) -> str:
    """The protocol of one part of a chain, '' if it has none."""
    return part.partition("://")[0] if "://" in part else ""


@contextlib.contextmanager
def opened(recording: str) -> Iterator[IO[bytes]]:
    """A recording open for reading bytes; OSError if it is no regular file or cannot be read."""
    if not remote(recording):
        with open_regular(recording) as file:
            yield file
        return
    with _as_os_error():
        _check_target(recording)
        source = fsspec.open(recording, "rb")
        assert isinstance(source, fsspec.core.OpenFile)  # one name gives one file
        with source as file:  # its end closes the archive too, which reading needs until then
            yield file


def stated(recording: str) -> dict:
    """What an object store or archive says of a recording (size, ETag, ...); OSError if it cannot be read."""
    with _as_os_error():
        _check_target(recording)
        system, path = fsspec.core.url_to_fs(recording)
        return system.info(path)


def matching(pattern: str) -> list[str]:
    """The addresses that a pattern of an object store matches; RecordingError if there are none."""
    with _as_os_error():
        _check_target(pattern)
        system, path = fsspec.core.url_to_fs(pattern)
        names = sorted(system.glob(path))
    if not names:
        raise RecordingError(f"{pattern}: no file matches it")
    if odd := next((name for name in names if "::" in name), None):  # an archive's author would choose the address
        raise RecordingError(f"{pattern}: the name {shown(odd)!r} contains '::'")
    first, chain, tail = pattern.partition("::")
    if chain:
        return [f"{protocol_of(first)}://{name}{chain}{tail}" for name in names]
    return [system.unstrip_protocol(name) for name in names]


def _check_target(recording: str) -> None:
    check_address(recording)
    target = recording.rsplit("::", maxsplit=1)[-1]
    if protocol_of(target) in HERE and "*" not in target:
        open_regular(fsspec.core.strip_protocol(target)).close()  # an archive may be a FIFO, too


@contextlib.contextmanager
def _as_os_error():
    """The libraries behind fsspec raise exceptions of their own on damaged archives and answers."""
    try:
        yield
    except (OSError, MemoryError, RecordingError):
        raise
    except Exception as error:
        raise OSError(f"{type(error).__name__}: {error}") from None


def blocks(file, limit_s: float | None = None, most: int | None = None):
    """The bytes of a file by blocks; OSError beyond ``most`` bytes or ``limit_s`` seconds."""
    until = time.monotonic() + limit_s if limit_s else None
    count = 0
    while block := file.read(BLOCK):
        count += len(block)
        if most is not None and count > most:
            raise OSError(f"more than {most >> 30} GB")
        if until is not None and time.monotonic() > until:
            raise OSError(f"reading it took longer than {limit_s:g} s")
        yield block


@contextlib.contextmanager
def local(recording: str):
    """The path of a recording on this machine; one of an object store is fetched for as long as it is used."""
    if not remote(recording):
        yield Path(recording)
        return
    with tempfile.TemporaryDirectory(prefix="fluxproof_") as folder:
        target = Path(folder) / file_name(recording)
        with opened(recording) as source, open(target, "wb") as file:
            for block in blocks(source, most=MOST_BYTES):
                file.write(block)
        yield target


def file_name(address: str) -> str:
    """The name of an address's file, of letters that stay in a folder: the reader needs its suffix."""
    last = re.split(r"[/\\]", address.split("::", maxsplit=1)[0].rstrip("/"))[-1]
    return re.sub(r"[^\w.+@ -]", "_", last)[-MOST_NAME:].lstrip(".") or "recording"


def spelled(name: str) -> str:
    r"""A name as text that any file can hold: a byte that is not UTF-8 becomes \xNN; different names stay different."""
    try:
        name.encode()
        plain = r"\x" not in name
    except UnicodeEncodeError:
        plain = False
    if plain:
        return name
    return os.fsencode(name.replace("\\", r"\\")).decode("utf-8", "backslashreplace")
