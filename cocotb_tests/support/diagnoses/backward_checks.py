# SPDX-License-Identifier: BSD-3-Clause
"""A plugin of pytest (``-p``): within a stage the checks run the other way round, as far as they name no order."""

from fluxproof.diagnosis import checks

BACKWARD = checks.checks(backward=True)
checks.checks = lambda backward=False: BACKWARD
