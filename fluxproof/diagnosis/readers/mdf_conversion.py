# SPDX-License-Identifier: BSD-3-Clause
"""From the raw values of an MDF channel to physical ones, by the coefficients of its conversion (not itself a reader).

asammdf hands a formula of the file to numexpr or sympy, which run it as Python.  So the channels are read raw, and the
conversions of the ASAM standard that are numbers are applied here; a formula is refused.  ``x`` is the raw value, (n,).
"""

from __future__ import annotations

import numpy as np

DEEPEST = 4  # conversions that refer to conversions
TEXT = None  # the result of a conversion to words

# ASAM MDF 4: cc_type
LINEAR, RATIONAL, ALGEBRAIC, INTERPOLATED, TABLE, RANGES, VALUE_TO_TEXT, RANGE_TO_TEXT = range(1, 9)
# ASAM MDF 3: conversion formula identifier
LINEAR3, INTERPOLATED3, TABLE3, POLYNOMIAL3 = 0, 1, 2, 6
EXPONENTIAL3, LOGARITHMIC3, RATIONAL3, FORMULA3, VALUE_TO_TEXT3, RANGE_TO_TEXT3 = range(7, 13)
NONE, NONE3 = 0, 65535


def refusal(conversion, newer: bool, depth: int = 0) -> str:
    """Why a conversion cannot be applied, "" if it can.  ``newer``: MDF 4, else MDF 2 or 3."""
    if conversion is None:
        return ""
    kind = conversion.conversion_type
    if kind == (ALGEBRAIC if newer else FORMULA3) or "{X}" in _default_text(conversion):
        return "a formula, which is not evaluated"
    if depth > DEEPEST:
        return f"more than {DEEPEST} conversions inside each other"
    inner = [block for block in _references(conversion) if not isinstance(block, bytes)]
    return next((reason for block in inner if (reason := refusal(block, newer, depth + 1))), "")


def is_plain(conversion, newer: bool) -> bool:
    """Whether there is no conversion or a linear one."""
    kinds = (NONE, LINEAR) if newer else (NONE3, LINEAR3)
    return conversion is None or conversion.conversion_type in kinds


def physical(conversion, x: np.ndarray, newer: bool) -> np.ndarray | None:
    """Physical values (n,) of a conversion that ``refusal`` accepts; NaN for a word among numbers, TEXT for words."""
    if conversion is None:
        return x
    with np.errstate(all="ignore"):  # a division by zero gives a value that is not finite, which the checks find
        return (_newer if newer else _older)(conversion, x)


def _newer(c, x):
    kind = c.conversion_type
    if kind == NONE:
        return x
    if kind == LINEAR:
        return _linear(c, x)
    if kind == RATIONAL:
        return _rational(c, x)
    if kind in (INTERPOLATED, TABLE):
        return _table(c, x, c.val_param_nr // 2, kind == INTERPOLATED)
    if kind == RANGES:
        n = (c.val_param_nr - 1) // 3
        result = np.full(x.shape, float(c.default))
        for place, index in _in_ranges(_array(c, "lower", n), _array(c, "upper", n), x):
            result[place] = c[f"phys_{index}"]
        return result
    if kind in (VALUE_TO_TEXT, RANGE_TO_TEXT):
        return _partly_words(c, x, kind == RANGE_TO_TEXT)
    return TEXT


def _older(c, x):
    kind = c.conversion_type
    if kind == NONE3:
        return x
    if kind == LINEAR3:
        return _linear(c, x)
    if kind in (INTERPOLATED3, TABLE3):
        return _table(c, x, c.ref_param_nr, kind == INTERPOLATED3)
    if kind == POLYNOMIAL3:
        x = x - c.P5 - c.P6
        return (c.P2 - c.P4 * x) / (c.P3 * x - c.P1)
    if kind in (EXPONENTIAL3, LOGARITHMIC3):
        function = np.exp if kind == EXPONENTIAL3 else np.log
        if c.P4 == 0:
            return function(((x - c.P7) * c.P6 - c.P3) / np.float64(c.P1)) / np.float64(c.P2)
        if c.P1 == 0:
            return function((c.P3 / (x - c.P7) - c.P6) / np.float64(c.P4)) / np.float64(c.P5)
        return np.full(x.shape, np.nan)  # the standard defines no other
    if kind == RATIONAL3:
        return _rational(c, x)
    return TEXT


def _linear(c, x):
    return x if (c.a, c.b) == (1, 0) else x * float(c.a) + float(c.b)


def _rational(c, x):
    x = x.astype(float)
    return (c.P1 * x**2 + c.P2 * x + c.P3) / (c.P4 * x**2 + c.P5 * x + c.P6)


def _array(c, name: str, n: int) -> np.ndarray:
    return np.array([c[f"{name}_{k}"] for k in range(n)], float)


def _table(c, x, n: int, interpolated: bool) -> np.ndarray:
    """The table's value, between two of its points or of the nearer one (the lower if both are as near)."""
    raw, values = _array(c, "raw", n), _array(c, "phys", n)
    order = np.argsort(raw, kind="stable")
    raw, values = raw[order], values[order]
    if not n:
        return np.full(x.shape, np.nan)
    x = x.astype(float)
    if interpolated:
        return np.interp(x, raw, values)
    above = np.minimum(np.searchsorted(raw, x), n - 1)
    below = np.maximum(above - 1, 0)
    return np.where(np.abs(x - raw[below]) <= np.abs(x - raw[above]), values[below], values[above])


def _in_ranges(lower, upper, x):
    """(bool (n,), index) of each range that has values; the upper end belongs to it for integers only."""
    for index, (low, high) in enumerate(zip(lower, upper, strict=True)):
        place = (x >= low) & ((x < high) if x.dtype.kind == "f" and low != high else (x <= high))
        if place.any():
            yield place, index


def _partly_words(c, x, ranges: bool):
    """Values of the conversions that the table refers to; NaN where it gives a word; TEXT if it gives only words."""
    n = c.val_param_nr // 2 if ranges else c.val_param_nr
    names = [f"text_{k}" for k in range(n)]
    blocks = [c.referenced_blocks.get(name) for name in names]
    default = c.referenced_blocks.get("default_addr")
    if all(_is_word(block) for block in (*blocks, default)):
        return TEXT
    lower, upper = (_array(c, "lower", n), _array(c, "upper", n)) if ranges else (_array(c, "val", n),) * 2
    found = np.full(x.shape, -1)
    for place, index in _in_ranges(lower, upper, x):
        found[place] = index
    result = np.full(x.shape, np.nan)
    for index in np.unique(found):
        block = default if index < 0 else blocks[index]
        if not _is_word(block):
            values = physical(block, x[found == index], newer=True)
            result[found == index] = np.nan if values is TEXT else values
    return result


def _is_word(block) -> bool:
    return block is None or isinstance(block, bytes)


def _references(conversion):
    return [block for block in (getattr(conversion, "referenced_blocks", None) or {}).values() if block is not None]


def _default_text(conversion) -> str:
    default = (getattr(conversion, "referenced_blocks", None) or {}).get("default_addr")
    return default.decode("latin-1") if isinstance(default, bytes) else ""
