# SPDX-License-Identifier: BSD-3-Clause
"""One way to read a recording or a drive file otherwise than documented."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from fluxproof.diagnosis.ground.result import Convention

CURRENTS = ("i_a", "i_b", "i_c", "i_d", "i_q")
VOLTAGES = ("u_d_ref", "u_q_ref")


@dataclass(frozen=True)
class Reading:
    """currents, voltages, bus: factors from recorded to true values; turn: rad added to the recorded angle.

    machine: {key of [machine]: factor from the file's value to the true one}; quantity: for Convention; dq: whether
    only logs in dq can have it; says: the finding as a clause; pole_pairs: the right number, with the factor ``speed``
    from the speed as it was read, for operating points without an angle.
    """

    code: str
    quantity: str
    says: str
    currents: float = 1.0
    voltages: float = 1.0
    bus: float = 1.0
    turn: float = 0.0
    machine: dict = field(default_factory=dict)
    pole_pairs: int = 0
    speed: float = 1.0
    unit: bool = False  # a factor that only a wrong unit has: none where the unit of the column is documented
    dq: bool | None = None  # whether it is of logs in dq, of logs of phases and duties, or of both

    def possible(self, recordings) -> bool:
        """Whether the recordings contain what this reading changes."""
        logs_dq = all(not r.has("d_a", "d_b", "d_c") for r in recordings)
        if self.dq is not None and self.dq != logs_dq:
            return False
        if self.bus != 1.0 and not all(r.has("u_dc") for r in recordings):
            return False
        # An axis that is turned into one of which no voltage is known would leave the balance.
        needed = ("u_d_ref", "u_q_ref") if logs_dq else ("theta_e",)
        if self.turn and not all(r.has(*needed) for r in recordings):
            return False
        if self.unit and any(set(self.columns()) & set(r.meta.get("documented_units", ())) for r in recordings):
            return False
        if self.pole_pairs and not all(r.slow and "omega_e" in r.meta.get("of_shaft", ()) for r in recordings):
            return False
        return not any("inverter" in r.lacks for r in recordings)  # an EMF run measures voltages of its own

    @property
    def touches(self) -> set[str]:
        """The quantities that it rescales, as effects name theirs: i, u, u_dc, theta_e, omega_e, keys of [machine]."""
        named = (("i", self.currents != 1.0), ("u", self.voltages != 1.0), ("u_dc", self.bus != 1.0),
                 ("theta_e", self.turn != 0.0), ("omega_e", self.speed != 1.0))  # fmt: skip
        return {name for name, changed in named if changed} | set(self.machine)

    @property
    def volts(self) -> float:
        """Factor by which the voltage of the balance is multiplied."""
        return self.voltages * self.bus

    @property
    def factor(self) -> float | None:
        """Recorded or stated value over the true one; None: an angle, or several factors."""
        scales = (self.currents, self.voltages, self.bus, self.speed, *self.machine.values())
        factors = {1.0 / f for f in scales if f != 1.0}
        return factors.pop() if len(factors) == 1 else None

    def keys(self, nominal) -> list[tuple[str, str, float]]:
        """[(section, key, value)] of the drive file that it changes."""
        right: list[tuple[str, str, float]] = [("machine", "pole_pairs", self.pole_pairs)] if self.pole_pairs else []
        return right + [("machine", key, getattr(nominal.machine, key) * f) for key, f in self.machine.items()]

    def of(self, nominal):
        """The drive read this way."""
        changes = {key: value for _, key, value in self.keys(nominal)}
        return dataclasses.replace(nominal, machine=dataclasses.replace(nominal.machine, **changes))

    def of_view(self, view):
        """The view read this way, with the same blocks."""
        turned = view.turned(-self.turn) if self.turn else view
        turned = turned.at_speed(self.speed) if self.speed != 1.0 else turned
        return turned.replace(
            nominal=self.of(view.nominal),
            i=turned.i * self.currents,
            i_raw=turned.i_raw * self.currents,
            i_abc=None if turned.i_abc is None else turned.i_abc * self.currents,
            u=turned.u * self.volts,
            u_dc=turned.u_dc * self.bus,
        )

    def columns(self) -> dict[str, tuple[float, float]]:
        """{canonical column: (factor, offset)} of the columns that it changes."""
        out = {name: (self.currents, 0.0) for name in CURRENTS if self.currents != 1.0}
        out |= {name: (self.voltages, 0.0) for name in VOLTAGES if self.voltages != 1.0}
        if self.bus != 1.0:
            out["u_dc"] = (self.bus, 0.0)
        if self.turn:
            out["theta_e"] = (1.0, self.turn)
        return out

    def told(self, rivals=()) -> Convention:
        """The finding; rivals: readings that fit as well."""
        says = self.says
        if rivals:
            says = f"{says}, or {', or '.join(r.says for r in rivals)} (this recording cannot separate them)"
        code = "pole_pairs" if self.pole_pairs else self.code
        return Convention(code, self.quantity, self.factor, says, tuple(r.code for r in rivals))
