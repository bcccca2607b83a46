# SPDX-License-Identifier: BSD-3-Clause
"""The result of a diagnosis: frozen dataclasses, converted for diagnosis.json by ``to_json``.

build.py makes it, once; nothing writes to it afterwards.  The stable part follows docs/diagnosis.schema.json
(schema 2).  ``Evidence`` serves the pictures only.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem

VERDICTS = (
    "explained", "partly_explained", "ambiguous", "unexplained", "no_mismatch", "digital_mismatch", "bad_recording",
)  # fmt: skip
FILES = ("report.html", "diagnosis.json", "drive_improved.toml", "flux_map.csv")  # of a written result


@dataclass(frozen=True)
class Estimate:
    """A parameter's value with its standard deviation."""

    value: float
    sigma: float
    unit: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that the tool asserts.

    explains: share of the misfit's power above the noise floor that the effect removes.
    plant: parameters of the plant that reproduce it, {"machine.resistance_ohm": 1.7, ...}; lists and tables occur.
    """

    name: str
    confidence: float
    parameters: dict[str, Estimate]
    explains: float
    plant: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Request:
    """An operating point to record next, which separates tied explanations."""

    omega_e: float
    i_d: float
    i_q: float
    separates: tuple[str, ...]
    why: str
    u_dc: float | None = None
    temp_winding: float | None = None


@dataclass(frozen=True)
class OrderLine:
    """A harmonic of the misfit in dq, per electrical turn."""

    order: float
    amplitude: float
    unit: str


@dataclass(frozen=True)
class Region:
    """Where the misfit is larger than elsewhere: ``variable`` between low and high; rms inside and outside."""

    variable: str  # omega_e, i_d, i_q, u_dc, temp_winding, t, theta_e
    low: float
    high: float
    unit: str
    rms: float
    rms_elsewhere: float


@dataclass(frozen=True)
class Location:
    """Signal, harmonic orders and operating regions in which the misfit is largest."""

    signal: str = ""
    orders: tuple[OrderLine, ...] = ()
    regions: tuple[Region, ...] = ()


@dataclass(frozen=True)
class Fit:
    """rms misfit before and after, on fitted rows and on held-out operating points, and the noise floor."""

    signal: str = "u_dq"
    unit: str = "V"
    train_before: float = 0.0
    train_after: float = 0.0
    holdout_before: float = 0.0
    holdout_after: float = 0.0
    noise_floor: float = 0.0

    @property
    def share_left(self) -> float:
        """Residual above the noise floor on fitted rows, relative to the misfit before."""
        excess = max(self.train_after**2 - self.noise_floor**2, 0.0) ** 0.5
        return excess / max(self.train_before, 1e-12)

    @property
    def explained_share(self) -> float:
        """Share of the power above the noise floor that is explained at held-out points."""
        before = max(self.holdout_before**2 - self.noise_floor**2, 1e-24)
        return 1.0 - max(self.holdout_after**2 - self.noise_floor**2, 0.0) / before


@dataclass(frozen=True)
class Remainder:
    """A part of the misfit that no named effect explains: one harmonic order of one signal.

    size: rms above the noise floor, at operating points that were not fitted.  share: of the power of the signal's
    misfit above its noise floor, before anything was explained.
    """

    signal: str  # u_dq, current_sum or torque
    order: float
    size: float
    unit: str
    share: float


@dataclass(frozen=True)
class Convention:
    """A convention of the recording or the drive file that differs from the documented one, found by the balance.

    code: stable, lower_snake_case (docs/diagnosis.md lists them); quantity: the columns or keys of drive.toml
    concerned; factor: recorded value over the documented one, None if it is no scale; says: one clause in plain words,
    such as "the currents are rms values: recorded values are 0.7071 of the peak values".
    rivals: codes of other conventions that fit as well, so that nobody can tell from this recording.
    """

    code: str
    quantity: str
    factor: float | None
    says: str
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class InFleet:
    """A parameter among those of the other drives: mean and spread, the value shrunk to them, and how far it is off.

    z: distance from the mean in predictive standard deviations; p: probability of a drive of the fleet beyond it.
    """

    effect: str
    parameter: str
    unit: str
    value: float
    sigma: float
    mean: float
    spread: float
    shrunk: float
    shrunk_sigma: float
    z: float
    p: float


@dataclass(frozen=True)
class Fleet:
    """The population that was the prior of a diagnosis, and where the drive stands in it."""

    path: str
    drives: int
    recordings: int
    parameters: tuple[InFleet, ...] = ()


@dataclass(frozen=True)
class UnknownTerm:
    """The single term that fits the unexplained residual best.

    meaning: what it would be physically, as a clause that completes "as if ...", or '' if only its form is known.
    """

    signal: str
    formula: str
    value: float
    sigma: float
    unit: str
    explains: float
    meaning: str = ""


@dataclass(frozen=True)
class BestFit:
    """The set of effects that fits a misfit best which nothing explains; it is not asserted.

    probability: of this set among all that were judged; left: rms at held-out points with it, in the unit of the fit;
    against: why it is not asserted, as a clause.  ``plant`` of its effects is empty.
    """

    effects: tuple[NamedEffect, ...]
    probability: float
    left: float
    against: str


@dataclass(frozen=True)
class Digital:
    """Result of replaying the core.  first_difference: block, sample, signal, bit, recorded, golden."""

    checked: bool = False
    samples: int = 0
    first_difference: dict | None = None


@dataclass(frozen=True)
class Evidence:
    """Block means of misfit and operating point for the pictures; all arrays have shape (n,) unless stated.

    before_d, before_q, after_d, after_q: misfit in dq [V]; noise: standard deviation of one block's mean [V].
    orders: (m,) electrical orders with spectrum_before, spectrum_after: (m,) amplitudes [V].
    torque: whether the torque was compared, as measured or as that of a shaft that turns freely.
    """

    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    torque: bool = False


@dataclass(frozen=True)
class Diagnosis:
    """The answer to: why does this recording differ from its simulation?"""

    verdict: str
    sentence: str
    effects: tuple[NamedEffect, ...] = ()
    ambiguity: tuple[tuple[str, ...], ...] = ()
    next_recording: tuple[Request, ...] = ()
    location: Location = Location()
    fit: Fit = Fit()
    explained_share: float | None = None  # of the misfit's power above its floor, at held-out points; None: no misfit
    remainder: tuple[Remainder, ...] = ()  # the largest first
    conventions: tuple[Convention, ...] = ()
    unknown_term: UnknownTerm | None = None
    best_fit: BestFit | None = None  # of an unexplained misfit
    minor: tuple[NamedEffect, ...] = ()  # found, and too small to act on
    alternatives: tuple[NamedEffect, ...] = ()  # the effects of the ambiguities, each as it is if it is the one
    rows: int = 0
    problems: tuple[Problem, ...] = ()
    digital: Digital = Digital()
    prior: Fleet | None = None  # the fleet whose population was the prior
    details: str = ""  # the figures behind the sentence
    advice: str = ""  # what to do next
    notes: tuple[str, ...] = ()  # for people: assumptions and omissions
    evidence: Evidence = field(default_factory=Evidence)

    def to_json(self) -> dict:
        """The mapping written to diagnosis.json (schema 2)."""
        plain = dataclasses.asdict(dataclasses.replace(self, evidence=Evidence()))
        plain = {key: _listed(value) for key, value in plain.items() if key != "evidence"}
        rows, problems = plain.pop("rows"), plain.pop("problems")
        return {"schema": 2, **plain, "recording": {"rows": rows, "problems": problems}}


def _listed(value):
    """The same with a list in place of every tuple, as JSON has no tuples."""
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    return [_listed(item) for item in value] if isinstance(value, (list, tuple)) else value
