# SPDX-License-Identifier: BSD-3-Clause
"""Writes generated/fluxproof_axi.vhd: core, registers, telemetry and power-stage pins, wired by name.

Ports of the same name are connected; RENAMED lists the exceptions.  A port without a driver is an error.  A register
or status value added to the core needs no edit here.  A ``Top`` holds what is particular; board_top.py has that
of a board, hil_top.py that of a motor in the FPGA.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

from fluxproof.checkout import RTL
from fluxproof.cosim.entity import Entity, Pin, read_entity
from fluxproof.cosim.sources import rtl_sources
from golden_model.records import ENTERS_AS, generic_of

TOP = "fluxproof_axi"
PATH = RTL / "generated" / f"{TOP}.vhd"

# label of the instance -> the entity's file below rtl/
INSTANCES = {
    "registers": "generated/register_file.vhd",
    "core": "fluxproof.vhd",
    "stream": "io/telemetry.vhd",
    "ring": "io/telemetry_ring.vhd",
    "cause": "io/interrupts.vhd",
    "stage": "io/power_stage.vhd",
}
# (label, port) -> net, if the port's own name has another meaning in the top
RENAMED = {
    ("core", "gate_high"): "gate_high_next",
    ("core", "gate_low"): "gate_low_next",
    ("core", "sample_trigger"): "trigger_next",
    ("core", "trip"): "trip_now",
    ("core", "brake"): "brake_next",
    ("stage", "trip"): "trip_now",
    ("stream", "enable"): "telemetry_enable",
    ("stream", "dropped"): "telemetry_dropped",
}
# generics of the top: name -> (type, default, comment)
GENERICS = {
    "CLOCK_HZ": ("integer range 1 to 500000000", 200000000, "rate of aclk; software reads it back"),
    "ADC_BITS": ("integer range 12 to 16", 16, "width of the ADC codes"),
    "POSITION_BITS": ("integer range 8 to 18", 16, "width of the position code"),
    "CARRIER_HALF": ("integer range 8 to 32767", 10000, "half a PWM period in clocks"),
    "ESTIMATORS": ("integer range 0 to 1", 1, "0 leaves the estimators out"),
    "REFERENCES": ("integer range 0 to 1", 0, "1 builds the torque table"),
    "POSITION_LOOP": ("integer range 0 to 1", 0, "1 builds the position loop and its trajectory"),
    "RESIDUAL": ("integer range 0 to 1", 0, "1 compares the motor with its description"),
    "MODES": ("integer range 0 to 1", 0, "1 builds voltage mode and changes of mode without a step"),
    "OVERMODULATION": ("integer range 0 to 1", 0, "1 lets the fundamental of the voltage go up to six-step"),
    "GEARING": ("integer range 0 to 1", 0, "1 builds the gear to a second encoder, with the position loop"),
    "RING_ROWS": ("integer range 0 to 2730", 0, "telemetry rows of the ring, 42 in a block RAM; 0 leaves it out"),
    "GATE_ACTIVE": ("integer range 0 to 1", 1, "level of gate_high and gate_low at which a switch is on"),
    "TRIP_ACTIVE": ("integer range 0 to 1", 1, "level of trip that turns the gates off"),
    "BRAKE_ACTIVE": ("integer range 0 to 1", 1, "level of brake at which the resistor is on"),
    "TRIP_FILTER": ("integer range 0 to 1023", 0, "longest pulse of trip without effect, clocks; 0: every pulse acts"),
}
# The telemetry's queue, of which 512 words are one block RAM; its counters and the ring's rows, which only a bench
# makes smaller
LEFT_AT_DEFAULT = {"DEPTH_BITS", "NUMBER_W", "DROPPED_W", "ROW_WORDS"}
LITE, CODE, POSITION = "31 downto 0", "ADC_BITS - 1 downto 0", "POSITION_BITS - 1 downto 0"
# pins of the top: name, mode, range of its bits (None: one), comment
PINS = (
    ("aclk", "in", None, "the one clock"),
    ("aresetn", "in", None, "synchronous to aclk, active low as AXI has it"),
    ("s_axi_awaddr", "in", "11 downto 0", "AXI4-Lite: registers"),
    ("s_axi_awprot", "in", "2 downto 0", "ignored"),
    ("s_axi_awvalid", "in", None, ""),
    ("s_axi_awready", "out", None, ""),
    ("s_axi_wdata", "in", LITE, ""),
    ("s_axi_wstrb", "in", "3 downto 0", ""),
    ("s_axi_wvalid", "in", None, ""),
    ("s_axi_wready", "out", None, ""),
    ("s_axi_bresp", "out", "1 downto 0", ""),
    ("s_axi_bvalid", "out", None, ""),
    ("s_axi_bready", "in", None, ""),
    ("s_axi_araddr", "in", "11 downto 0", ""),
    ("s_axi_arprot", "in", "2 downto 0", "ignored"),
    ("s_axi_arvalid", "in", None, ""),
    ("s_axi_arready", "out", None, ""),
    ("s_axi_rdata", "out", LITE, ""),
    ("s_axi_rresp", "out", "1 downto 0", ""),
    ("s_axi_rvalid", "out", None, ""),
    ("s_axi_rready", "in", None, ""),
    ("m_axis_tdata", "out", LITE, "AXI4-Stream: telemetry, a packet a sample"),
    ("m_axis_tvalid", "out", None, ""),
    ("m_axis_tready", "in", None, ""),
    ("m_axis_tlast", "out", None, ""),
    ("sample_trigger", "out", None, "middle of the zero vector: start the converters"),
    ("sample_valid", "in", None, "one clock: the codes below are there"),
    ("adc_a", "in", CODE, "ADC code, phase a"),
    ("adc_b", "in", CODE, "ADC code, phase b"),
    ("adc_c", "in", CODE, "ADC code, phase c"),
    ("adc_u_dc", "in", CODE, "ADC code, bus voltage"),
    ("position_code", "in", POSITION, "position code, one mechanical turn"),
    ("trip", "in", None, "asynchronous, TRIP_ACTIVE: gates off without a clock (see TRIP_FILTER), remembered"),
    ("gate_high", "out", "2 downto 0", "upper gates, bit 0 is leg a"),
    ("gate_low", "out", "2 downto 0", "lower gates, bit 0 is leg a"),
    ("brake", "out", None, "brake resistor on"),
    ("irq", "out", None, "level: a cause that irq_mask does not mask, see interrupts"),
)
SAMPLE = "sample"  # the record of this name is put together here: codes from pins, references from registers
NETS_OF_PINS = {"trip": "trip_pin", "aclk": "clk"}  # pin -> net, if the names differ

LINES = ("", "  motor_differs <= estimated.motor_differs;")
LINES_READ, LINES_DRIVE = frozenset({"estimated"}), {"motor_differs": "std_logic"}

HEADER = """\
-- SPDX-License-Identifier: BSD-3-Clause
-- Generated by `make generate` from the entities below; do not edit, a test compares it.
--
-- Purpose: Fluxproof for a block design: registers over AXI4-Lite, telemetry over AXI4-Stream, pins for the
-- converters and the power stage.  This top only instantiates.
-- Clock: everything works on aclk.  All inputs but trip must be synchronous to it: bring converter and encoder
-- signals through registers of aclk, sample_valid one clock long when the codes are stable.  trip is the one
-- asynchronous input; io/power_stage takes it in.
-- Reset: aresetn, synchronous to aclk, for at least 4 clocks; inside, two clocks later, it is rst, active high, out of
-- a flip-flop that tools can copy; the one before it is near the pin.  While it lasts all gates are off; afterwards
-- enable, every register and the memory of trips are at their reset values (all off).
-- Formats: codes as the converters give them; registers as `fluxproof registers drive.toml` prints them.
-- Latency: sample_valid to duties FLUXPROOF_SAMPLE_TO_DUTY clocks; trip to gates off 0 clocks, with a
-- TRIP_FILTER that many and 3.
-- The file keeps to VHDL-93 so that a block design can also take it as a module."""


@dataclass(frozen=True)
class Top:
    """A top that is written here; ``lines`` are statements of its own, which read and drive further nets."""

    name: str
    header: str
    instances: dict[str, str]
    renamed: dict[tuple[str, str], str]
    generics: dict[str, tuple[str, int, str]]
    pins: tuple[tuple[str, str, str | None, str], ...]
    lines: tuple[str, ...] = ()
    lines_read: frozenset[str] = frozenset()
    lines_drive: dict[str, str] = dataclasses.field(default_factory=dict)  # net -> its type

    @property
    def path(self) -> Path:
        return RTL / "generated" / f"{self.name}.vhd"


AXI = Top(TOP, HEADER, INSTANCES, RENAMED, GENERICS, PINS, LINES, LINES_READ, LINES_DRIVE)
BOARD_NAME, HIL_NAME = "fluxproof_board", "fluxproof_hil"  # the other tops, see board_top.py and hil_top.py


def instances(rtl: Path = RTL, top: Top = AXI) -> dict[str, Entity]:
    """The entities of a top, read from ``rtl``."""
    return {label: read_entity(rtl / name) for label, name in top.instances.items()}


def source_names(rtl: Path = RTL) -> list[str]:
    """The VHDL files in compile order with the tops at the end, relative to the repository's root."""
    names = (HIL_NAME, BOARD_NAME, TOP)
    others = rtl_sources(rtl, without=[f"{name}.vhd" for name in names])
    tops = (rtl / "generated" / f"{name}.vhd" for name in names)
    return [path.relative_to(rtl.parent).as_posix() for path in (*others, *tops)]


