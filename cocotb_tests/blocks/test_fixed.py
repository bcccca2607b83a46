# SPDX-License-Identifier: BSD-3-Clause
"""fixed.py and fixed_pkg.vhd: equal for every value of every small format, and for random values of wide ones."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from fluxproof.checkout import ROOT, RTL
from golden_model import fixed
from golden_model.block import Const
from golden_model.fixed import Format
from scripts import generate

SMALL_BITS = 7
WIDE = 6000


def cases() -> list[tuple[int, int, int, int]]:
    """(drop, width, bits, x): all of the small ones, seeded random and corner ones up to 60 bits."""
    rows = [
        (drop, width, bits, x)
        for bits in range(1, SMALL_BITS + 1)
        for drop in range(bits)
        for width in range(1, bits + 2)
        for x in range(-(1 << (bits - 1)), 1 << (bits - 1))
    ]
    rng = np.random.default_rng(1)
    for _ in range(WIDE):
        bits = int(rng.integers(8, 60))
        lo, hi = -(1 << (bits - 1)), (1 << (bits - 1)) - 1
        x = int(rng.integers(lo, hi, endpoint=True)) >> int(rng.integers(bits))
        x = int(rng.choice([lo, lo + 1, -1, 0, 1, hi - 1, hi])) if rng.integers(5) == 0 else x
        rows.append((int(rng.integers(bits)), int(rng.integers(2, bits + 2)), bits, x))
    return rows


def number(text: str, signed: bool) -> int:
    value = int(text, 2)
    return value - (1 << len(text)) if signed and text[0] == "1" else value


def test_vhdl_equals_python(tmp_path):
    rows = cases()
    (tmp_path / "in.txt").write_text("".join(f"{d} {w} {b} {x & ((1 << b) - 1):0{b}b}\n" for d, w, b, x in rows))
    common = ["--std=08", f"--workdir={tmp_path}"]
    for source in (RTL / "common" / "fixed_pkg.vhd", ROOT / "tb" / "fixed_tb.vhd"):
        subprocess.run(["ghdl", "-a", *common, str(source)], check=True, cwd=tmp_path)
    subprocess.run(["ghdl", "-e", *common, "fixed_tb"], check=True, cwd=tmp_path)
    generics = [f"-gSTIMULI={tmp_path / 'in.txt'}", f"-gRESULTS={tmp_path / 'out.txt'}"]
    subprocess.run(["ghdl", "-r", *common, "fixed_tb", *generics], check=True, cwd=tmp_path)
    lines = (tmp_path / "out.txt").read_text().splitlines()
    assert len(lines) == len(rows) > 10_000
    for (drop, width, bits, x), line in zip(rows, lines, strict=True):
        fields = line.split()
        signs = (True, True, False, False, True, True, True) + (True,) * (3 if drop else 0)
        got = [number(text, signed) for text, signed in zip(fields, signs, strict=True)]
        limit = 1 << (min(width, bits) - 1)
        wanted = [
            fixed.round_half_up(x, drop),
            fixed.saturate(x, width),
            fixed.exceeds(x, width),
            fixed.saturate_u(x, width),
            fixed.round_sat(x, drop, width),
            fixed.clamp(x, -limit, limit),
            x - fixed.round_half_up(x, drop),
        ]
        if drop:
            minus = fixed.round_half_up(-x, drop)
            wanted += [minus, fixed.round_half_up(x, drop), minus]
        assert got == wanted, f"drop {drop}, width {width}, {bits} bits, x = {x}: got {got}, wanted {wanted}"


@pytest.mark.parametrize("drop", range(6))
def test_rounding_is_half_up(drop):
    """Against exact rational arithmetic, not against itself."""
    from fractions import Fraction
    from math import floor

    for x in range(-200, 200):
        assert fixed.round_half_up(x, drop) == floor(Fraction(x, 2**drop) + Fraction(1, 2))


def test_wrap_is_modulo():
    for x in range(-70, 70):
        assert fixed.wrap(x, 4) == x % 16
        assert fixed.wrap_s(x, 4) == (x + 8) % 16 - 8


def test_format_arithmetic():
    fmt = Format(1, -1, 18)
    assert (fmt.width, fmt.lo, fmt.hi, fmt.lsb) == (18, -(1 << 17), (1 << 17) - 1, 2.0**-18)
    assert str(fmt) == "S(-1,18)"
    assert fmt.to_int(1e9) == fmt.hi and fmt.to_int(-1e9) == fmt.lo
    with pytest.raises(ValueError, match="cannot be represented"):
        fmt.to_int(float("nan"))
    with pytest.raises(ValueError, match="does not fit"):
        _ = Const(1.0, fmt).value


def test_generated_package_is_fresh(monkeypatch, tmp_path, capsys):
    """The committed VHDL package matches the declarations of the blocks; a stale one is detected."""
    assert generate.PACKAGE.read_text() == generate.render(), "run `make generate` and commit the result"
    stale = tmp_path / "fluxproof_pkg.vhd"
    stale.write_text(generate.render().replace("CLARKE_LATENCY : positive := ", "CLARKE_LATENCY : positive := 1"))
    monkeypatch.setattr(generate, "PACKAGE", stale)
    monkeypatch.setattr("sys.argv", ["generate", "--check"])
    assert generate.main() == 1
    assert "stale" in capsys.readouterr().err
