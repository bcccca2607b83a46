# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue of effects: every module in this folder that defines EFFECT is an entry."""

import importlib
import pkgutil

from fluxproof.diagnosis.effects import Effect


def found_in(package: str, path) -> dict[str, Effect]:
    """{name: effect} of every module of a package that defines EFFECT."""
    effects = {}
    for module in sorted(m.name for m in pkgutil.iter_modules(path)):
        effect = getattr(importlib.import_module(f"{package}.{module}"), "EFFECT", None)
        if effect is not None:
            effects[effect.name] = effect
    return effects


CATALOGUE: dict[str, Effect] = found_in(__name__, __path__)
