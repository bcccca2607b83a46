# SPDX-License-Identifier: BSD-3-Clause
"""The methods side by side: how each is called, and the settings that were tuned on another seed.

A method is a module with ``fit(data, **settings)``, ``names(fitted, **settings)`` and a grid for both.
"""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

from studies.compare import forward, joint, lasso, narmax, sparse

METHODS = {"sindy": sparse, "lasso": lasso, "narmax": narmax, "joint": joint, "forward": forward}
TITLES = {
    "diagnose": "fluxproof diagnose",
    "sindy": "sparse regression (pySINDy, STLSQ)",
    "lasso": "LASSO, penalty by BIC (scikit-learn)",
    "narmax": "NARMAX selection (SysIdentPy, FROLS)",
    "joint": "joint least squares (SciPy), 95 % intervals",
    "forward": "forward selection by BIC over the catalogue's formulas",
}
PACKAGES = {"sindy": "pysindy", "lasso": "sklearn", "narmax": "sysidentpy"}
TUNED = Path(__file__).with_name("tuned.json")


def missing() -> list[str]:
    """Packages that are not installed."""
    return [package for package in PACKAGES.values() if importlib.util.find_spec(package) is None]


def tuned() -> dict:
    """What ``python -m studies.compare.tune`` found: {"seed": .., "methods": {name: {"fit": .., "names": ..}}}."""
    return json.loads(TUNED.read_text())
