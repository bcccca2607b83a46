# SPDX-License-Identifier: BSD-3-Clause
"""The cells of the arithmetic compute their equation three clocks later: every operand of small width."""

from __future__ import annotations

from fluxproof.checkout import ROOT
from scripts.prove.proof import Fault, Proof, committed

WIDTHS = {"A_W": 4, "B_W": 4, "C_W": 5, "Y_W": 4, "DROP": 2}  # all cases occur: ties, both ends, both signs


def cell(name: str, says: str, entity: str, generics: dict[str, int], *faults: Fault) -> Proof:
    """A proof of tb/``entity``_tb.vhd, which gives the cell ports of given widths."""
    return Proof(
        name=f"cell_{name}",
        says=says,
        entity=f"{entity}_tb",
        vhdl=lambda: (ROOT / "tb" / f"{entity}_tb.vhd").read_text(),
        harness=committed(f"{entity}.sv"),
        faults=faults,
        generics=generics,
        depth=5,
        search_depth=8,
        assumed="widths of 4 and 5 bits",
    )


CELL, SUM, POINT = "common/multiply_add.vhd", "common/sum_of_products.vhd", "common/interpolation.vhd"
PROOFS = (
    cell(
        "multiply_add",
        "multiply_add gives c + a*b / 2**DROP, rounded half up and saturated, and tells when it saturates",
        "multiply_add",
        {**WIDTHS, "MINUS": 0},
        Fault("product floored", CELL, "      result(DROP - 1) := '1';\n", "      result(DROP - 1) := '0';\n"),
        Fault("sum wraps", CELL, "saturate(cut_3, y'length)", "resize(cut_3, y'length)"),
        Fault("saturation not told", CELL, "exceeds(cut_3, y'length)", "'0'"),
    ),
    cell(
        "multiply_subtract",
        "with MINUS = 1 it gives c - a*b / 2**DROP, the quotient rounded half up",
        "multiply_add",
        {**WIDTHS, "MINUS": 1},
        Fault("complement not undone", CELL, "sum_3(SUM_W - 1 downto DROP) xor FLIP", "sum_3(SUM_W - 1 downto DROP)"),
    ),
    cell(
        "sum_of_products",
        "sum_of_products gives (c*d + a*b) / 2**DROP, with minus (c*d - a*b) / 2**DROP, rounded half up and saturated",
        "sum_of_products",
        {**WIDTHS, "C_W": 4, "D_W": 4, "Y_W": 5},
        Fault("b not added where a is complemented", SUM, "resize(b_1, REST_W) + half", "half"),
        Fault(
            "sum wraps",
            SUM,
            "saturate(sum_3(SUM_W - 1 downto DROP), y'length)",
            "resize(sum_3(SUM_W - 1 downto DROP), y'length)",
        ),
    ),
    cell(
        "interpolation",
        "interpolation gives a + fraction*(b - a), floored, which never lies beyond a or b: it does not wrap",
        "interpolation",
        {"WIDTH": 5, "BITS": 4},
        Fault("difference wraps", POINT, "resize(b, WIDTH + 1) - a;", "resize(b - a, WIDTH + 1);"),
        Fault(
            "fraction taken as negative", POINT, "signed('0' & fraction_1)", "signed(fraction_1(BITS - 1) & fraction_1)"
        ),
    ),
)
