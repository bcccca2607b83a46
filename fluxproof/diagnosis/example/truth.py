# SPDX-License-Identifier: BSD-3-Clause
"""What the diagnosis found beside what the example hides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fluxproof.diagnosis.example import motor
from fluxproof.diagnosis.ground.quantities import measured, quantity
from golden_model import drive as drives


class Compared(NamedTuple):
    """A hidden difference and its estimate; value and sigma are None if it was not named."""

    hidden: motor.Hidden
    unit: str
    value: float | None
    sigma: float | None

    @property
    def deviation(self) -> float:
        """Distance of the estimate from the truth in its standard deviations; infinite without an estimate."""
        if self.value is None or self.sigma is None:
            return float("inf")
        return abs(self.value - self.hidden.value) / self.sigma


def compare(effects: Sequence[Mapping]) -> tuple[list[Compared], list[str]]:
    """(every hidden difference with its estimate, names that were asserted beside them).

    effects: those of diagnosis.json.
    """
    found = {(e["name"], key): p for e in effects for key, p in e["parameters"].items()}
    secrets = motor.hidden(drives.load(motor.DRIVE_FILE))
    rows = []
    for secret in secrets:
        p = found.get((secret.effect, secret.parameter), {})
        rows.append(Compared(secret, p.get("unit", ""), p.get("value"), p.get("sigma")))
    others = [e["name"] for e in effects if e["name"] not in {secret.effect for secret in secrets}]
    return rows, others


def lines(effects: Sequence[Mapping]) -> list[str]:
    """The comparison as lines of text, one for each hidden difference."""
    rows, others = compare(effects)
    table = [_cells(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    out = ["hidden from the drive file:"]
    out += ["  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in table]
    return out + [f"  {name}: asserted, but not there" for name in others]


def _cells(row: Compared) -> tuple[str, str, str]:
    if row.value is None:
        return row.hidden.words, f"true {row.hidden.value:.4g}", "not found"
    found = f"found {measured(row.value, row.sigma, row.unit)}, {row.deviation:.1f} σ off"
    return row.hidden.words, f"true {quantity(row.hidden.value, row.unit)}", found
