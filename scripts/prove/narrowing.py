# SPDX-License-Identifier: BSD-3-Clause
"""fixed_pkg: no function wraps, for every input, in every combination of widths that the core uses.

The widths are found automatically: a copy of the package in which each function reports its widths is elaborated with
the whole core; the reported combinations are proved.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from functools import lru_cache, partial
from pathlib import Path

from fluxproof.checkout import ROOT
from fluxproof.cosim.sources import rtl_sources
from fluxproof.cosim.verilog import find_ghdl
from scripts.prove.proof import Fault, Proof

PACKAGE = "common/fixed_pkg.vhd"

# Function -> its report: widths of its operands, dropped bits, width of its result, as VHDL expressions.
REPORTS = {
    "round_half_up": ("x'length", "drop"),
    "saturate": ("x'length", "width"),
    "exceeds": ("x'length", "width"),
    "saturate_u": ("x'length", "width"),
    "round_sat": ("x'length", "drop", "width"),
    "clamp": ("x'length", "lo'length", "hi'length"),
    "plus_rounded": ("a'length", "v'length", "drop"),
    "minus_half_up": ("x'length", "drop"),
    "turned_half_up": ("x'length", "drop"),
    "difference": ("a'length", "b'length"),
}

# A function that the core does not use at present is proved in one combination.
UNUSED = {
    "round_half_up": (20, 4),
    "saturate": (20, 12),
    "exceeds": (20, 12),
    "saturate_u": (20, 12),
    "round_sat": (20, 4, 12),
    "clamp": (20, 20, 20),
    "plus_rounded": (24, 20, 4),
    "minus_half_up": (20, 4),
    "turned_half_up": (20, 4),
    "difference": (20, 18),
}

REPORTER = """
  function used (said : string) return natural is
  begin
    report "used " & said;
    return 0;
  end function;
