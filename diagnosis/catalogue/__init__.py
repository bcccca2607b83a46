"""The catalogue of effects: every module in this folder that defines EFFECT is an entry."""

import importlib
import pkgutil

from fluxproof.diagnosis.effect import Effect


def _found() -> dict[str, Effect]:
    effects = {}
    for module in sorted(m.name for m in pkgutil.iter_modules(__path__)):
        effect = getattr(importlib.import_module(f"{__name__}.{module}"), "EFFECT", None)
        if effect is not None:
            effects[effect.name] = effect
    return effects


CATALOGUE: dict[str, Effect] = _found()