def net_of(top: Top, label: str, port: str) -> str:
    """The net that a port of an instance belongs to; ``record.field`` is a field of a net."""
    return top.renamed.get((label, port), port)


def wire(entities: dict[str, Entity], top: Top = AXI) -> dict[str, Pin]:
    """{net: the instance's port that drives it}; ValueError for a port without driver, or with two."""
    pins = {NETS_OF_PINS.get(name, name): mode for name, mode, _, _ in top.pins}
    given = {net for net, mode in pins.items() if mode == "in"} | {"rst", "rst_1", SAMPLE, *top.lines_drive}
    driven: dict[str, Pin] = {}
    for label, entity in entities.items():
        for pin in entity.outputs.values():
            net = net_of(top, label, pin.name)
            if net in driven or net in given:
                raise ValueError(f"{top.name}: {label}.{pin.name} drives {net}, which has a driver already")
            driven[net] = pin
    for label, entity in entities.items():
        missing = [n for n in entity.inputs if net_of(top, label, n).split(".")[0] not in given | set(driven)]
        if missing:
            raise ValueError(f"{top.name}: nothing drives {', '.join(missing)} of {label} ({entity.name})")
        unknown = set(entity.generics) - set(top.generics) - LEFT_AT_DEFAULT
        if unknown:
            raise ValueError(f"{top.name}: no value for generic {', '.join(sorted(unknown))} of {entity.name}")
    if missing := [name for name in ENTERS_AS.values() if name not in given | set(driven)]:
        raise ValueError(f"{top.name}: nothing drives {', '.join(missing)} of {SAMPLE}")
    undriven = [net for net, mode in pins.items() if mode == "out" and net not in driven]
    if undriven:
        raise ValueError(f"{top.name}: nothing drives {', '.join(undriven)}")
    return driven


