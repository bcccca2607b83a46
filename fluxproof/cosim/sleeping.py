# SPDX-License-Identifier: BSD-3-Clause
"""The converted Verilog with a clock of its own for what works on samples: it stands while no sample is in flight.

Of the core only ``EVERY_CLOCK`` (gates, bootstrap charge, fault latch, the two watchdogs) moves between samples, as in
golden_model/clocked.py.  All else is pipelines with strobes: once the last strobe is through and no input changes, a
clock leaves every register as it is, and Verilator computes it all the same.  ``with_sleep`` gives these blocks a clock
that runs from a reset, a sample, a write of the host and what gates hand to a sample until STAYS clocks after its end,
and where the input ``core_wakes`` of the top is 1: the wrapper sets it with every input that it sets.

``with_witness`` lets every clock run and raises ``core_missed`` of the top where a register changes that would sleep.
"""

from __future__ import annotations

import re

CORE = re.compile(r"fluxproof(_\d\w*)?")  # the entity fluxproof, whose generics GHDL appends
PROTECTION, EVERY_CLOCK = "safety", ("charge", "gates", "guard", "host", "fault_memory")  # instances
WAKE, MISSED, ASLEEP = "core_wakes", "core_missed", "clk_of_samples"
STAYS = 64  # clocks; the registers in a row behind the last strobe are fewer, as the witness shows
_MODULE = re.compile(r"^module (\w+)\n.*?^endmodule", re.MULTILINE | re.DOTALL)
_INSTANCE = re.compile(r"^  (\w+) (\w+) \(\n    \.(a?clk)\((\w+)\),", re.MULTILINE)
_REGISTER = re.compile(r"^  always @\(posedge clk\)\n(?:    if \((.+)\)\n  )?    (\S+) <= (.+);", re.MULTILINE)
_AWAKE = f"""
  reg [6:0] stays = 0;
  reg awake = 1;
  wire [13:0] of_gates = {{running, min_pulse_used, double_used}};
  reg [13:0] seen_of_gates = 0;
  wire wakes = rst | sample_valid | sample_busy | host_write | of_gates != seen_of_gates;
  wire runs = awake | {WAKE};
  always @(posedge clk)
    stays <= wakes | {WAKE} ? {STAYS} : stays - (stays != 0);
  always @(posedge clk)
    seen_of_gates <= of_gates;
  always @(negedge clk)
    awake <= wakes | stays != 0;
"""


def with_sleep(verilog: str) -> str:
    """``verilog`` with a sleeping core; ValueError where it has none."""
    modules = _modules(verilog)
    core, protection = _core(modules)
    for name in (core, protection):
        modules[name] = _INSTANCE.sub(_asleep, modules[name])
    modules[core] = _before_end(modules[core], _AWAKE + f"  wire {ASLEEP} = clk & runs;\n")
    modules[protection] = _port(modules[protection], "input", ASLEEP)
    _through(modules, core, "input", WAKE)
    return "\n".join(modules.values()) + "\n"


def _asleep(instance: re.Match) -> str:
    """The head of an instance with the clock that it works on."""
    if instance[2] == PROTECTION:
        return f"{instance[0]}\n    .{ASLEEP}({ASLEEP}),"
    return instance[0] if instance[2] in EVERY_CLOCK else instance[0].replace("(clk)", f"({ASLEEP})")


def with_witness(verilog: str) -> str:
    """``verilog`` with ``core_missed``; ValueError where it has no core."""
    modules = _modules(verilog)
    core, protection = _core(modules)
    sleeping = {i[1] for name in (core, protection) for i in _sleepers(modules[name])}
    while more := {i[1] for name in sleeping for i in _INSTANCE.finditer(modules[name])} - sleeping:
        sleeping |= more
    sleeping -= {protection}
    for name in {*sleeping, core, protection}:
        text = modules[name]
        changes = [f"missed_{i[2]}" for i in _sleepers(text)]
        if name in sleeping:
            changes += [f"({when or 1} & {q} != {d})" for when, q, d in _REGISTER.findall(text)]
        any_change = " | ".join(changes) or "0"
        if name == core:
            shown = f"{_AWAKE}  reg missed = 0;\n  always @(posedge clk)\n    missed <= ~runs & ({any_change});\n"
            text, any_change = _before_end(text, shown), "missed"
        else:
            text = _port(text, "output", MISSED)
        modules[name] = _before_end(_watched(text), f"  assign {MISSED} = {any_change};\n")
    _through(modules, core, "input", WAKE)
    _through(modules, core, "output", MISSED)
    return "\n".join(modules.values()) + "\n"


def _sleepers(text: str) -> list[re.Match]:
    """The heads of the instances that sleep, or have such."""
    return [i for i in _INSTANCE.finditer(text) if i[2] not in EVERY_CLOCK]


def _modules(verilog: str) -> dict[str, str]:
    return {found[1]: found[0] for found in _MODULE.finditer(verilog)}


def _core(modules: dict[str, str]) -> tuple[str, str]:
    """The modules of the core and of its protection."""
    found = [name for name in modules if CORE.fullmatch(name)]
    if len(found) != 1:
        raise ValueError(f"the converted Verilog has {len(found)} modules fluxproof, wanted is 1")
    return found[0], next(i[1] for i in _INSTANCE.finditer(modules[found[0]]) if i[2] == PROTECTION)


def _before_end(text: str, more: str) -> str:
    return text.removesuffix("endmodule") + more + "endmodule"


def _port(text: str, direction: str, name: str) -> str:
    return text.replace("\n  (", f"\n  ({direction} {name},\n   ", 1)


def _watched(text: str) -> str:
    """``text`` with a wire for core_missed of each instance that sleeps."""
    names = [i[2] for i in _sleepers(text)]
    text = _INSTANCE.sub(lambda i: f"{i[0]}\n    .{MISSED}(missed_{i[2]})," if i[2] in names else i[0], text)
    return text.replace(");\n", ");\n" + "".join(f"  wire missed_{name};\n" for name in names), 1)


def _through(modules: dict[str, str], name: str, direction: str, port: str) -> None:
    """A port of module ``name`` and of all that it stands in, up to the top."""
    modules[name] = _port(modules[name], direction, port)
    for above, text in modules.items():
        inside = [i for i in _INSTANCE.finditer(text) if i[1] == name]
        if inside:
            modules[above] = text.replace(inside[0][0], f"{inside[0][0]}\n    .{port}({port}),", 1)
            _through(modules, above, direction, port)
            return