"""

FAULTS = {
    "round_half_up": Fault(
        "carry of the rounding lost", PACKAGE, "return wide(x'length downto drop);",
        "return resize(wide(x'length - 1 downto drop), x'length + 1 - drop);",
    ),
    "saturate": Fault("wraps", PACKAGE, "if exceeds(x, width) = '0' then", "if true then"),
    "exceeds": Fault(
        "beyond the upper end not seen", PACKAGE, "or (v(v'high downto width) xor v(v'high - 1 downto width - 1))",
        "or (v(v'high downto width) and not v(v'high - 1 downto width - 1))",
    ),
    "saturate_u": Fault(
        "wraps just above the range", PACKAGE, "if v(v'high downto width) = ZERO(v'high downto width) then",
        "if v(v'high downto width + 1) = ZERO(v'high downto width + 1) then",
    ),
    "round_sat": Fault(
        "wraps", PACKAGE, "return saturate(round_half_up(x, drop), width);",
        "return resize(round_half_up(x, drop), width);",
    ),
    "clamp": Fault("no upper limit", PACKAGE, "return resize(hi, x'length);", "return x;"),
    "plus_rounded": Fault("half lost", PACKAGE, "sum := (a & '1')", "sum := (a & '0')"),
    "minus_half_up": Fault("half missing", PACKAGE, "+ not half(drop, x'length + 1);", "- 1;"),
    "turned_half_up": Fault(
        "complement taken for the negative", PACKAGE, "one_more(0) := minus;", "one_more(0) := '0';"
    ),
    "difference": Fault(
        "complement taken for the negative", PACKAGE, "((not resize(b, WIDTH)) & '1')", "((not resize(b, WIDTH)) & '0')"
    ),
}  # fmt: skip


@lru_cache(maxsize=1)
def widths_in_use() -> dict[str, tuple[tuple[int, ...], ...]]:
    """{function: sorted widths}, from an elaboration of the core; RuntimeError if GHDL reports nothing."""
    ghdl, _ = find_ghdl()
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(scratch) / "rtl"
        shutil.copytree(ROOT / "rtl", tree)
        declaration, body = (tree / PACKAGE).read_text().split("package body fixed_pkg is")
        for name, reported in REPORTS.items():
            said = ' & " " & '.join(f"integer'image({width})" for width in reported)
            probe = f'    constant PROBE : natural := used("{name} " & {said});\n'
            body, found = re.subn(rf"(function {name} \([^\n]* is\n)", lambda m, p=probe: m.group(1) + p, body)
            if found != 1:
                raise RuntimeError(f"rtl/{PACKAGE} has {found} functions {name} written on one line, expected one")
        (tree / PACKAGE).write_text(f"{declaration}package body fixed_pkg is{REPORTER}{body}")
        command = [str(ghdl), "--synth", "--std=08", "--out=none", f"--workdir={scratch}"]
        command += [*map(str, rtl_sources(tree)), "-e", "fluxproof"]
        done = subprocess.run(command, capture_output=True, text=True)
    seen: dict[str, set] = {name: set() for name in REPORTS}
    for name, widths in re.findall(r"\bused (\w+) ([\d ]+)", done.stdout + done.stderr):
        seen[name].add(tuple(map(int, widths.split())))
    if done.returncode or not any(seen.values()):
        raise RuntimeError(f"cannot find the widths in use: {done.stderr[-300:]}")
    return {name: tuple(sorted(widths or {UNUSED[name]})) for name, widths in seen.items()}


def call(name: str, w: tuple[int, ...]) -> tuple[str, int, bool]:
    """(VHDL expression over the vectors x, p and q, width of its result, whether it is signed)."""
    x = f"x({w[0] - 1} downto 0)"
    if name == "round_half_up":
        return f"round_half_up({x}, {w[1]})", w[0] + 1 - w[1], True
    if name == "minus_half_up":
        return f"minus_half_up({x}, {w[1]})", w[0] + 1 - w[1], True
    if name == "turned_half_up":
        return f"turned_half_up({x}, p(0), {w[1]})", w[0] + 1 - w[1], True
    if name == "difference":
        return f"difference({x}, p({w[1] - 1} downto 0))", max(w) + 1, True
    if name == "exceeds":
        return f"exceeds({x}, {w[1]})", 1, False
    if name == "round_sat":
        return f"round_sat({x}, {w[1]}, {w[2]})", w[2], True
    if name == "clamp":
        return f"clamp({x}, p({w[1] - 1} downto 0), q({w[2] - 1} downto 0))", w[0], True
    if name == "plus_rounded":
        return f"{name}(p({w[0] - 1} downto 0), x({w[1] - 1} downto 0), {w[2]})", w[0], True
    return f"{name}({x}, {w[1]})", w[1], name == "saturate"


def vhdl(name: str) -> str:
    """An entity that applies the function in every combination of widths; outputs y_0, y_1, …"""
    ports, lines = [], []
    for k, widths in enumerate(widths_in_use()[name]):
        expression, width, signed = call(name, widths)
        kind = "std_logic" if name == "exceeds" else f"{'signed' if signed else 'unsigned'}({width - 1} downto 0)"
        ports.append(f"y_{k} : out {kind}")
        lines.append(f"  y_{k} <= {expression};")
    between = ";\n    ".join(ports)
    return f"""\
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;

entity used_{name} is
  port (
    x : in signed(47 downto 0);
    p : in signed(47 downto 0);
    q : in signed(47 downto 0);
    {between}
  );
end entity used_{name};

