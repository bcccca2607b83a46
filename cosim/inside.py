"""Where a simulator finds the core's values: the ports of its records are invisible, those of the instances are not."""

from __future__ import annotations

from fluxproof.golden_model import fluxproof

ESTIMATION = "estimation"  # the generate block of the estimators
# Value -> (instance that drives it, port of its block).
DRIVER = {
    name: (label, port.name)
    for label, (module, _) in fluxproof.WIRING.items()
    for name, port in zip(fluxproof.outputs_of(label), module.BLOCK.outputs, strict=True)
}


def instance(core, label: str):
    """The handle of an instance of fluxproof.vhd; ``core`` is the handle of the core itself."""
    return getattr(core, label) if hasattr(core, label) else getattr(getattr(core, ESTIMATION), label)


def handle_of(core, name: str):
    """The handle of a value: a port of the core, or of the instance that drives it."""
    if name not in fluxproof.Observed._fields:
        return getattr(core, name)
    label, port = DRIVER[name]
    return getattr(instance(core, label), port)
