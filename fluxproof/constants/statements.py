# SPDX-License-Identifier: BSD-3-Clause
"""What a data sheet states about a machine: "kt=2.98 Nm/Arms", and everything that such a line can mean.

A number of a data sheet has a unit and a convention: rms or peak, between two lines or of one phase, per ampere of a
sinusoidal current or of the DC of a block commutation.  Where the convention is not written, a statement keeps all
usual meanings, and fluxproof.constants.agree finds those that fit the other statements.

The machine (star equivalent, peak values, shaft speed omega, pole pairs p, flux linkage psi):

    EMF of a phase         p psi omega           between two lines  sqrt(3) p psi omega
    torque per ampere      1.5 p psi (peak)      1.5 sqrt(2) p psi (rms)       sqrt(3) p psi (DC, two phases conduct)
    torque per sqrt(loss)  K_m^2 = 1.5 p^2 psi^2 / R: the same in every convention
    a DC of block commutation has the torque, and the loss, of sinusoidal currents whose peak is 2/sqrt(3) of it
    R, L of a phase        half of what lies between two lines; a third of one winding in delta
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

from golden_model.drive_keys import DriveError

RPM = math.pi / 30.0  # rad/s
ROOT2, ROOT3 = math.sqrt(2.0), math.sqrt(3.0)
# Half width of a statement, as a logarithm: data sheets round, and magnets scatter by some per cent.  Two statements
# agree within the sum: 7 %, half of the closest two conventions (per peak ampere against per ampere of DC, 15 %).
USUAL, NO_LOAD = 0.035, 0.075


class Meaning(NamedTuple):
    """One way to read a statement: its words, and the value in the unit of the quantity's target."""

    words: str
    value: float


@dataclass(frozen=True)
class Statement:
    """One line of the data sheet with all that it can mean; ``target`` is what the value is a value of.

    Targets: p (pole pairs), p_psi (p times the flux linkage, Wb), psi (Wb), r (ohm), l, l_d, l_q (H), j (kg m2),
    i (A peak), omega (rad/s of the shaft), u (V), omega_0 (rad/s without load), km2 (N2 m2/W), tau_m, tau_e (s).
    """

    text: str
    name: str
    target: str
    meanings: tuple[Meaning, ...]
    tolerance: float = USUAL


class Quantity(NamedTuple):
    """How a name is read: its target, units with their factor, and the conventions that its value can have."""

    target: str
    units: dict[str, float]
    conventions: dict[str, float] | None = None  # words -> factor; None: there is only one
    invert: bool = False  # the target is the reciprocal
    square: bool = False


# A line's value times the factor is p psi of a peak phase value.
_EMF = {"line rms": ROOT2 / ROOT3, "line peak": 1 / ROOT3, "phase rms": ROOT2, "phase peak": 1.0}
_TORQUE = {"rms": 1 / (1.5 * ROOT2), "peak": 1 / 1.5, "dc": 1 / ROOT3}
_WINDING = {"line": 0.5, "phase": 1.0, "winding": 1.0}
_OZ_IN, _LB_IN = 0.0070615518, 0.1129848290  # Nm
_OHM = {"ohm": 1.0, "Ohm": 1.0, "Ω": 1.0, "mohm": 1e-3, "mOhm": 1e-3, "mΩ": 1e-3}
_HENRY = {"H": 1.0, "mH": 1e-3, "uH": 1e-6, "µH": 1e-6}
_SECOND = {"s": 1.0, "ms": 1e-3}
_SPEED = {"rpm": RPM, "1/min": RPM, "rad/s": 1.0}

QUANTITIES = {
    "pole_pairs": Quantity("p", {"": 1.0}),
    "poles": Quantity("p", {"": 0.5}),
    "kt": Quantity("p_psi", {"Nm/A": 1.0, "mNm/A": 1e-3, "oz-in/A": _OZ_IN, "lb-in/A": _LB_IN}, _TORQUE),
    "ke": Quantity(
        "p_psi",
        {"V/krpm": 1e-3 / RPM, "V/rpm": 1 / RPM, "mV/rpm": 1e-3 / RPM, "mVmin": 1e-3 / RPM, "Vs/rad": 1.0,
         "V/(rad/s)": 1.0, "mVs/rad": 1e-3},
        _EMF,
    ),
    "kv": Quantity("p_psi", {"rpm/V": RPM, "rad/s/V": 1.0}, {"line peak": 1 / ROOT3} | _EMF, invert=True),
    "flux": Quantity("psi", {"Wb": 1.0, "mWb": 1e-3, "Vs": 1.0, "mVs": 1e-3, "V/Hz": 0.5 / math.pi}),
    "r": Quantity("r", _OHM, _WINDING),
    "l": Quantity("l", _HENRY, _WINDING),
    "ld": Quantity("l_d", _HENRY, _WINDING),
    "lq": Quantity("l_q", _HENRY, _WINDING),
    "j": Quantity(
        "j", {"kgm2": 1.0, "kgcm2": 1e-4, "gcm2": 1e-7, "kgmm2": 1e-6, "oz-in-s2": _OZ_IN, "lb-in-s2": _LB_IN}
    ),
    "i": Quantity("i", {"A": 1.0}, {"rms": ROOT2, "peak": 1.0, "dc": 2 / ROOT3}),
    "n": Quantity("omega", _SPEED),
    "n0": Quantity("omega_0", _SPEED),
    "u": Quantity("u", {"V": 1.0}),
    "km": Quantity("km2", {"Nm/sqrtW": 1.0, "Nm/√W": 1.0, "mNm/sqrtW": 1e-3, "oz-in/sqrtW": _OZ_IN}, square=True),
    "gradient": Quantity("km2", {"rpm/mNm": 1e3 * RPM, "rpm/Nm": RPM, "rad/s/Nm": 1.0}, invert=True),
    "tau_m": Quantity("tau_m", _SECOND),
    "tau_e": Quantity("tau_e", _SECOND),
}  # fmt: skip
# Without a word, these meanings come into question; Kv is what a hobby motor's bus voltage gives: the line's peak.
_UNSAID = {"kv": ("line peak",), "r": ("line", "phase"), "l": ("line", "phase"), "ld": ("line", "phase"),
           "lq": ("line", "phase")}  # fmt: skip
