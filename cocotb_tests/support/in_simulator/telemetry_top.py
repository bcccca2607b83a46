# SPDX-License-Identifier: BSD-3-Clause
"""A top for the tests: core and telemetry, generated from the ports of the two entities."""

from __future__ import annotations

from pathlib import Path

from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.entity import read_entity
from fluxproof.files import write_text

NAME = "core_with_telemetry"
GENERICS = {
    "ADC_BITS": 16,
    "POSITION_BITS": 16,
    "CARRIER_HALF": 10000,
    "ESTIMATORS": 1,
    "REFERENCES": 0,
    "POSITION_LOOP": 0,
    "RESIDUAL": 0,
    "MODES": 0,
    "OVERMODULATION": 0,
    "GEARING": 0,
    "DEPTH_BITS": 9,
}


def write_top(rtl: Path = RTL) -> Path:
    """Write the top; every input of the telemetry is the core's port of that name."""
    core, telemetry = (read_entity(rtl / name).pins for name in ("fluxproof.vhd", "io/telemetry.vhd"))
    own = {name: pin for name, pin in telemetry.items() if name not in core or name == "enable"}
    joined = {name: f"telemetry_{name}" if name == "enable" else name for name in telemetry}
    ports = [(name, pin) for name, pin in core.items()] + [(joined[name], pin) for name, pin in own.items()]
    listed = ";\n".join(f"    {name} : {pin.mode} {pin.vhdl_type}" for name, pin in ports)
    generics = ";\n".join(f"    {name} : natural := {value}" for name, value in GENERICS.items())
    text = f"""\
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity {NAME} is
  generic (
{generics}
  );
  port (
{listed}
  );
end entity {NAME};

architecture test of {NAME} is
begin
  core : entity work.fluxproof
    generic map (ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS, CARRIER_HALF => CARRIER_HALF,
                 ESTIMATORS => ESTIMATORS, REFERENCES => REFERENCES, POSITION_LOOP => POSITION_LOOP,
                 RESIDUAL => RESIDUAL, MODES => MODES,
                 OVERMODULATION => OVERMODULATION, GEARING => GEARING)
    port map ({", ".join(f"{name} => {name}" for name in core)});
  stream : entity work.telemetry
    generic map (ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS, DEPTH_BITS => DEPTH_BITS)
    port map ({", ".join(f"{name} => {signal}" for name, signal in joined.items())});
end architecture test;
"""
    return write_text(ROOT / "build" / "tb" / f"{NAME}.vhd", text)
