# SPDX-License-Identifier: BSD-3-Clause
"""The population as prior of the next diagnosis: ``fluxproof diagnose --prior fleet.parquet``.

What other drives of the same drive file had changes the prior odds of each effect, and places each parameter among
theirs.  The odds are never better than even, so that

    P(e | y) / (1 - P(e | y)) = B_e(y) pi / (1 - pi) <= B_e(y)

and a name, which needs 0.95, needs a recording that is by itself 19 times as probable with the effect as without: a
fleet of faulty drives makes no faulty one of a healthy drive.  Values of named effects stay those of the recording
alone; the value combined with the others is reported in addition.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy import stats

from fluxproof.diagnosis.fleet.findings import findings
from fluxproof.diagnosis.fleet.hypotheses import BASE
from fluxproof.diagnosis.fleet.population import Population
from fluxproof.diagnosis.fleet.rates import log_odds, prior_rate, weighed
from fluxproof.diagnosis.fleet.row import hypothesis_rows, one_line
from fluxproof.diagnosis.fleet.schema import COLUMNS
from fluxproof.diagnosis.fleet.values import values_of
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.limits import limited
from fluxproof.diagnosis.ground.nominal import MOST_MAP_BYTES, flux_map_path, load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.ground.result import Fleet, InFleet
from fluxproof.diagnosis.inference.posterior import Posterior
from golden_model.drive_file import MOST_BYTES
from golden_model.regular_file import open_regular, read_regular

MOST_ROWS = 1_000_000


@dataclass(frozen=True)
class Prior:
    """A design's population.  rates: {effect: share of the fleet that has it}; path: of the fleet.parquet."""

    path: str
    drives: int
    recordings: int
    rates: dict[str, float]
    populations: tuple[Population, ...]

    def shifts(self) -> dict[str, float]:
        """{effect: change of its log prior odds}; an effect that the fleet never had becomes rarer."""
        never = prior_rate(0.0, self.recordings)
        known = {name: min(self.rates.get(name, never), k.FLEET_EVEN) for name in self.names()}
        return {name: log_odds(rate) - log_odds(k.PRESENT) for name, rate in known.items()}

    def names(self) -> list[str]:
        """All effects that can be present."""
        from fluxproof.diagnosis.physics import known_effects

        return sorted(known_effects())


def read_fleet(path) -> list[dict]:
    """The rows of a fleet.parquet; RecordingError says what else the file is."""
    expected = "expected a fleet.parquet of `fluxproof fleet`"
    try:
        with open_regular(path) as file, limited(path), pq.ParquetFile(file) as parquet:
            if (rows := parquet.metadata.num_rows) > MOST_ROWS:
                raise RecordingError(f"{path}: {rows} rows; at most {MOST_ROWS} are read")
            found = parquet.schema_arrow
            for column in COLUMNS:
                if found.names.count(column.name) != 1:
                    how = "twice" if column.name in found.names else "missing"
                    raise RecordingError(f"{path}: column {column.name!r} is {how}; {expected}")
                if (kind := found.field(column.name).type) != column.type:
                    raise RecordingError(f"{path}: column {column.name!r} is {kind}, not {column.type}; {expected}")
            return parquet.read(columns=[c.name for c in COLUMNS]).to_pylist()
    except MemoryError:
        raise RecordingError(f"{path}: too large for the memory limit") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or one_line(error)}") from None
    except (pa.ArrowException, ValueError) as error:
        if isinstance(error, RecordingError):
            raise
        raise RecordingError(f"{path}: not a readable Parquet file: {one_line(error)}") from None


def design_of(drive) -> str:
    """Hash of a drive file and of the flux map that it names: recordings of one design are one population."""
    digest = hashlib.sha256(read_regular(drive, MOST_BYTES))
    flux_map = flux_map_path(load_nominal(drive))
    if flux_map is not None:
        digest.update(read_regular(flux_map, MOST_MAP_BYTES))
    return digest.hexdigest()[:16]


def load_prior(path, drive) -> Prior:
    """The population of a drive file in a fleet.parquet; RecordingError if it has no recording of that drive file."""
    design = design_of(drive)
    rows = [row for row in read_fleet(path) if row["design"] == design and row["status"] == "done"]
    if not rows:
        expected = "expected a fleet that was diagnosed with this file"
        raise RecordingError(f"{path}: no recording of the drive file {drive}; {expected}")
    try:
        found = findings(rows).designs[0]
        rates = dict(found.rates)
        for name in BASE:
            rates[name] = prior_rate(sum(any(n["effect"] == name for n in row["names"]) for row in rows), len(rows))
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # made or changed by something else
        said = f"{type(error).__name__}: {one_line(error)}"
        raise RecordingError(f"{path}: its rows are not those of `fluxproof fleet`: {said}") from None
    return Prior(str(path), len(found.serials), len(rows), rates, tuple(found.populations))


def among(prior: Prior, posterior: Posterior | None) -> Fleet:
    """Where a diagnosed drive stands among those of the prior; posterior: None if its parameters have none."""
    parts = []
    if posterior is not None:
        row = {"hypotheses": hypothesis_rows(posterior)}
        never = prior_rate(0.0, prior.recordings)
        rates = {e: prior.rates.get(e, never) for h in row["hypotheses"] for e in h["extras"]}
        values = values_of(weighed(row, rates)) if row["hypotheses"] else {}
        parts = [
            placed(pop, *values[pop.effect, pop.parameter][:2])
            for pop in prior.populations if (pop.effect, pop.parameter) in values
        ]  # fmt: skip
    return Fleet(prior.path, prior.drives, prior.recordings, tuple(parts))


def placed(pop: Population, value: float, sigma: float) -> InFleet:
    """A value of the next drive beside the population: shrunk to it as far as it can be one of them."""
    v = pop.spread**2 + sigma**2 + pop.mean_sigma**2
    z = (value - pop.mean) / np.sqrt(v)
    freedom = max(float(pop.inlier.sum()) - 1.0, 1.0)
    p = float(2.0 * stats.t.sf(abs(z), freedom))
    within = pop.spread**2 + pop.mean_sigma**2
    weight = within / v
    likely = stats.t.pdf(z, freedom) * (1.0 - pop.faulty)
    other = stats.norm.pdf(z, scale=k.FAULTY_WIDE) * pop.faulty
    member = float(likely / max(likely + other, 1e-300))
    shrunk = member * (pop.mean + weight * (value - pop.mean)) + (1.0 - member) * value
    between = member * (1.0 - member) * ((1.0 - weight) * (value - pop.mean)) ** 2
    shrunk_sigma = np.sqrt(member * weight * sigma**2 + (1.0 - member) * sigma**2 + between)
    return InFleet(
        pop.effect, pop.parameter, pop.unit, value, sigma, pop.mean, pop.spread, float(shrunk), float(shrunk_sigma),
        float(z), p,
    )  # fmt: skip
