"""A Verilog wrapper that lets a design with thousands of port bits be placed and routed on a small package.

Inputs come from one long shift register, outputs are loaded into another and shifted out: three pins and a
clock.  The wrapper adds one flip-flop per port bit and, in front of each output's, one LUT (load or shift).
So a path from register to register of the design is what it would be without; a path from an input begins
at a register, as it would behind an AXI register file.
"""

from __future__ import annotations

import re
from itertools import pairwise

NAME = "shifted"
CLOCKS = ("clk", "aclk")
_PORT = re.compile(r"\b(input|output)\s+(?:\[(\d+):0\]\s*)?(\w+)")


def ports(verilog: str, module: str) -> list[tuple[str, str, int]]:
    """[(direction, name, width)] of ``module``."""
    header = re.search(rf"^module {module}\s*\((.*?)\);", verilog, re.MULTILINE | re.DOTALL)
    if header is None:
        raise ValueError(f"no module {module} in the converted Verilog")
    return [(way, name, int(msb or 0) + 1) for way, msb, name in _PORT.findall(header.group(1))]


def chains(verilog: str, module: str) -> dict[str, list[tuple[str, int]]]:
    """{"given": the inputs, "made": the outputs}: (name, lowest bit in its shift register), without the clock.

    The last of each has no name and the length of the chain.
    """
    places: dict[str, list[tuple[str, int]]] = {"given": [], "made": []}
    widths = dict.fromkeys(places, 0)
    for way, name, width in ports(verilog, module):
        chain = "given" if way == "input" else "made"
        if name not in CLOCKS:
            places[chain].append((name, widths[chain]))
            widths[chain] += width
    return {chain: [*members, ("", widths[chain])] for chain, members in places.items()}


def wrap(verilog: str, module: str) -> str:
    """The Verilog of module ``shifted``, which contains ``module`` as instance ``dut``."""
    places = [f".{name}(clk)" for _, name, _ in ports(verilog, module) if name in CLOCKS]
    widths = {}
    for chain, members in chains(verilog, module).items():
        for (name, low), (_, above) in pairwise(members):
            places.append(f".{name}({chain}[{above - 1}:{low}])")
        widths[chain] = members[-1][1]
    given, made = widths["given"], widths["made"]
    return f"""module {NAME} (input clk, input shift_in, input load, output shift_out);
  (* keep *) reg [{given - 1}:0] given;
  wire [{made - 1}:0] made;
  (* keep *) reg [{made - 1}:0] taken;
  {module} dut ({", ".join(places)});
  always @(posedge clk) begin
    given <= {{given, shift_in}};
    taken <= load ? made : {{taken, 1'b0}};
  end
  assign shift_out = taken[{made - 1}];
endmodule
"""