def render(rtl: Path = RTL, top: Top = AXI) -> str:
    """The whole file."""
    entities = instances(rtl, top)
    driven = wire(entities, top)
    read = {net_of(top, label, n) for label, e in entities.items() for n in e.inputs} | set(ENTERS_AS.values())
    read |= top.lines_read
    out_pins = {NETS_OF_PINS.get(name, name): name for name, mode, _, _ in top.pins if mode == "out"}
    # An output pin is connected directly to its driver if nothing else reads it and the types agree.
    direct = {n for n in out_pins if n not in read and driven[n].kind in ("std_logic", "std_logic_vector")}
    signals = {n: pin for n, pin in driven.items() if n in read | set(out_pins) and n not in direct}
    names = {net: f"{net}_out" if net in out_pins.values() else net for net in signals}
    actuals = {net: out_pins[net] for net in direct} | names

    lines = [top.header, "", "library ieee;", "use ieee.std_logic_1164.all;", "use ieee.numeric_std.all;"]
    lines += ["use work.fluxproof_pkg.all;", "", *_entity(top), "", f"architecture rtl of {top.name} is"]
    width = max(map(len, names.values()))
    lines += [f"  signal {name:{width}} : std_logic;" for name in ("rst_1", "rst")]
    lines += [f"  signal {names[net]:{width}} : {pin.vhdl_type};" for net, pin in signals.items()]
    lines += [f"  signal {SAMPLE:{width}} : {SAMPLE}_t;"]
    lines += [f"  signal {net:{width}} : {kind};" for net, kind in top.lines_drive.items()]
    lines += ["begin", "", "  process (aclk)", "  begin", "    if rising_edge(aclk) then"]
    lines += ["      rst_1 <= not aresetn;", "      rst   <= rst_1;", "    end if;", "  end process;"]
    lines += ["", *_sample(names), *top.lines]
    for label, entity in entities.items():
        lines += ["", *_instance(top, label, entity, {**actuals, SAMPLE: SAMPLE})]
    lines.append("")
    copied = {net: pin for net, pin in out_pins.items() if net in signals}
    width = max(map(len, copied.values()))
    for net, pin in copied.items():
        source = names[net] if driven[net].left is None else f"std_logic_vector({names[net]})"
        lines.append(f"  {pin:{width}} <= {source};")
    return "\n".join([*lines, "", "end architecture rtl;"]) + "\n"


