# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet says, design by design: rates, populations, outliers, drifts, groups."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

from fluxproof.diagnosis.fleet import drift, groups, outliers
from fluxproof.diagnosis.fleet.population import Population, population
from fluxproof.diagnosis.fleet.rates import Weighed, weigh
from fluxproof.diagnosis.fleet.values import by_drive, values_of


@dataclass(frozen=True)
class Design:
    """The findings on the drives of one drive file.  rows: its recordings, with what the fleet makes of each."""

    name: str
    drive: str
    rows: list[dict]
    weighed: list[Weighed | None]
    rates: dict[str, float]
    populations: list[Population]
    outliers: dict[str, list[outliers.Finding]]
    drifts: list[drift.Drift]
    groups: list[groups.Group]

    @property
    def serials(self) -> list[str]:
        return sorted({row["serial"] for row in self.rows})

    def common(self) -> dict[str, float]:
        """{effect: rate} of the extras that belong to the design."""
        return {n: r for n, r in sorted(self.rates.items()) if outliers.common(n, self.rates)}


@dataclass(frozen=True)
class Findings:
    """The findings of a fleet.  verdicts: {verdict: recordings}; failed: rows without a diagnosis."""

    designs: list[Design]
    verdicts: dict[str, int]
    failed: list[dict]
    count: int

    @property
    def drives(self) -> int:
        """How many drives there are: also those whose recordings could not be used."""
        diagnosed = {serial for design in self.designs for serial in design.serials}
        return sum(len(d.serials) for d in self.designs) + len({row["serial"] for row in self.failed} - diagnosed)


def findings(rows: list[dict], limits: dict[str, str] | None = None) -> Findings:
    """The findings of the rows of fleet.parquet; limits: see drift.drifts."""
    done = [row for row in rows if row["status"] == "done"]
    designs = defaultdict(list)
    for row in done:
        designs[row["design"]].append(row)
    found = [_design(name, mine, limits) for name, mine in designs.items()]
    found.sort(key=lambda d: (-len(d.rows), d.name))
    failed = [row for row in rows if row["status"] != "done"]
    return Findings(found, dict(Counter(row["verdict"] for row in rows)), failed, len(rows))


def _design(name, rows, limits) -> Design:
    rates, weighed = weigh(rows)
    serials = [row["serial"] for row in rows]
    values = [values_of(w) for w in weighed]
    drives = by_drive(serials, values)
    populations = []
    for (effect, parameter), mine in drives.items():
        if outliers.common(effect, rates):
            x, s, units = zip(*mine.values(), strict=True)
            pop = population(effect, parameter, units[0], mine, x, s)
            populations += [pop] if pop is not None else []
    grouped = groups.groups(rows, weighed)
    beside = defaultdict(set)
    for group in grouped:
        for serial in group.serials:
            beside[serial] |= set(group.companions)
    present: dict[str, dict[str, float]] = defaultdict(dict)
    for serial, w in zip(serials, weighed, strict=True):
        mine = present[serial]
        for effect, p in (w.present if w is not None and outliers.explains(w) else {}).items():
            if effect not in beside[serial]:
                mine[effect] = max(mine.get(effect, 0.0), p)
    series = defaultdict(list)
    for row, mine in zip(rows, values, strict=True):
        for (effect, parameter), (value, sigma, unit) in mine.items():
            if row["time"] is not None:
                series[row["serial"], effect, parameter, unit].append((row["time"], value, sigma))
    return Design(
        name, rows[0]["drive"], rows, weighed, rates, populations,
        outliers.outliers(populations, dict(present), drives, rates),
        drift.drifts(series, limits), grouped,
    )  # fmt: skip
