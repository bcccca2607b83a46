# SPDX-License-Identifier: BSD-3-Clause
"""The contract of a block as a circuit: every input sequence that it allows, and a flag for what its bench notices.

The module `miter` holds the block twice, as it is (`gold`) and mutated (`gate`): graph.py gives their inputs `mutant`
the values.  Its other inputs are free; `rst` is
high in the first clock, samples keep their distance, inputs and registers are held as long as the contract says
(golden_model/block.py), numbers outside a port's range are replaced by the lowest.  What
fluxproof/cosim/schedule.py drives is one of these sequences.  `bad` is high where `due` there
compares and the two differ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from golden_model.block import Block, Port
from scripts.mutate.product import Product, bounded


def miter(block: Block, config: Mapping[str, int], assumed: str, products: Sequence[Product], width: int) -> str:
    """Verilog of `miter`; ``products``: the multipliers that were taken out of both; ``width``: of `mutant`.

    assumed: an expression in the block's inputs that holds for every sample; after a clock without it nothing counts.
    """
    ports, outputs = block.ports(config), block.out_ports(config)
    strobes = block.strobes and not block.clocked
    free = ["clk"] + ["any_rst"] * block.strobes + ["any_in_valid"] * strobes
    header = [f"input {name}" for name in free]
    header += [f"input [{width - 1}:0] mutant_{n}" for n in ("gold", "gate")]
    header += [f"input [{p.y - 1}:0] any_{k}_{n}" for k, p in enumerate(products) for n in ("gold", "gate")]
    header += [f"input signed [{p.fmt.width - 1}:0] any_{p.name}" for p in ports]
    driven = ["clk"] + ["rst"] * block.strobes + ["in_valid"] * strobes + [p.name for p in ports]
    shown = [(p.name, p.fmt.width) for p in outputs]
    shown += [("out_valid", 1)] * strobes + [("out_soon", 1)] * bool(block.soon)
    lines = [f"module miter({', '.join(header)}, output bad);", _environment(block, ports, strobes)]
    for suffix in ("gold", "gate"):
        lines += [f"  wire [{width - 1}:0] {name}_{suffix};" for name, width in shown]
        wiring = [f".{name}({name})" for name in driven] + [f".{n}({n}_{suffix})" for n, _ in shown]
        for k, p in enumerate(products):
            lines += [f"  wire [{p.a - 1}:0] a_{k}_{suffix}; wire [{p.b - 1}:0] b_{k}_{suffix};"]
            product, same = f"free_{k}_{suffix}", f"a_{k}_gold == a_{k}_gate && b_{k}_gold == b_{k}_gate"
            lines += bounded(p, product, f"any_{k}_{suffix}", f"a_{k}_{suffix}", f"b_{k}_{suffix}")
            if suffix == "gate":
                product = f"({same} ? y_{k}_gold : {product})"
            lines += [f"  wire [{p.y - 1}:0] y_{k}_{suffix} = {product};"]
            wiring += [f".product_{k}_{port.upper()}({port}_{k}_{suffix})" for port in "aby"]
        lines += [f"  both {suffix}(.mutant(mutant_{suffix}), {', '.join(wiring)});"]
    lines += ["  reg legal = 1;", f"  wire allowed = legal & ({assumed or 1});"]
    lines += ["  always @(posedge clk) legal <= allowed;"]
    lines += [f"  assign bad = allowed & begun & ({' | '.join(_differences(block, outputs, strobes))});", "endmodule"]
    return "\n".join([*lines[:1], *_still(block, outputs), *lines[1:]]) + "\n"


def _environment(block: Block, ports: tuple[Port, ...], strobes: bool) -> str:
    """Reset, strobe and inputs as the contract allows them."""
    wait = 1 if block.strobes else block.latency  # a cell shows what went in that many clocks ago
    lines = [f"  reg [7:0] clocks = 0; wire begun = clocks >= {wait};"]
    lines += ["  always @(posedge clk) clocks <= begun ? clocks : clocks + 1;"]
    lines += ["  wire rst = any_rst | !begun;" if block.strobes else "  wire rst = 0;"]
    if strobes:
        lines += [
            f"  reg [7:0] since = {block.interval}, age = 0;  // clocks since the last sample; of what is in flight",
            f"  wire in_valid = any_in_valid & (rst | since >= {block.interval});",
            f"  always @(posedge clk) since <= in_valid & !rst ? 1 : since + (since < {block.interval});",
            f"  always @(posedge clk) age <= rst ? 0 : in_valid ? 1 : age == 0 | age >= {block.latency} ? 0 : age + 1;",
            "  reg left = 0;  // the outputs of the last sample have to stay, nothing is in flight",
            f"  always @(posedge clk) left <= !rst & !in_valid & (left | age == {block.latency});",
        ]
    inputs = {p.name for p in block.inputs}
    for p in ports:
        sign = "s" if p.fmt.signed else ""
        free = f"any_{p.name}"
        number = f"$signed({free})" if p.fmt.signed else f"$unsigned({free})"
        if (p.low, p.high) != (p.fmt.lo, p.fmt.hi):
            low, high = (f"{'-' * (v < 0)}{p.fmt.width + 1}'sd{abs(v)}" for v in (p.low, p.high))
            wide = f"$signed({{{free}[{p.fmt.width - 1}], {free}}})" if sign else f"$signed({{1'b0, {free}}})"
            number = f"({wide} < {low} || {wide} > {high} ? {low} : {wide})"
        lines += [f"  reg [{p.fmt.width - 1}:0] held_{p.name}; wire [{p.fmt.width - 1}:0] {p.name};"]
        lines += [f"  always @(posedge clk) held_{p.name} <= {p.name};"]
        hold = "0"
        if strobes:
            hold = f"since > {p.late} & since < {block.interval}" if p.name in inputs else "age != 0"
        lines += [f"  assign {p.name} = ({hold}) & !rst ? held_{p.name} : {number};"]
    return "\n".join(lines)


def _differences(block: Block, outputs: tuple[Port, ...], strobes: bool) -> list[str]:
    """Expressions that are true where the bench notices a difference."""
    found = []
    for p in outputs:
        differs = f"{p.name}_gold != {p.name}_gate"
        if strobes:
            found.append(f"((out_valid_gold | left) & {differs})")
            if p.name in block.soon:
                found.append(f"(out_soon_gold & {differs})")
        elif p.name in block.shown_with:
            found.append(f"({block.shown_with[p.name]}_gold & {differs})")
        else:
            found.append(f"({differs})")
        if block.atomic:
            found.append(f"(watched & !out_valid_gold & was_{p.name} != {p.name}_gate)")
    found += [f"({name}_gold != {name}_gate)" for name in ("out_valid",) * strobes + ("out_soon",) * bool(block.soon)]
    return found


def _still(block: Block, outputs: tuple[Port, ...]) -> list[str]:
    """Registers that remember the mutant's outputs, where they must not move without out_valid."""
    if not block.atomic:
        return []
    lines = ["  reg watched = 0; always @(posedge clk) watched <= !rst;"]
    for p in outputs:
        lines += [f"  reg [{p.fmt.width - 1}:0] was_{p.name}; always @(posedge clk) was_{p.name} <= {p.name}_gate;"]
    return lines
