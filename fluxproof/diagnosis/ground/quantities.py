# SPDX-License-Identifier: BSD-3-Clause
"""Numbers with units as an engineer writes them: 27 us and not 2.7e-05 s, 5.1 +- 0.1 V and not 5.0873 +- 0.0972 V.

measured(2.7e-5, 3e-7, "s")          # "27.0 ± 0.3 µs", for the report
ascii_of(measured(0.35, 0.01, "ohm"))  # "0.350 +- 0.010 Ohm", for a terminal and diagnosis.json
"""

from __future__ import annotations

import math
import re

UNITS = {"ohm": "Ω", "degC": "°C", "1": "%", "1/K": "%/K", "Nm": "N m", "Nms": "N m s", "kgm2": "kg m²"}
PERCENT = ("1", "1/K")  # a pure number reads best in percent
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
PREFIXED = re.compile(r"(V|A|s|H|F|Wb|Ω|N m)(?![a-zA-Z0-9²])")  # units, also of a product, that take a prefix
LARGE = 1e4  # from here on kilo: 12 kΩ, but 1234 Ω
ASCII = {"±": "+-", "Ω": "Ohm", "µ": "u", "−": "-", "°C": " degC", "²": "2", "°": " deg", "–": "-"}
RPM = 9.549296585513721  # rad/s to 1/min, 60/(2 pi)


def number(value, digits: int = 4) -> str:
    """A number with ``digits`` significant digits and a typographic minus sign; a dash for None or NaN."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    return f"{float(value):.{digits}g}".replace("-", "−")


def unit_text(unit: str) -> str:
    """A unit as it is printed; a pure number has none."""
    return "" if unit == "1" else unit if unit in PERCENT else UNITS.get(unit, unit)


def quantity(value, unit: str, digits: int = 4) -> str:
    """A number with its unit and SI prefix: 0.01607 H is written 16.07 mH."""
    factor, name = scaled(value, unit)
    return _joined(number(value / factor if factor != 1.0 else value, digits), name)


def measured(value: float, sigma: float | None, unit: str, digits: int = 2) -> str:
    """value ± sigma with ``digits`` significant digits of sigma, and the unit; angles also in degrees.

    digits = 1: one digit of sigma, two if it begins with 1.  A sigma of zero belongs to a number without an error,
    such as a harmonic order.
    """
    largest = max(abs(value), sigma) if sigma is not None and math.isfinite(sigma) else value
    factor, name = scaled(largest, unit)
    if sigma == 0.0:
        text = quantity(value, unit)
    elif sigma is None or not math.isfinite(sigma) or sigma < 0.0:
        text = f"{quantity(value, unit)} (uncertainty unknown)"
    else:
        places = decimals(sigma / factor, digits)
        pair = " ± ".join(fixed(x / factor, places) for x in (value, sigma))
        text = _joined(pair.replace("-", "−"), name)
    return f"{text} = {number(math.degrees(value), 3)}°" if unit == "rad" else text


def decimals(sigma: float, digits: int) -> int:
    """Decimal places to which a value with the standard deviation sigma is rounded; negative: tens, hundreds."""
    leading = math.floor(math.log10(sigma))
    more = 1 if digits == 1 and round(sigma / 10.0**leading, 1) < 2.0 else 0
    return min(digits + more - 1 - leading, 9)


def scaled(value, unit: str) -> tuple[float, str]:
    """(factor, unit with SI prefix): the value divided by the factor has that unit."""
    name = UNITS.get(unit, unit)
    if unit in PERCENT:
        return 0.01, name
    if not PREFIXED.match(name) or value is None or not math.isfinite(value) or value == 0.0:
        return 1.0, name
    if abs(value) >= LARGE:
        return 1e3, f"k{name}"
    factor, prefix = next(((f, p) for f, p in PREFIXES if abs(value) >= 0.1 * f), PREFIXES[-1])
    return factor, prefix + name


def ascii_of(text: str) -> str:
    """The same text in the letters that every terminal has."""
    for letter, plain in ASCII.items():
        text = text.replace(letter, plain)
    return text


def fixed(x: float, places: int) -> str:
    """x rounded to decimal places, of which negative ones are tens and hundreds."""
    return f"{round(x, places) + 0.0:.{max(places, 0)}f}"  # no minus in front of zero


def _joined(value: str, unit: str) -> str:
    return f"{value} {unit}".rstrip()


def counted(n: int, what: str) -> str:
    """A number of things: "1 gap", "2 gaps"."""
    return f"{n} {what}{'s' * (n != 1)}"
