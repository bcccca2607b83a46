# SPDX-License-Identifier: BSD-3-Clause
"""The sealed truth: one compressed file next to the case folders, whose SHA-256 is fixed before any run."""

from __future__ import annotations

import hashlib
import json
import os
import zlib
from pathlib import Path

from fluxproof.files import write_text


class SealError(ValueError):
    """The truth is missing or is not the one that was sealed."""


def truth_path(folder: Path) -> Path:
    """Path of the truth of the cases in ``folder``, outside of it."""
    return folder.parent / f"truth_{folder.name}.sealed"


def seal(folder: Path, truth: dict) -> str:
    """Write the truth and, into the cases' folder, its hash; returns the hash."""
    packed = zlib.compress(json.dumps(truth, sort_keys=True).encode(), 9)
    path = truth_path(folder)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_bytes(packed)
    os.replace(temporary, path)
    digest = hashlib.sha256(packed).hexdigest()
    write_text(folder / "sealed.sha256", digest + "\n")
    return digest


def unseal(folder: Path) -> dict:
    """The truth, after its hash has been compared with the one fixed at sealing; SealError if it differs."""
    path, note = truth_path(folder), folder / "sealed.sha256"
    try:
        packed, wanted = path.read_bytes(), note.read_text().strip()
    except OSError as error:
        raise SealError(f"{error.filename}: cannot be read: {error.strerror}; run studies.blind.generate") from None
    found = hashlib.sha256(packed).hexdigest()
    if found != wanted:
        raise SealError(f"{path}: SHA-256 is {found}, sealed was {wanted}: the truth was changed after sealing")
    return json.loads(zlib.decompress(packed))
