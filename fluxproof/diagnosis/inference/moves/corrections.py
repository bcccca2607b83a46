# SPDX-License-Identifier: BSD-3-Clause
"""Measurement errors alone, each on its own linearisation."""

from fluxproof.diagnosis.effects import MeasurementError
from fluxproof.diagnosis.inference.judged import Judged, Names


def corrections(judged: Judged, best: Names):
    """Linearise every measurement error alone: the data without it are far from linear in it."""
    for name in judged.first.able():
        if isinstance(judged.setup.effects[name], MeasurementError):
            judged.linearise((name,))
