# SPDX-License-Identifier: BSD-3-Clause
"""Drive files with other values, keys and sections: as TOML that is right, and as text that may be none."""

from __future__ import annotations

import datetime

import tomlkit
from hypothesis import strategies as st

from scripts.fuzz.case import Case
from scripts.fuzz.drawn.text import damaged_text, encoded, names

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib

FLOATS = (0.0, -0.0, -1.0, 1e-300, 1e300, 1e308, -1e308, 5e-324, 1e-9, 1e9, float("nan"), float("inf"), -float("inf"))
INTEGERS = (0, 1, -1, 2, 63, 64, 2**31, 2**53, 2**63 - 1, -(2**63), 10**400)
UNUSUAL = st.one_of(
    names, st.booleans(), st.just(datetime.date(2026, 1, 1)),
    st.just(datetime.datetime(2026, 1, 1, 1, 1)), st.just(datetime.time(1, 1))
)  # fmt: skip
NUMBERS = st.one_of(st.sampled_from(FLOATS), st.sampled_from(INTEGERS), st.floats(), st.integers(-(2**63), 2**63 - 1))
VALUES = st.recursive(
    st.one_of(NUMBERS, NUMBERS, NUMBERS, UNUSUAL),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(names, inner, max_size=3)),
    max_leaves=6,
)
SECTIONS = ("plant", "columns", "constants", "bases", "protection", "sampling", "encoder", "converters", "sensors")
KEYS = (
    "i_d",
    "u_dc",
    "temp_winding",
    "flux_map",
    "emf_harmonics",
    "name",
    "unit",
    "factor",
    "offset",
    "kind",
    "delay_s",
)


@st.composite
def drive(draw, corpus: tuple[bytes, ...]) -> Case:
    """A drive file of the corpus with up to four values changed, or as damaged text."""
    if draw(st.integers(0, 3)) == 3:
        return Case(".toml", draw(encoded(draw(damaged_text(corpus)))))
    data = tomllib.loads(draw(st.sampled_from(corpus)).decode())
    for _ in range(draw(st.integers(0, 4))):
        _change(draw, data)
    try:
        text = tomlkit.dumps(data)
    except (ValueError, TypeError, UnicodeError):  # a key or text that TOML does not have
        text = ""
    return Case(".toml", draw(encoded(text)))


def _change(draw, data: dict) -> None:
    """One key of one section: another value, none, or a new one."""
    name = draw(st.one_of(st.sampled_from(sorted(data) or ["machine"]), st.sampled_from(SECTIONS), names))
    kind = draw(st.sampled_from(("value", "value", "value", "number", "scale", "new", "plant", "out", "section")))
    table = data.get(name)
    if kind == "section" or not isinstance(table, dict):
        data[name] = draw(
            st.one_of(VALUES, st.dictionaries(st.one_of(st.sampled_from(KEYS), names), VALUES, max_size=4))
        )
        return
    key = draw(st.sampled_from(sorted(table) or ["x"]))
    if kind == "out":
        table.pop(key, None)
    elif kind == "new":
        table[draw(st.one_of(st.sampled_from(KEYS), names))] = draw(VALUES)
    elif kind == "plant":
        part = draw(st.sampled_from(("machine", "inverter", "sensors", "timing")))
        plant = data.setdefault("plant", {})
        if isinstance(plant, dict):
            plant[part] = {draw(st.one_of(st.just(key), st.sampled_from(KEYS), names)): draw(VALUES)}
    elif kind == "scale" and isinstance(table.get(key), (int, float)):
        table[key] = table[key] * 10.0 ** draw(st.integers(-300, 300))
    else:
        table[key] = draw(NUMBERS if kind == "number" else VALUES)
