# SPDX-License-Identifier: BSD-3-Clause
"""One case under every variation of the constants: which verdict and which names."""

from __future__ import annotations

import contextlib
from pathlib import Path

from fluxproof.diagnosis.balance.cells import voltage_rms
from fluxproof.diagnosis.balance.parts import sound
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.conventions.restated import as_read
from fluxproof.diagnosis.decide.conclude import conclude
from fluxproof.diagnosis.decide.interpretation import under
from fluxproof.diagnosis.decide.rules import judge
from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.inference.search import search
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.interpret.judge import preferred
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.physics import explain, rows_of, single_point, view_and_held
from studies.sensitivity.steps import Steps, recorded, varied

FACTORS = (0.5, 2.0)
# Read at one operating point alone, which has no posterior.
OF_ONE_POINT = (
    *("LEFTOVER", "FLOOR_SHARE", "NAMED_SHARE", "PER_EFFECT", "LEAST_MEANS", "DRIFTS", "TIE", "SAME_COLUMN"),
    *("CONSTANT_DC", "CONSTANT_U", "FITS"),
)

# Read by the analysis of a fleet alone.
OF_FLEETS = (
    *("FLEET_FALSE", "DRIFT_ALARM", "DRIFT_CONFIDENCE", "DRIFT_RECORDINGS", "GROUP_APART", "GROUP_DRIVES", "COMMON"),
    *("OUTLIER_DRIVES", "POPULATION_DRIVES", "FAULTY_WIDE", "MOST_FAULTY", "ONE_FAULTY_IN", "RATE_WORTH", "FLEET_EVEN"),
    "USELESS",
)


def names() -> list[str]:
    """The constants that are varied."""
    return [n for n in vars(constants) if n.isupper() and n not in OF_ONE_POINT + OF_FLEETS]


def said(verdict, effects, ambiguity) -> dict:
    """What counts as the same verdict: its kind, the names and the ambiguities."""
    if verdict == "unexplained":
        effects, ambiguity = [], []
    return {"verdict": verdict, "names": sorted(effects), "ambiguity": sorted(sorted(g) for g in ambiguity)}


def said_in_full(loaded, nominal) -> dict:
    """What the whole diagnosis says."""
    answer = explain(loaded, nominal).decision
    return said(answer.verdict, [e.name for e in answer.effects], answer.ambiguity)


class Case:
    """One recording, of which every variation repeats only what depends on the constant that is varied."""

    def __init__(self, folder: Path):
        self.nominal = load_nominal(folder / "drive.toml")
        path = next(p for p in sorted(folder.iterdir()) if p.stem == "recording")
        self.loaded = [load_recording(path, self.nominal)]
        nominal = as_read(self.loaded, self.nominal)
        self.recordings, self.steps = sound(self.loaded, nominal, CATALOGUE), Steps()
        self.known = not any(r.fatal for r in self.loaded) and self._has_posterior(nominal)

    def _has_posterior(self, nominal) -> bool:
        """Whether there is a steady stretch, and more than one operating point."""
        try:
            return not single_point(view_and_held(self.recordings, nominal)[0])
        except RecordingError:
            return False

    def base(self) -> dict:
        """What is said with the constants as they are."""
        self.rows, self.held = self.steps(_rows_of, self.recordings, as_read(self.loaded, self.nominal))
        if self.steps.reads():
            raise AssertionError(f"rows depend on {', '.join(sorted(self.steps.reads()))}")
        out = self.said()
        self.steps.lasting = False
        return out

    def said(self) -> dict:
        """What is said now, as the diagnosis does (physics.py)."""
        steps = self.steps
        posterior = steps(search, steps(Setup.of, self.rows, steps))
        j = steps(judge, posterior, self.held)
        plain = said(j.kind, j.names.named, j.names.ambiguous)
        if j.kind == "no_mismatch":
            return plain
        found = steps(preferred, self.recordings, posterior, j.kind != "unexplained")
        return steps(_under, found, posterior, self.held) if found[0] else plain

    def varied(self, name, factor) -> dict:
        """What is said with one constant multiplied by a factor."""
        try:
            with varied(name, factor):
                return self.said()
        finally:
            self.steps.forget()


def _rows_of(recordings, nominal):
    view, held = view_and_held(recordings, nominal)
    return rows_of(view, held), held


def _under(found, posterior, held) -> dict:
    readings, rivals, read = found
    level = voltage_rms(posterior.setup.view)
    answer = under(readings, rivals, conclude(posterior, held), conclude(read, held), level)
    return said(answer.verdict, [e.name for e in answer.effects], answer.ambiguity)


def variations(chosen) -> list[tuple[str, float]]:
    """(constant, factor) of every variation."""
    return [(name, factor) for name in chosen for factor in FACTORS]


def answers_of(job) -> tuple[str, dict]:
    """(name, {"base": said, "NAME x2": said, ...}) of (name, folder, constants); {} without a posterior."""
    name, folder, chosen = job
    case = Case(folder)
    if not case.known:
        return name, {}
    with recorded():
        out = {"base": case.base()}
        read = case.steps.reads()
        for constant, factor in variations(chosen):
            out[f"{constant} x{factor:g}"] = case.varied(constant, factor) if constant in read else out["base"]
    return name, out


def differences(folder: Path, chosen) -> list[str]:
    """Variations of a case whose answer is another one if nothing is reused; "base" among them."""
    case, out = Case(folder), []
    with recorded():
        answers = {("base", 1.0): case.base()}
        read = [name for name in chosen if name in case.steps.reads()]
        answers |= {(name, factor): case.varied(name, factor) for name, factor in variations(read)}
    for (name, factor), reused in answers.items():
        with varied(name, factor) if name != "base" else contextlib.nullcontext():
            if said_in_full(case.loaded, case.nominal) != reused:
                out.append(f"{name} x{factor:g}")
    return out


def _verdict(answer: dict) -> tuple:
    return answer["verdict"], answer["names"]


def shares(cases: dict[str, dict], chosen) -> dict:
    """{constant: {"value", "half", "double", "share", "verdicts", "changed": {"half": [...], "double": [...]}}}.

    share: of the cases whose answer the worse of both changes; verdicts: whose kind or names, and not only which
    alternatives an ambiguity lists.
    """
    every = {}
    for name in chosen:
        entry = {"value": getattr(constants, name), "verdicts": 0.0}
        changed = {}
        for factor, word in zip(FACTORS, ("half", "double"), strict=True):
            differs = [c for c, out in cases.items() if out[f"{name} x{factor:g}"] != out["base"]]
            others = [c for c in differs if _verdict(cases[c][f"{name} x{factor:g}"]) != _verdict(cases[c]["base"])]
            entry[word] = len(differs) / max(len(cases), 1)
            entry["verdicts"] = max(entry["verdicts"], len(others) / max(len(cases), 1))
            changed[word] = differs
        entry["share"] = max(entry["half"], entry["double"])
        entry["changed"] = changed
        every[name] = entry
    return every
