# SPDX-License-Identifier: BSD-3-Clause
"""Where a simulator finds the core's values: the ports of its records are invisible, those of the instances are not."""

from __future__ import annotations

from golden_model import fluxproof

INSIDE = ("estimation", "safety")  # the generate block of the estimators, the instance of protection
# Value -> (instance that drives it, port of its block).
DRIVER = {
    name: (label, port.name)
    for label, (module, _) in fluxproof.WIRING.items()
    for name, port in zip(fluxproof.outputs_of(label), module.BLOCK.outputs, strict=True)
}


LEFT_OUT = (
    *("position_regulator", "master_gear", "residual", "modes", "beginnings"),
    *("ripple_answer", "ripple", "hexagon"),
)  # instances that the default generics leave out


def instance(core, label: str):
    """The handle of an instance of fluxproof.vhd or protection.vhd; ``core`` is the handle of the core itself."""
    for scope in (core, *(getattr(core, name) for name in INSIDE if hasattr(core, name))):
        found = getattr(scope, label, None)
        if hasattr(found, "clk"):  # a generic of the core may have the same name, in capitals
            return found
    raise AttributeError(f"no instance {label} in the core")


def handle_of(core, name: str):
    """The handle of a value: a port of the core, or of the instance that drives it; None where that is left out."""
    if name not in fluxproof.Observed._fields:
        return getattr(core, name)
    label, port = DRIVER[name]
    try:
        return getattr(instance(core, label), port)
    except AttributeError:
        if label in LEFT_OUT:
            return None
        raise
