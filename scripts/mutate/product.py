# SPDX-License-Identifier: BSD-3-Clause
"""A multiplier taken out of a netlist: any number of the right sign that is no larger than its operands allow."""

from __future__ import annotations

from typing import NamedTuple


class Product(NamedTuple):
    """Widths of the operands and of the product; whether they are signed."""

    a: int
    b: int
    y: int
    signed: bool

    @property
    def whole(self) -> bool:
        """Whether every product fits its width."""
        return self.y >= self.a + self.b


def bounded(product: Product, name: str, free: str, a: str, b: str) -> list[str]:
    """Verilog of the wire ``name``: ``free`` where it can be the product of a and b, else 0.

    Not larger than either operand times the largest of the other, with the sign of the product.  A product that is cut
    off may be any number.
    """
    y = product.y
    if not product.whole:
        return [f"  wire [{y - 1}:0] {name} = {free};"]
    lines, sizes, signs = [], {}, {}
    wide = y + 2
    for part, of, width in (("a", a, product.a), ("b", b, product.b), ("y", free, y)):
        signs[part] = f"{of}[{width - 1}]" if product.signed else "1'b0"
        sizes[part] = f"{name}_{part}"
        extended = f"{{{{{wide - width}{{{signs[part]}}}}}, {of}}}"
        lines.append(f"  wire [{wide - 1}:0] {sizes[part]} = {signs[part]} ? -{extended} : {extended};")
    of_a, of_b = product.a - product.signed, product.b - product.signed
    fits = f"{sizes['y']} <= ({sizes['a']} << {of_b}) && {sizes['y']} <= ({sizes['b']} << {of_a})"
    fits += f" && ({signs['y']} == ({signs['a']} ^ {signs['b']}))"
    return [*lines, f"  wire [{y - 1}:0] {name} = {fits} ? {free} : {y}'b0;"]
