"""A top for the tests: core and telemetry, generated from the ports of the two entities."""

from __future__ import annotations

import re
from pathlib import Path

from fluxproof.checkout import ROOT, RTL
from fluxproof.files import write_text

NAME = "core_with_telemetry"
GENERICS = ("ADC_BITS", "POSITION_BITS", "CARRIER_HALF", "DEPTH_BITS")
_PORT = re.compile(r"^    (\w+)\s*:\s*(in|out)\s+(.+?);?\s*(?:--.*)?$", re.MULTILINE)


def ports(entity: Path) -> dict[str, tuple[str, str]]:
    """{port: (direction, type)} of the entity in a file."""
    text = entity.read_text().split("port (", 1)[1].split("end entity", 1)[0]
    return {name: (way, kind) for name, way, kind in _PORT.findall(text)}


def write_top(rtl: Path = RTL) -> Path:
    """Write the top; every input of the telemetry is the core's port of that name."""
    core, telemetry = ports(rtl / "fluxproof.vhd"), ports(rtl / "io" / "telemetry.vhd")
    own = {name: port for name, port in telemetry.items() if name not in core or name == "enable"}
    own = {f"telemetry_{name}" if name == "enable" else name: port for name, port in own.items()}
    listed = ";\n".join(f"    {name} : {way} {kind}" for name, (way, kind) in {**core, **own}.items())
    joined = {name: f"telemetry_{name}" if name == "enable" else name for name in telemetry}
    text = f"""\
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity {NAME} is
  generic ({"; ".join(f"{name} : positive" for name in GENERICS)});
  port (
{listed}
  );
end entity {NAME};

architecture test of {NAME} is
begin
  core : entity work.fluxproof
    generic map ({", ".join(f"{name} => {name}" for name in GENERICS[:3])})
    port map ({", ".join(f"{name} => {name}" for name in core)});
  stream : entity work.telemetry
    generic map ({", ".join(f"{name} => {name}" for name in (*GENERICS[:2], "DEPTH_BITS"))})
    port map ({", ".join(f"{name} => {signal}" for name, signal in joined.items())});
end architecture test;
"""
    return write_text(ROOT / "build" / "tb" / f"{NAME}.vhd", text)
