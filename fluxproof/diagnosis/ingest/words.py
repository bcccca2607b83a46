# SPDX-License-Identifier: BSD-3-Clause
"""Column names in words, as sheets of a bench have them: "Test motor q-axis current", "bus v (V) at drive".

A name counts if every word of it is known: one quantity, the words that tell which of its kind it is, and words that
change nothing ("test motor", "measured").  One word that is not known, such as "absorber" or "FET", may make it the
quantity of another part, and the column is left.  Speed, torque and temperature count only with a unit; a speed in
rad/s only with a word that tells whose it is ("shaft", "electrical").
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from fluxproof.diagnosis.ground.recording import COLUMNS
from fluxproof.diagnosis.ingest.units import FACTORS, OF_SHAFT, conversion

NEUTRAL = frozenset(
    "motor machine test dut uut measured meas actual act ist mean avg average value filtered filt signal feedback axis "
    "component the of side maschine messwert".split()
)
PLACE = frozenset("at in drive inverter controller".split())
SHAFT = frozenset("output shaft rotor mechanical mech m welle".split())
ELECTRICAL = frozenset("electrical electric elec el elektrisch".split())
REFERENCE = frozenset(
    "ref reference setpoint set point command commanded cmd target demand demanded desired soll".split()
)
BUS = frozenset("dc bus link dclink supply battery batt bat input zwischenkreis zk".split())
CELL = frozenset("load cell sensor transducer flange".split())
WINDING = frozenset("winding windings stator coil wicklung wdg motor".split())
CURRENT = frozenset("current currents i strom".split())
VOLTAGE = frozenset("voltage volts u v spannung".split())
SPEED = frozenset("speed velocity vel n w omega rpm erpm krpm drehzahl".split())
TORQUE = frozenset("torque t m md drehmoment".split())
TEMPERATURE = frozenset("temperature temp t temperatur".split())
DUTY = frozenset(("duty", "tastgrad"))
AXES = {"d": frozenset(("d", "direct")), "q": frozenset(("q", "quadrature"))}
PHASES = {"a": ("a", "u", "l1"), "b": ("b", "v", "l2"), "c": ("c", "w", "l3")}
JOINED: dict[str, str] = {  # words that are two
    "id": "i d", "iq": "i q", "ud": "u d", "uq": "u q", "vd": "v d", "vq": "v q", "daxis": "d", "qaxis": "q",
    "wm": "w mech", "we": "w el", "omegam": "omega mech", "omegae": "omega el",
    "vdc": "v dc", "udc": "u dc", "vbus": "v bus", "ubus": "u bus", "vbat": "v bat", "ubat": "u bat",
}  # fmt: skip
LATER = 100  # rank of a name in words: behind those of usual_names.py
UNITLESS = ("A", "V", "1")  # quantities that are taken in SI units if none is given


@dataclass(frozen=True)
class Spelling:
    """one: words of the quantity, of which a name has one; tells: of each set it has one; may: it has these or not."""

    one: frozenset
    tells: tuple[frozenset, ...] = ()
    may: frozenset = frozenset()

    def fits(self, words: list[str]) -> bool:
        """Whether all words have a place, each quantity and each telling word its own."""
        left = list(words)
        for needed in (*self.tells, self.one):
            found = next((w for w in left if w in needed), None)
            if found is None:
                return False
            left.remove(found)
        return all(w in NEUTRAL or w in self.may or any(w in t for t in self.tells) for w in left)


SPELLINGS: dict[str, Spelling] = {
    "u_dc": Spelling(VOLTAGE, (BUS,), PLACE),
    "omega_e": Spelling(SPEED, (), SHAFT | ELECTRICAL),
    "torque": Spelling(TORQUE, (), SHAFT | CELL),
    "temp_winding": Spelling(TEMPERATURE, (WINDING,)),
}
for _axis, _of in AXES.items():
    SPELLINGS[f"i_{_axis}"] = Spelling(CURRENT, (_of,))
    SPELLINGS[f"i_{_axis}_ref"] = Spelling(CURRENT, (_of, REFERENCE), REFERENCE)
    SPELLINGS[f"u_{_axis}_ref"] = Spelling(VOLTAGE, (_of,), REFERENCE)
for _phase, _marks in PHASES.items():
    SPELLINGS[f"i_{_phase}"] = Spelling(CURRENT, (frozenset(("phase", "leg")), frozenset(_marks)))
    SPELLINGS[f"d_{_phase}"] = Spelling(
        DUTY, (frozenset(("phase", "leg")), frozenset(_marks)), frozenset(("cycle", "pwm"))
    )


def in_words(column: str, unit: str = "") -> tuple[str, str, int] | None:
    """(canonical column, its unit or "", rank) of a name in words, or None; unit: of a line of units."""
    stem, own = unit_apart(column)
    for text, its in ((stem, unit or own), (column, unit)):  # the A of "phase current A" is no ampere
        words = _words(text)
        for name, spelling in SPELLINGS.items():
            if spelling.fits(words) and (known := _unit_of(name, its, words)) is not None:
                return name, known, LATER + len(words)
    return None


def is_speed(column: str) -> bool:
    """Whether a name is that of a speed, whatever its unit."""
    return SPELLINGS["omega_e"].fits(_words(unit_apart(column)[0]))


def unit_apart(column: str) -> tuple[str, str]:
    """("T measured", "Nm") of "T measured (Nm)", "T measured / Nm", "T measured in Nm" or "T measured_Nm".

    A unit in brackets may stand inside ("bus v (V) at drive"), and "rms" behind it.
    """
    text = column.strip(' ."')
    for found in re.finditer(r"[\[(]([^\[\]()]*)[\])](\s*rms\b)?", text):
        if is_unit(unit := found.group(1).strip() + (found.group(2) and " rms" or "")):
            return f"{text[: found.start()]} {text[found.end() :]}".strip(), unit
    for found in re.finditer(r"\s*[/,:]\s*|\s+in\s+|\s+|_", text):
        if is_unit(unit := text[found.end() :]) and found.start():
            return text[: found.start()], unit
    return text, ""


def is_unit(text: str) -> bool:
    """Whether a text is a unit of any column."""
    return bool(text) and any(conversion(name, text, 1) is not None for name in COLUMNS)


def _words(stem: str) -> list[str]:
    """The words of a name in lower case, the last part of a path; of "MotorSpeed" two."""
    last = re.split(r"[./]", stem)[-1]
    apart = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])|(?<=[A-Z])(?=[A-Z][a-z]{2})", " ", last)
    words: list[str] = re.findall(r"[^\W_]+", apart.lower())
    return " ".join(JOINED.get(word, word) for word in words).split()


def _unit_of(name: str, unit: str, words: list[str]) -> str | None:
    """The unit of a column, with whose speed it is; None if it is of another quantity or does not say enough."""
    if name == "omega_e":
        return _speed_unit(unit or next((w for w in words if w in FACTORS["rad/s"]), ""), words)
    if not unit:
        return "" if COLUMNS[name] in UNITLESS and "i_d" != name else None  # "motor ID" is a number of a motor
    return unit if conversion(name, unit, 1) is not None else None


def _speed_unit(unit: str, words: list[str]) -> str | None:
    shaft, electrical = bool(SHAFT & set(words)), bool(ELECTRICAL & set(words))
    if conversion("omega_e", unit, 1) is None or (shaft and electrical):
        return None
    lower = unit.lower()
    if lower in {u.lower() for u in OF_SHAFT}:
        electrical_rpm = {"rpm": "erpm", "1/min": "erpm"}
        return electrical_rpm.get(lower) if electrical else unit
    if lower in ("hz", "erpm") or lower.endswith(" el"):
        return None if shaft else unit
    if shaft and conversion("omega_e", f"{unit} mech", 1) is not None:
        return f"{unit} mech"
    return unit if electrical else None
