# SPDX-License-Identifier: BSD-3-Clause
"""Explains why recordings of a real drive differ from its simulation."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fluxproof.diagnosis.session import diagnose

__all__ = ["diagnose"]


def __getattr__(name):
    if name == "diagnose":
        from fluxproof.diagnosis.session import diagnose

        return diagnose
    raise AttributeError(name)
