"""A second clock for the part of the core that rests between two samples, so that Verilator need not compute it then.

Of a PWM period of 20,000 clocks the blocks that work on the sample change for some 150.  Their registers cannot change
at a clock that finds them and all their inputs as the clock before, which changed nothing, found them.  ``split`` gives
these blocks a clock of their own, RESTING, which verilated.cpp leaves out exactly then: no value at any clock differs.
"""

from __future__ import annotations

import re
from typing import NamedTuple

RESTING, WATCHED = "resting_clk", "resting_inputs"
COUNTING = ("guard", "fault_memory", "gates")  # instances that may change at any clock

_MODULE = re.compile(r"^module (\w+)\s*\((.*?)\);(.*?)^endmodule", re.MULTILINE | re.DOTALL)
_PORT = re.compile(r"\b(input|output)\s+(?:\[(\d+):0\]\s*)?(\w+)")
_INSTANCE = re.compile(r"^  (\w+) (\w+) \(\n(.*?)\);", re.MULTILINE | re.DOTALL)
_CONNECTION = re.compile(r"\.(\w+)\((.*?)\)(?:,\n|$)", re.DOTALL)
_ASSIGN = re.compile(r"^  assign (\w+) = (.*?);", re.MULTILINE | re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w*")
_VARIABLE = re.compile(
    r"^\s+(?:VL_(?:IN|OUT)\w*\((\w+),|[CSIQ]Data/\*[\d:]+\*/ (\w+);|Vl(?:Unpacked|Wide)<.*> (?:/\*.*\*/ )?(\w+);)",
    re.MULTILINE,
)
_EVENTS = ("__Vstl", "__Vico", "__Vact", "__Vnba", "__Vtrig")


class Instance(NamedTuple):
    """An instance in the top: what its ports are connected to, and the text of all this."""

    name: str
    inputs: dict[str, str]
    outputs: dict[str, str]
    text: str


def split(verilog: str, top: str) -> str | None:
    """The Verilog with the second clock; None where ``top`` is not made as this needs it.

    The top gets two ports: the input RESTING, the clock of all instances but COUNTING's, and the output WATCHED, what
    of COUNTING's outputs the others see.
    """
    modules = {name: (ports, body) for name, ports, body in _MODULE.findall(verilog)}
    if top not in modules:
        return None
    header, body = modules[top]
    if any(match.group(1) not in modules for match in _INSTANCE.finditer(body)):
        return None
    found = [_instance(modules, *match.groups(), match.group(0)) for match in _INSTANCE.finditer(body)]
    counting = [i for i in found if i.name in COUNTING]
    if {i.name for i in counting} != set(COUNTING) or re.search(r"^\s*always", body, re.MULTILINE):
        return None
    resting = [i for i in found if i.name not in COUNTING and i.inputs.get("clk") == "clk"]
    assigned = dict(_ASSIGN.findall(body))
    made = {net for i in counting for net in i.outputs.values()}
    seen = _sources({net for i in resting for net in i.inputs.values()}, assigned)
    watched = sorted(made & seen)
    if not watched:
        return None
    new = body
    for i in resting:
        new = new.replace(i.text, i.text.replace(".clk(clk)", f".clk({RESTING})"))
    new += f"  assign {WATCHED} = {{{', '.join(watched)}}};\n"
    width = sum(_width(body, net) for net in watched)
    ports = f"{header},\n   input  {RESTING},\n   output [{width - 1}:0] {WATCHED}"
    return verilog.replace(header, ports, 1).replace(body, new) if verilog.count(header) == 1 else None


def _instance(modules: dict, module: str, name: str, connections: str, text: str) -> Instance:
    directions = {port: direction for direction, _, port in _PORT.findall(modules[module][0])}
    ends: dict[str, dict[str, str]] = {"input": {}, "output": {}}
    for port, net in _CONNECTION.findall(connections):
        ends[directions[port]][port] = net.strip()
    return Instance(name, ends["input"], ends["output"], text)


def _sources(nets: set[str], assigned: dict[str, str]) -> set[str]:
    """All nets that these depend on through assignments, themselves included."""
    seen, todo = set(), [name for net in nets for name in _NAME.findall(net)]
    while todo:
        net = todo.pop()
        if net not in seen:
            seen.add(net)
            todo += _NAME.findall(assigned.get(net, ""))
    return seen


def _width(body: str, net: str) -> int:
    found = re.search(rf"^  wire (?:\[(\d+):0\] )?{net};", body, re.MULTILINE)
    return int(found.group(1) or 0) + 1


def state(root: str, verilog: str, top: str) -> list[str]:
    """The variables of Verilator's class ``root`` that tell whether the resting part has changed at a clock.

    Left out is what is known to belong to the counting part and to Verilator's own events; all else counts, so that a
    variable of unknown purpose costs time only.
    """
    body = {name: body for name, _, body in _MODULE.findall(verilog)}[top]
    assigned = dict(_ASSIGN.findall(body))
    own = tuple(f"{top}__DOT__{instance}__DOT__" for instance in COUNTING)
    shown = {
        port for port in assigned if any(n.startswith(f"{i}_") for n in _sources({port}, assigned) for i in COUNTING)
    }
    names = ["".join(found) for found in _VARIABLE.findall(root)]
    return [name for name in names if not name.startswith((*own, *_EVENTS)) and name not in {"clk", RESTING, *shown}]
