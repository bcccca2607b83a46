# SPDX-License-Identifier: BSD-3-Clause
"""Units of recordings, as factor and offset to the canonical SI unit of a column.

canonical = raw * factor + offset.  A shaft quantity ("mech", "rpm", turns per second of the shaft) is multiplied
by the number of pole pairs; "erpm" and "Hz" are electrical.  rms values ("Arms") become peak values.  A modulation
index has the unit of the voltage that it is a share of, such as "u_dc/2".
"""

from __future__ import annotations

import math

from fluxproof.diagnosis.ground.recording import COLUMNS

TURN = 2.0 * math.pi
DEGREE = math.pi / 180.0
RPM = TURN / 60.0
PEAK = math.sqrt(2.0)
POUND_FOOT = 0.45359237 * 9.80665 * 0.3048

# quantity -> {unit: factor}; units in OF_SHAFT are also multiplied by the pole pairs.
FACTORS = {
    "s": {
        "s": 1.0,
        "sec": 1.0,
        "second": 1.0,
        "seconds": 1.0,
        "ms": 1e-3,
        "us": 1e-6,
        "µs": 1e-6,
        "ns": 1e-9,
        "min": 60.0,
        "h": 3600.0,
        "hh:mm:ss": 1.0,  # readers give clock times in seconds
    },
    "A": {
        "A": 1.0,
        "Amps": 1.0,
        "amps": 1.0,
        "Amp": 1.0,
        "Ampere": 1.0,
        "Amperes": 1.0,
        "mA": 1e-3,
        "kA": 1e3,
        "Arms": PEAK,
        "A rms": PEAK,
        "A_rms": PEAK,
        "Apk": 1.0,
        "A peak": 1.0,
    },
    "V": {
        "V": 1.0,
        "Volt": 1.0,
        "Volts": 1.0,
        "volts": 1.0,
        "mV": 1e-3,
        "kV": 1e3,
        "Vrms": PEAK,
        "V rms": PEAK,
        "V_rms": PEAK,
        "Vpk": 1.0,
        "V peak": 1.0,
    },
    "rad": {
        "rad": 1.0,
        "rad el": 1.0,
        "mrad": 1e-3,
        "deg": DEGREE,
        "°": DEGREE,
        "deg el": DEGREE,
        "turn": TURN,
        "turn el": TURN,
        "rad mech": 1.0,
        "deg mech": DEGREE,
        "turn mech": TURN,
        "rev": TURN,
    },
    "rad/s": {
        "rad/s": 1.0,
        "rad.s": 1.0,
        "rad_s": 1.0,
        "rad/sec": 1.0,
        "rad s-1": 1.0,
        "rad/s el": 1.0,
        "mrad/s": 1e-3,
        "deg/s": DEGREE,
        "deg_s": DEGREE,
        "°/s": DEGREE,
        "Hz": TURN,
        "erpm": RPM,
        "krpm": 1e3 * RPM,
        "rpm": RPM,
        "1/min": RPM,
        "min-1": RPM,
        "min^-1": RPM,
        "min⁻¹": RPM,
        "U/min": RPM,
        "r/min": RPM,
        "rad/s mech": 1.0,
        "rad.s mech": 1.0,
        "rad/sec mech": 1.0,
        "rad s-1 mech": 1.0,
        "deg/s mech": DEGREE,
        "turn/s": TURN,
        "turn/s mech": TURN,
        "rev/s": TURN,
        "rps": TURN,
    },
    "1": {"1": 1.0, "-": 1.0, "": 1.0, "%": 0.01, "percent": 0.01, "permille": 1e-3, "‰": 1e-3},
    "degC": {
        "degC": 1.0,
        "°C": 1.0,
        "C": 1.0,
        "deg C": 1.0,
        "celsius": 1.0,
        "K": 1.0,
        "degF": 5 / 9,
        "°F": 5 / 9,
    },
    "W": {"W": 1.0, "kW": 1e3, "MW": 1e6, "mW": 1e-3},
    "Nm": {
        "Nm": 1.0,
        "N m": 1.0,
        "N*m": 1.0,
        "N.m": 1.0,
        "N·m": 1.0,
        "N-m": 1.0,
        "lb-ft": POUND_FOOT,
        "lbf-ft": POUND_FOOT,
        "ft-lb": POUND_FOOT,
        "in-lb": POUND_FOOT / 12.0,
        "lb-in": POUND_FOOT / 12.0,
        "oz-in": POUND_FOOT / 192.0,
        "mNm": 1e-3,
        "Nmm": 1e-3,
        "N.mm": 1e-3,
        "N mm": 1e-3,
        "kNm": 1e3,
    },
}
OF_SHAFT = {
    "rad mech",
    "deg mech",
    "turn mech",
    "rev",
    "rpm",
    "krpm",
    "1/min",
    "min-1",
    "min^-1",
    "min⁻¹",
    "U/min",
    "r/min",
    "rad/s mech",
    "rad.s mech",
    "rad/sec mech",
    "rad s-1 mech",
    "deg/s mech",
    "turn/s",
    "turn/s mech",
    "rev/s",
    "rps",
}
# Voltages as a modulation index: shares of the bus voltage of the same row.
OF_BUS = {
    "u_dc": 1.0,
    "u_dc/2": 0.5,
    "u_dc/sqrt(3)": 1.0 / math.sqrt(3.0),
    "2/pi u_dc": 2.0 / math.pi,
    "u_dc/65536": 1.0 / 65536.0,
}
COMMANDED = ("u_d_ref", "u_q_ref")
OFFSETS = {"K": -273.15, "degF": -160 / 9, "°F": -160 / 9}


def conversion(column: str, unit: str, pole_pairs: int) -> tuple[float, float] | None:
    """(factor, offset) from ``unit`` to the canonical unit of ``column``; None for an unknown unit."""
    table = FACTORS[COLUMNS[column]]
    found = next((u for u in table if u == unit), None)
    if found is None:  # case matters for prefixes (mV, MV), not for words (RPM)
        alike = [u for u in table if u.lower() == unit.lower()]
        if len({table[u] for u in alike}) != 1:
            return None
        found = alike[0]
    factor = table[found] * (pole_pairs if found in OF_SHAFT else 1)
    return factor, OFFSETS.get(found, 0.0)


def known_units(column: str) -> str:
    """The units that are known for a column, for messages."""
    return ", ".join([*(u for u in FACTORS[COLUMNS[column]] if u), *(OF_BUS if column in COMMANDED else ())])


def split_unit(name: str) -> tuple[str, str]:
    """("i_a", "mA") of "i_a [mA]" or "i_a (mA)"; ("i_a", "") without a unit; "i_abc[0]" is a channel."""
    name = name.strip()
    inside = name[:-1] if name.endswith(("]", ")")) else ""
    start = max(inside.rfind("["), inside.rfind("("))
    stem, unit = inside[: max(start, 0)], inside[start + 1 :].strip()
    channel = unit.isdigit() and stem == stem.rstrip()
    if not stem.strip() or channel or any(c in unit for c in "])"):
        return name, ""
    return stem.strip(), unit