architecture rtl of used_{name} is
begin
{chr(10).join(lines)}
end architecture rtl;
"""


def wanted(name: str, w: tuple[int, ...]) -> tuple[str, str]:
    """(SystemVerilog expression of the expected result over 64-bit integers, assumption on the operands or "")."""

    def cut(vector: str, width: int) -> str:
        return f"$signed({{{{{64 - width}{{{vector}[{width - 1}]}}}}, {vector}[{width - 1}:0]}})"

    def rounded(value: str, drop: int) -> str:
        return f"(({value} + 64'sd{1 << (drop - 1)}) >>> {drop})" if drop else value

    def limited(value: str, low: int, high: int) -> str:
        least, most = f"{'-' if low < 0 else ''}64'sd{abs(low)}", f"64'sd{high}"
        return f"({value} > {most} ? {most} : {value} < {least} ? {least} : {value})"

    def limits(width: int) -> tuple[int, int]:
        return -(1 << (width - 1)), (1 << (width - 1)) - 1

    x = cut("x", w[0])
    if name == "round_half_up":
        return rounded(x, w[1]), ""
    if name == "minus_half_up":
        return rounded(f"(-{x})", w[1]), ""
    if name == "turned_half_up":
        return f"(p[0] ? {rounded(f'(-{x})', w[1])} : {rounded(x, w[1])})", ""
    if name == "difference":
        return f"({x} - {cut('p', w[1])})", ""
    if name == "saturate":
        return limited(x, *limits(w[1])), ""
    if name == "saturate_u":
        return limited(x, 0, (1 << w[1]) - 1), ""
    if name == "exceeds":
        return f"({limited(x, *limits(w[1]))} != {x} ? 64'sd1 : 64'sd0)", ""
    if name == "round_sat":
        return limited(rounded(x, w[1]), *limits(w[2])), ""
    if name == "clamp":
        low, high = cut("p", w[1]), cut("q", w[2])
        return f"({x} < {low} ? {low} : {x} > {high} ? {high} : {x})", f"{low} <= {high}"
    low, high = limits(w[0])
    total = f"({cut('p', w[0])} + {rounded(cut('x', w[1]), w[2])})"
    return total, f"{total} >= -64'sd{-low} && {total} <= 64'sd{high}"


def harness(name: str, verilog: str) -> str:
    """``formal_top``: every result, as an integer, equals the exact one."""
    wires, wiring, checks = [], [".x(x)", ".p(p)", ".q(q)"], []
    for k, widths in enumerate(widths_in_use()[name]):
        _, width, signed = call(name, widths)
        right, assumption = wanted(name, widths)
        sign_bit = f"y_{k}[{width - 1}]" if signed and width > 1 else "1'b0"
        wires.append(f"  wire [{width - 1}:0] y_{k};" if width > 1 else f"  wire y_{k};")
        wiring.append(f".y_{k}(y_{k})")
        wires.append(f"  wire signed [63:0] got_{k} = {{{{{64 - width}{{{sign_bit}}}}}, y_{k}}};")
        wires.append(f"  wire signed [63:0] want_{k} = {right};")
        condition = f"if ({assumption}) " if assumption else ""
        checks.append(f"    {condition}assert (got_{k} == want_{k});")
        if assumption:
            checks.append(f"    cover ({assumption});")
        if name != "exceeds" or widths[0] > widths[1]:  # nothing exceeds a width that is not smaller
            checks.append(f"    cover (got_{k} != 0);")
    return f"""\
// Made from the widths in which the core uses {name}.
module formal_top (input clk, input signed [47:0] x, input signed [47:0] p, input signed [47:0] q);
{chr(10).join(wires)}
  used_{name} dut ({", ".join(wiring)});
  always @(posedge clk) begin
{chr(10).join(checks)}
  end
endmodule
"""


def proof(name: str) -> Proof:
    assumed = {
        "clamp": "the lower limit is not above the upper one",
        "plus_rounded": "the sum fits, which the caller sees to",
    }
    return Proof(
        name=f"narrowing_{name}",
        says=f"{name} gives the exact result, limited and never wrapped, in every combination of widths in use",
        entity=f"used_{name}",
        harness=partial(harness, name),
        faults=(FAULTS[name],),
        method="pdr",
        assumed=assumed.get(name, "nothing"),
        search_depth=2,
        vhdl=partial(vhdl, name),
    )


def proofs() -> tuple[Proof, ...]:
    return tuple(proof(name) for name in REPORTS)
