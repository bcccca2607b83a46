# SPDX-License-Identifier: BSD-3-Clause
"""Writing results: to a temporary name first, then renamed, so that no file is incomplete."""

from __future__ import annotations

import json
import os
from pathlib import Path


def write_text(path: Path, text: str) -> Path:
    """Write ``text`` to ``path`` in one step; makes the folder."""
    return write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> Path:
    """Write ``data`` to ``path`` in one step; makes the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_bytes(data)
    os.replace(temporary, path)
    return path


def write_json(path: Path, data) -> Path:
    """Write ``data`` as readable JSON in one step."""
    return write_text(path, json.dumps(data, indent=2) + "\n")
