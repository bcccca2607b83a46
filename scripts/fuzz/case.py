# SPDX-License-Identifier: BSD-3-Clause
"""One input of a target, and what became of it."""

from __future__ import annotations

import hashlib
from typing import NamedTuple


class Case(NamedTuple):
    """A file for a target; suffix: with its dot, it chooses the reader as the name of a user's file does."""

    suffix: str
    content: bytes

    def __repr__(self) -> str:
        return f"Case({self.suffix!r}, {len(self.content)} bytes)"

    @property
    def key(self) -> str:
        """A short name that depends on the content alone."""
        return hashlib.sha256(self.suffix.encode() + self.content).hexdigest()[:12]


class Verdict(NamedTuple):
    """kind: empty if all is well, else a word and a place that two inputs of one defect share; text: the details."""

    kind: str = ""
    text: str = ""
