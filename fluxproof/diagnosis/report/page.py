# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report: the context of the template report.html, made from a Diagnosis.

The page contains no script and loads nothing; Jinja escapes every text, so that names from a file remain text.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from fluxproof.diagnosis.ground.nominal import SECTIONS
from fluxproof.diagnosis.ground.plant_section import merged, plant_of
from fluxproof.diagnosis.ground.quantities import RPM
from fluxproof.diagnosis.improve.improved_core import core_values
from fluxproof.diagnosis.report import pictures, words
from fluxproof.diagnosis.words.phrases import SIGNALS
from fluxproof.quote import pages

FOLDER = Path(__file__).resolve().parent
MOST_PROBLEMS = 60


def render(diagnosis, nominal=None, overlay: dict | None = None) -> str:
    """The page as one string of HTML; arguments as in write.write_outputs."""
    drawn, left_out = pictures.draw(diagnosis, overlay)
    mood, meaning = words.VERDICTS[diagnosis.verdict]
    compared = diagnosis.verdict not in ("bad_recording", "digital_mismatch") or bool(diagnosis.evidence.arrays)
    named = {name for group in diagnosis.ambiguity for name in group} | {e.name for e in diagnosis.effects}
    context = dict(
        d=diagnosis,
        mood=mood,
        meaning=meaning,
        compared=compared,
        words=words,
        text={name: words.effect_text(name) for name in sorted(named)},
        fit=fit_view(diagnosis.fit),
        signal=SIGNALS.get(diagnosis.location.signal, diagnosis.location.signal),
        unknown_signal=SIGNALS.get(u.signal, u.signal) if (u := diagnosis.unknown_term) is not None else "",
        rest=[rest_view(part) for part in diagnosis.remainder],
        regions=[region_view(region) for region in diagnosis.location.regions],
        requests=[request_view(request, nominal) for request in diagnosis.next_recording],
        plant=plant_rows(diagnosis.effects, nominal),
        core=core_values(nominal, diagnosis.effects) if nominal is not None else [],
        problems=sorted(diagnosis.problems, key=lambda problem: not problem.fatal)[:MOST_PROBLEMS],
        pictures=drawn,
        left_out=left_out if compared else [],
        drive=nominal.path if nominal is not None else "",
    )
    return pages(FOLDER).get_template("report.html").render(context).lstrip()


def fit_view(fit) -> SimpleNamespace:
    """Ratios of the misfit before, after and of the noise floor on held-out points; None where one is unknown."""

    def ratio(above, below):
        return above / below if above > 0.0 and below > 0.0 else None

    return SimpleNamespace(
        smaller=ratio(fit.holdout_before, fit.holdout_after),
        over_noise=ratio(fit.holdout_after, fit.noise_floor),
        before_over_noise=ratio(fit.holdout_before, fit.noise_floor),
    )


def rest_view(part) -> SimpleNamespace:
    """A row of the table of what nothing named explains: signal, order, size and share."""
    return SimpleNamespace(
        signal=SIGNALS.get(part.signal, part.signal),
        order=words.number(part.order) if part.order else "0, the mean",
        size=words.quantity(part.size, part.unit, 2),
        share=words.percent(part.share),
    )


def region_view(region) -> SimpleNamespace:
    """A row of the table of regions."""
    name, unit = words.VARIABLES.get(region.variable, (region.variable, region.unit))
    known = region.rms_elsewhere and region.rms is not None and region.rms_elsewhere > 0.0
    times = words.number(region.rms / region.rms_elsewhere, 2) if known else "–"
    return SimpleNamespace(
        name=name,
        span=words.span(region.low, region.high, unit),
        inside=words.number(region.rms, 3),
        outside=words.number(region.rms_elsewhere, 3),
        times=times,
    )


def request_view(request, nominal) -> SimpleNamespace:
    """A row of the table of requested recordings; speed also in rpm if the pole pairs are known."""
    speed = f"{words.number(request.omega_e)} rad/s"
    if nominal is not None:
        speed += f" ({words.number(request.omega_e * RPM / nominal.machine.pole_pairs)} rpm)"
    also = []
    if request.u_dc is not None:
        also.append(f"bus at {words.quantity(request.u_dc, 'V')}")
    if request.temp_winding is not None:
        also.append(f"winding at {words.quantity(request.temp_winding, '°C')}")
    return SimpleNamespace(
        speed=speed,
        i_d=words.quantity(request.i_d, "A"),
        i_q=words.quantity(request.i_q, "A"),
        also=", ".join(also),
        separates=request.separates,
        why=request.why,
    )


def plant_rows(effects, nominal) -> list[SimpleNamespace]:
    """One row per plant parameter that changes: key, value before and after, unit, effects."""
    plant, rows = plant_of(nominal) if nominal is not None else None, []
    for key, (value, names) in merged(effects).items():
        section, _, name = key.partition(".")
        # A sensor error is relative to the trims in force; the drive file has no value for it.
        before = getattr(getattr(plant, section, None), name, None) if section != "sensors" else None
        cells = dict(before=words.brief(before), after=words.brief(value), unit=_unit(section, name))
        rows.append(SimpleNamespace(key=key, effects=names, **cells))
    return rows


def _unit(section: str, name: str) -> str:
    """The unit of a key of drive.toml; empty if the nominal drive has no such key."""
    field = getattr(SECTIONS.get(section), "__dataclass_fields__", {}).get(name)
    return words.unit_text(field.metadata["key"].unit) if field is not None and "key" in field.metadata else ""
