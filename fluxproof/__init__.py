# SPDX-License-Identifier: BSD-3-Clause
"""Fluxproof in Python: the plant, the closed loops, the diagnosis of recordings and the commands.

The golden model of the core is the package ``golden_model``.

from fluxproof import diagnose
answer = diagnose("recording.csv", "drive.toml")
print(answer.verdict, answer.sentence)
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fluxproof.diagnosis.session import diagnose

__all__ = ["diagnose"]


def __getattr__(name: str):
    """Import ``diagnose`` on first use: it takes a second, which ``fluxproof --help`` should not wait."""
    if name == "diagnose":
        from fluxproof.diagnosis.session import diagnose

        return diagnose
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
