# SPDX-License-Identifier: BSD-3-Clause
"""Part of effects that are in the data, not in the machine."""

from __future__ import annotations

from fluxproof.diagnosis.effects.effect import Effect


class MeasurementError(Effect):
    """A measurement error: found, it is removed from the recorded data, and all columns are computed anew.

    A drive file cannot take it out of a recording that has it, unless it is Described; ``plant`` describes it for the
    next one.
    """

    corrected_last: bool = False  # of several: its correction uses the corrected currents

    def corrected(self, view, c: dict):
        """The view without the error."""
        raise NotImplementedError