def _entity(top: Top) -> list[str]:
    """The entity's declaration: generics and pins with their comments."""
    lines = [f"entity {top.name} is", "  generic ("]
    wide, typed = max(map(len, top.generics)), max(len(kind) for kind, _, _ in top.generics.values())
    last = list(top.generics)[-1]
    for name, (kind, default, doc) in top.generics.items():
        lines.append(f"    {name:{wide}} : {kind:{typed}} := {default}{';' if name != last else ''}  -- {doc}")
    lines += ["  );", "  port ("]
    wide = max(len(name) for name, *_ in top.pins)
    for k, (name, mode, bits, doc) in enumerate(top.pins):
        kind = "std_logic" if bits is None else f"std_logic_vector({bits})"
        end = ";" if k + 1 < len(top.pins) else ""
        lines.append(f"    {name:{wide}} : {mode:3} {kind}{end}" + (f"  -- {doc}" if doc else ""))
    return [*lines, "  );", f"end entity {top.name};"]


def _sample(names: dict[str, str]) -> list[str]:
    """The fields of the sample: a code from its pin, right-aligned; a reference from its register."""
    wide = max(map(len, ENTERS_AS))
    lines = []
    for field, name in ENTERS_AS.items():
        target = f"{SAMPLE}.{field}"
        value = f"resize(unsigned({name}), {target}'length)" if generic_of(name) else names[name]
        lines.append(f"  {SAMPLE}.{field:{wide}} <= {value};")
    return lines


def _instance(top: Top, label: str, entity: Entity, actuals: dict[str, str]) -> list[str]:
    """One instantiation; unused outputs stay open."""
    lines = [f"  {label} : entity work.{entity.name}"]
    given = [name for name in entity.generics if name in top.generics]
    if given:
        wide = max(map(len, given))
        maps = [f"      {name:{wide}} => {name}" for name in given]
        lines += ["    generic map (", *",\n".join(maps).split("\n"), "    )"]
    wide = max(map(len, entity.pins))
    maps = [f"      {name:{wide}} => {_actual(top, label, pin, actuals)}" for name, pin in entity.pins.items()]
    return [*lines, "    port map (", *",\n".join(maps).split("\n"), "    );"]


def _actual(top: Top, label: str, pin: Pin, actuals: dict[str, str]) -> str:
    """What a port is connected to: a signal, a pin (converted where the types differ), or open."""
    net = net_of(top, label, pin.name)
    if net in actuals or "." in net or net in top.lines_drive:
        return actuals.get(net, net)
    if not pin.is_input:
        return "open"
    name = next((n for n, _, _, _ in top.pins if NETS_OF_PINS.get(n, n) == net), net)
    return f"{pin.kind}({name})" if pin.kind in ("unsigned", "signed") else name