_WORDS = {
    "line rms": "rms between two lines", "line peak": "peak between two lines", "phase rms": "rms of a phase",
    "phase peak": "peak of a phase", "rms": "per A rms", "peak": "per A peak", "dc": "per A of DC, block commutation",
    "line": "between two lines", "phase": "of a phase", "winding": "of a winding",
}  # fmt: skip
_SYNONYMS = {"ll": "line", "l-l": "line", "line-line": "line", "terminal": "line", "pk": "peak"}
_LINE = re.compile(r"\s*([a-z_0-9]+)\s*=\s*([-+.,\d]+(?:[eE][-+]?\d+)?)\s*(.*)\Z", re.ASCII | re.DOTALL)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z", re.ASCII)


def read(text: str, connection: str = "star") -> Statement:
    """A statement of the form "name=value unit words"; DriveError says what is not understood and what would be.

    connection: "star" or "delta", of a value of one winding.
    """
    found = _LINE.match(text)
    name = found.group(1) if found else ""
    if not found or name not in QUANTITIES:
        raise DriveError(f"{text!r}: expected NAME=VALUE UNIT with a name of {', '.join(QUANTITIES)}")
    quantity = QUANTITIES[name]
    number, rest = found.group(2), found.group(3)
    if not _NUMBER.match(number):
        comma = ", with a point in place of the comma" if "," in number else ""
        raise DriveError(f"{text!r}: {number!r} is not a number; expected one such as {name}=2.98{comma}")
    value = float(number)
    if not 0.0 < value < 1e12:
        raise DriveError(f"{text!r}: expected a number above zero")
    unit, said = _unit(text, quantity, rest.split())
    value *= quantity.units[unit]
    value = 1 / value if quantity.invert else value
    value = value * value if quantity.square else value
    if quantity.target == "p" and value != int(value):
        raise DriveError(f"{text!r}: expected a whole number{' that is even' if name == 'poles' else ''}")
    tolerance = NO_LOAD if name == "n0" else USUAL
    if quantity.conventions is None:
        return Statement(text.strip(), name, quantity.target, (Meaning("", value),), tolerance)
    chosen = _conventions(text, name, quantity.conventions, said)
    third = connection == "delta"
    meanings = []
    for words in chosen:
        factor = quantity.conventions[words]
        if words == "winding" and third:
            factor /= 3.0
        meaning = _WORDS[words] if name != "i" else _WORDS[words].replace("per A ", "")
        meanings.append(Meaning(f"{meaning} in {connection}" if words == "winding" else meaning, value * factor))
    return Statement(text.strip(), name, quantity.target, tuple(meanings), tolerance)


def _unit(text: str, quantity: Quantity, parts: list[str]) -> tuple[str, set[str]]:
    """The unit without marks such as "rms" in it, and the words of the convention that were said."""
    said = {part.lower().strip("()") for part in parts[1:]}
    unit = parts[0] if parts else ""
    plain = re.sub(r"(?<=[VA])(rms|pk|peak|eff)(?![a-z])", "", unit)
    if plain != unit:
        said.add("peak" if "pk" in unit or "peak" in unit else "rms")
    if plain not in quantity.units:
        known = ", ".join(u or "no unit" for u in quantity.units)
        what = f"the unit {unit!r} is not known here" if unit else "the unit is missing"
        raise DriveError(f"{text!r}: {what}; expected one of {known}")
    return plain, said


def _conventions(text: str, name: str, known: dict[str, float], said: set[str]) -> list[str]:
    """The conventions that contain every word that was said; the usual ones where nothing was."""
    said = {_SYNONYMS.get(word, word) for word in said}
    fits = [words for words in known if said <= set(words.split())]
    if not fits:
        choice = sorted({word for words in known for word in words.split()})
        raise DriveError(f"{text!r}: expected words of {', '.join(choice)} after the unit")
    if not said and name in _UNSAID:
        return list(_UNSAID[name])
    return fits
