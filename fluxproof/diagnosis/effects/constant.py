# SPDX-License-Identifier: BSD-3-Clause
"""Part of effects that are a wrong constant: of the drive file or of a sensor's scale."""

from __future__ import annotations

from fluxproof.diagnosis.effects.effect import Effect

UNITS = ("_ohm", "_h", "_wb")  # of the keys of [machine]
OFTEN = 2.0  # of a constant: a drive file is copied or guessed, so that a factor of three is no rare error
LEAST_LEFT = 0.1  # of a parameter of the machine: a smaller one is not this machine, nor one as many times as large


class Constant(Effect):
    """A constant of the nominal drive or a scale that is wrong; it competes with mistaken units of the same signal."""

    rescales: tuple[str, ...] = ()  # signals and [machine] keys that it scales or offsets: i, u, u_dc, theta_e, ...
    exact: bool = True  # its formula cannot be wrong: no error of a formula is assumed
    bent: str = ""  # the effect that it is where it changes with the current

    def often(self, nominal):
        return OFTEN * getattr(nominal.machine, self.rescales[0]) if is_of_nameplate(self) else None

    def too_large(self, c, view):
        if is_of_nameplate(self):  # any sensor may be off as far, which would be explained in its place
            return abs(next(iter(c.values()))) > getattr(
                view.machine, self.rescales[0]
            ) / LEAST_LEFT or self.leaves_nothing(c, view.machine)
        return super().too_large(c, view) or self.leaves_nothing(c, view.machine)

    def leaves_nothing(self, c, machine) -> bool:
        """Whether the first coefficient makes a parameter of the machine negative or nearly zero."""
        values = [getattr(machine, key) for key in self.rescales if hasattr(machine, key)]
        return any(value + next(iter(c.values())) < LEAST_LEFT * value for value in values)


def is_exact(effect) -> bool:
    """Whether no error of its formula is assumed."""
    return isinstance(effect, Constant) and effect.exact


def rescaled(effect) -> frozenset[str]:
    """Signals and keys of [machine] that an effect scales or offsets."""
    return frozenset(effect.rescales) if isinstance(effect, Constant) else frozenset()


def is_of_nameplate(effect) -> bool:
    """Whether an effect is a wrong constant of the machine, each by itself."""
    return isinstance(effect, Constant) and len(effect.rescales) == 1 and effect.rescales[0].endswith(UNITS)
