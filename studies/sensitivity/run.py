"""One case under every variation of the constants: which verdict and which names."""

from __future__ import annotations

import contextlib
from pathlib import Path

from fluxproof.diagnosis.inference import constants

FACTORS = (0.5, 2.0)
# Read after the posterior is known, so that it need not be found again.
OF_THE_ANSWER = (
    "DOUBTED", "OPEN", "LIKELY", "USUAL", "IMITATION", "LIVES", "ELSEWHERE", "FLOOR", "VISIBLE", "SMALL", "HALF",
    "FORMS_LEFT", "LOCKED", "LEAST_RIPPLE", "LEAST_SWING", "LEAST_TORQUE", "SWING",
)  # fmt: skip
# Read by the search of slow logs alone, of which the cases contain none.
OF_SLOW_LOGS = ("SLOW_DC", "SLOW_U", "SLOW_CHANGE", "LEFTOVER", "FLOOR_SHARE", "NAMED_SHARE")
# Read for one channel of the balance alone: without it, the answer cannot change.
OF_A_CHANNEL = {"BALANCE_SUM": "sum", "BALANCE_TORQUE": "torque", "ALWAYS_LOADED": "torque"}


def names() -> list[str]:
    """The constants that are varied."""
    return [n for n in vars(constants) if n.isupper() and n not in OF_SLOW_LOGS]


@contextlib.contextmanager
def varied(name: str, factor: float):
    """A constant multiplied by a factor, inside the block."""
    value = getattr(constants, name)
    setattr(constants, name, value * factor)
    try:
        yield
    finally:
        setattr(constants, name, value)


def said(answer) -> dict:
    """What counts as the same verdict: its kind, the names and the ambiguities."""
    return {
        "verdict": answer.verdict,
        "names": sorted(e.name for e in answer.effects),
        "ambiguity": sorted(sorted(group) for group in answer.ambiguity),
    }


def variations(chosen) -> list[tuple[str, float]]:
    """(constant, factor) of every variation."""
    return [(name, factor) for name in chosen for factor in FACTORS]


def answers_of(job) -> tuple[str, dict]:
    """(case, {"base": said, "NAME x2": said, ...}) of (folder, constants); {} if the case has no fast recording."""
    from fluxproof.diagnosis.answer.conclude import conclude
    from fluxproof.diagnosis.balance.blocks import views_of
    from fluxproof.diagnosis.balance.parts import sound
    from fluxproof.diagnosis.ingest.load import load_recording
    from fluxproof.diagnosis.nominal import load_nominal
    from fluxproof.diagnosis.physics import explain, held_out

    folder, chosen = Path(job[0]), job[1]
    nominal = load_nominal(folder / "drive.toml")
    path = next(p for p in sorted(folder.iterdir()) if p.stem == "recording")
    recording = load_recording(path, nominal)
    loaded = sound([recording], nominal)
    if any(r.slow or r.fatal for r in loaded):
        return folder.name, {}
    answer, held = explain(loaded, nominal), held_out(views_of(loaded, nominal))
    posterior, out = answer.search, {"base": said(answer)}
    channels = {channel for channel, _, _ in posterior.best().problem.p.groups}
    for name, factor in variations(chosen):
        if OF_A_CHANNEL.get(name, "u") not in channels:
            out[f"{name} x{factor:g}"] = out["base"]
            continue
        with varied(name, factor):
            again = conclude(posterior, held) if name in OF_THE_ANSWER else explain(loaded, nominal)
        out[f"{name} x{factor:g}"] = said(again)
    return folder.name, out


def shares(cases: dict[str, dict], chosen) -> dict:
    """{constant: {"value", "half", "double", "share", "changed": [...]}}; share: of the cases that either changes."""
    every = {}
    for name in chosen:
        entry = {"value": getattr(constants, name)}
        changed = {}
        for factor, word in zip(FACTORS, ("half", "double"), strict=True):
            differs = [c for c, out in cases.items() if out[f"{name} x{factor:g}"] != out["base"]]
            entry[word] = len(differs) / max(len(cases), 1)
            changed[word] = differs
        entry["share"] = max(entry["half"], entry["double"])
        entry["changed"] = changed
        every[name] = entry
    return every
