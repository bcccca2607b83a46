# SPDX-License-Identifier: BSD-3-Clause
"""Random cases of the benchmark: stratum, effects, forms and sizes, determined by (seed, index, stratum)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from studies.blind import damage, forms, unknown
from studies.blind.build import Build, fresh
from studies.blind.machines import random_nominal
from studies.blind.magnetics import flux
from studies.blind.plans import grid_plan, masked_plan, one_point_plan

# Shares of the strata; "healthy" is large because false alarms must be rare.
STRATA = {
    "healthy": 0.14,
    "single": 0.24,
    "pair": 0.16,
    "triple": 0.1,
    "masked": 0.09,
    "one_point": 0.09,
    "unknown": 0.1,
    "damaged": 0.08,
}

# Pairs in which one effect can imitate the other.
CONFOUNDED = [
    ("resistance", "iron_loss"),
    ("resistance", "magnet_flux"),
    ("resistance", "dead_time"),
    ("resistance_temperature", "magnet_temperature"),
    ("inductance_d", "current_gain"),
    ("inductance_q", "encoder_offset"),
    ("inductance_q", "saturation"),
    ("magnet_flux", "cross_saturation"),
    ("magnet_flux", "magnet_temperature"),
    ("dead_time", "emf_harmonics"),
    ("saturation", "cross_saturation"),
    ("cross_saturation", "inductance_d"),
    ("encoder_offset", "delay"),
    ("delay", "sampling_skew"),
    ("sampling_skew", "iron_loss"),
    ("encoder_offset", "encoder_eccentricity"),
    ("current_offset", "cogging"),
    ("current_gain", "phase_resistance_asymmetry"),
    ("current_scale", "resistance"),
    ("udc_gain", "magnet_flux"),
    ("dead_time", "phase_resistance_asymmetry"),
    ("current_offset", "current_gain"),
    ("friction", "cogging"),
    ("friction", "magnet_flux"),
    ("current_offset", "encoder_eccentricity"),
]
MECHANICAL = ("cogging", "friction")
NEED_TORQUE = (*MECHANICAL, "current_scale", "udc_gain")


@dataclass
class Case:
    """A case before simulation.  effects: [{name, form, size, parameters}]; kind: of unknown or damage."""

    index: int
    stratum: str
    build: Build
    effects: list[dict] = field(default_factory=list)
    kind: str = ""

    @property
    def names(self):
        return sorted(e["name"] for e in self.effects)


def rng_of(seed: int, index: int, attempt: int = 0, purpose: int = 0):
    """The random generator of one case; purpose 0: its effects, 1: its recording, 2 and up: further recordings."""
    return np.random.default_rng([seed, index, attempt, purpose])


def strata_counts(count: int, strata: dict[str, float] = STRATA) -> dict[str, int]:
    """Number of cases of each stratum for a total of ``count``; singles take the rounding."""
    counts = {name: int(round(share * count)) for name, share in strata.items()}
    counts["single"] += count - sum(counts.values())
    return counts


def _effects_of(rng, stratum: str, turn: int) -> list[str]:
    """Names of the effects; ``turn`` counts the cases of the stratum, so that effects are equally frequent."""
    names = sorted(forms.EFFECTS)
    if stratum in ("single", "one_point"):
        return [names[(turn // 2) % len(names)]] if stratum == "single" else [names[(turn * 5 + 3) % len(names)]]
    if stratum == "masked":
        first = names[(turn * 7) % len(names)]
        return [first] if rng.random() < 0.6 else [first, str(rng.choice([n for n in names if n != first]))]
    if stratum == "pair":
        if turn % 3 < 2:
            return list(CONFOUNDED[(turn - turn // 3) % len(CONFOUNDED)])
        return [str(x) for x in rng.choice(names, 2, replace=False)]
    if stratum == "triple":
        pair = CONFOUNDED[int(rng.integers(len(CONFOUNDED)))]
        return [*pair, str(rng.choice([n for n in names if n not in pair]))]
    return []


def _form_of(rng, name: str, chosen: list[str], stratum: str, turn: int) -> str:
    others = [f for f in forms.EFFECTS[name][1] if f != forms.CATALOGUE]
    plain = turn % 2 == 0 if stratum == "single" else rng.random() < 0.45
    # A rounded inductance together with saturation would be saturation twice.
    if name.startswith("inductance") and "saturation" in chosen:
        plain = True
    return forms.CATALOGUE if plain else str(rng.choice(others))


def keep_convex(build: Build):
    """Reduce cross-saturation until the fluxes are invertible over the whole current range."""
    i_r = build.nominal.machine["rated_current_a"]
    grid = [(d, q) for d in np.linspace(-1.5, 1.5, 13) * i_r for q in np.linspace(-1.5, 1.5, 13) * i_r]
    for _ in range(40):
        m = build.drive.motor
        slopes = [flux(m, d, q)[2:] for d, q in grid]
        if all(dd * qq - dq * dq > 0.08 * m.l_d * m.l_q and min(dd, qq) > 0.0 for dd, dq, qq in slopes):
            return
        build.change("motor", c_x=0.85 * m.c_x)


def make(seed: int, index: int, stratum: str, turn: int, attempt: int = 0) -> Case:
    """The case of a seed; the same arguments give the same case."""
    rng = rng_of(seed, index, attempt)
    nominal = random_nominal(rng)
    chosen = _effects_of(rng, stratum, turn)
    if stratum == "masked":
        plan, torque = masked_plan(rng, nominal), rng.random() < 0.5
    elif stratum == "one_point":
        plan, torque = one_point_plan(rng, nominal), rng.random() < 0.3
    else:
        plan = grid_plan(rng, nominal, with_d=rng.random() < 0.93)
        torque = rng.random() < (0.9 if set(chosen) & set(NEED_TORQUE) else 0.4)
    build = fresh(rng, nominal, plan, bool(torque))
    case = Case(index, stratum, build)
    for name in chosen:
        size = float(10.0 ** rng.uniform(np.log10(0.3), np.log10(3.0)))
        form = _form_of(rng, name, chosen, stratum, turn)
        parameters = forms.apply(name, build, rng, size, form)
        case.effects.append({"name": name, "form": form, "size": size, "parameters": parameters})
    keep_convex(build)
    if stratum == "unknown":
        kinds = sorted(unknown.KINDS)
        case.kind = kinds[turn % len(kinds)]
        unknown.KINDS[case.kind](build, rng, float(10.0 ** rng.uniform(np.log10(0.6), np.log10(3.0))))
    elif stratum == "damaged":
        kinds = sorted(damage.KINDS)
        case.kind = kinds[turn % len(kinds)]
    return case


def record(case: Case, seed: int, attempt: int = 0, trace=False):
    """(columns of the recording including damage, codes of its problem, trace or None)."""
    rng = rng_of(seed, case.index, attempt, 1)
    columns, held = case.build.record(rng, trace=trace)
    codes = damage.KINDS[case.kind](columns, rng, case.build.nominal) if case.stratum == "damaged" else []
    return columns, codes, held


def sound(case: Case, columns) -> bool:
    """Whether the controller followed its references: no runaway, no permanent voltage limit."""
    i_r = case.build.nominal.machine["rated_current_a"]
    currents = np.nan_to_num(np.abs(np.stack([columns[k] for k in ("i_a", "i_b", "i_c")])))
    duties = np.stack([columns[k] for k in ("d_a", "d_b", "d_c")])
    c = case.build.drive.control
    stuck = np.mean((duties <= c.duty_min + 1e-9) | (duties >= 1.0 - c.duty_min - 1e-9))
    return bool(np.quantile(currents, 0.999) < 1.6 * i_r and stuck < 0.01)
