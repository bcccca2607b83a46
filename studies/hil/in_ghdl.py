# SPDX-License-Identifier: BSD-3-Clause
"""Core and motor in one (`core_and_motor`) in GHDL, the VHDL as it is: its gates at every clock against the models.

python -m studies.hil.in_ghdl [PERIODS [HALF]]

A bench without software: constants at all inputs, the gates of every clock in a file.  The motor is linear, as its
tables stay as an FPGA's configuration leaves them.  HALF: clocks of half a period.  With few of them a step of the
motor is so long that 1/J of the shaft fits no register: then the shaft is held at a speed.
"""

from __future__ import annotations

import math
import resource
import subprocess
import sys
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import BUILD, DRIVES
from fluxproof.cosim import ghdl
from fluxproof.cosim.entity import read_entity
from fluxproof.cosim.flat import flat_top
from fluxproof.files import write_text
from fluxproof.hil.registers import PORTS, Thermal, code
from golden_model import drive as drives
from golden_model.motor import motor_model
from studies.hil.closed_loop import BUS, Parts, golden_run, parts, references
from studies.hil.drive import SERVO

PERIODS, HALF = 12, 1500
FREE = 1500  # clocks of half a period from which on the shaft is free
HELD_RAD_S = 150.0
BENCH, RESET = "loop_bench", 4
FOLDER = BUILD / "hil_ghdl"
_RUN = """  process
    file rows : std.textio.text open write_mode is "gates.txt";
    variable row : std.textio.line;
  begin
    for k in 1 to {reset} loop
      clk <= '0'; wait for 1 ns; clk <= '1'; wait for 1 ns;
    end loop;
    rst <= '0';
    for k in 1 to CLOCKS loop
      clk <= '0'; wait for 1 ns; clk <= '1'; wait for 1 ns;
      std.textio.write(row, to_integer(gate_low & gate_high));
      std.textio.writeline(rows, row);
    end loop;
    wait;
  end process;
"""


def bench_text(of: Parts, flat_file) -> str:
    """The VHDL of the bench around the flat top."""
    entity, config = read_entity(flat_file), of.core.config._asdict()
    generics = {name: config.get(name.lower(), g.default) for name, g in entity.generics.items()}
    values = {
        **of.core.values._asdict(),
        **references(of),
        "enable": 1,
        "motor_u_dc": of.scale.u_dc(of.drive.inverter.dc_bus_v),
    }
    values |= of.of_motor()
    lines = ["library ieee;", "use ieee.std_logic_1164.all;", "use ieee.numeric_std.all;"]
    lines += [
        "use work.fluxproof_pkg.all;",
        "",
        f"entity {BENCH} is",
        "  generic (",
        "    CLOCKS : natural := 1",
        "  );",
    ]
    lines += [f"end entity {BENCH};", "", f"architecture test of {BENCH} is"]
    lines += [f"  constant {name} : integer := {value};" for name, value in generics.items()]
    lines += [f"  signal {n} : {p.vhdl_type}{_start(n)};" for n, p in entity.pins.items()]
    lines.append("begin")
    for name, pin in entity.inputs.items():
        if name not in ("clk", "rst"):
            value = int(values.get(name, values.get(name.removesuffix("_in"), 0)))
            as_type = f"'{value}'" if pin.left is None else f"to_{pin.kind}({value}, {name}'length)"
            lines.append(f"  {name} <= {as_type};")
    lines += [f"  top : entity work.{entity.name}", "    generic map ("]
    lines += [",\n".join(f"      {g} => {g}" for g in generics), "    )", "    port map ("]
    lines += [",\n".join(f"      {n} => {n}" for n in entity.pins), "    );", _RUN.format(reset=RESET)]
    return "\n".join([*lines, "end architecture test;"]) + "\n"


def _start(name: str) -> str:
    return {"clk": " := '0'", "rst": " := '1'"}.get(name, "")


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def in_ghdl(of: Parts, clocks: int) -> tuple[np.ndarray, float]:
    """(Gate words after each clock from the end of the reset on, processor time of GHDL [s])."""
    _, (flat_file,) = flat_top("core_and_motor")
    bench = write_text(FOLDER / f"{BENCH}.vhd", bench_text(of, flat_file))
    built = ghdl.build(BENCH, extra=[bench, flat_file])
    began = _children_s()
    command = ["ghdl", "-r", "--std=08", "--work=top", f"--workdir={built}", BENCH, f"-gCLOCKS={clocks}"]
    program = built / BENCH  # which `ghdl -r` starts in its folder; mcode makes none
    if program.exists():
        command = [str(program), f"-gCLOCKS={clocks}"]
    subprocess.run([*command, "--ieee-asserts=disable"], cwd=FOLDER, check=True)
    return np.loadtxt(FOLDER / "gates.txt", dtype=np.int64), _children_s() - began


def of_half(half: int) -> Parts:
    """What is built in, for a period of 2*half clocks."""
    drive = drives.with_carrier(drives.load(DRIVES / "servo_24v.toml"), half)
    if half >= FREE:
        return parts(drive)._replace(tables=motor_model.no_tables())
    bus, body = BUS._replace(capacitance=2e-3, source_ohm=0.0), Thermal(3.0, 15.0, 20.0, ambient_c=60.0)
    of = parts(drive, replace(SERVO, inertia_kgm2=1.0), bus, body)
    speed = code("omega_set", HELD_RAD_S * of.scale.step_s / (2.0 * math.pi), PORTS["omega_set"].fmt)
    return of._replace(tables=motor_model.no_tables(), motor=of.motor._replace(hold=1, omega_set=speed))


class Compared(NamedTuple):
    """Gate words of the models and of GHDL; the last speed; processor time of GHDL [s]."""

    models: np.ndarray
    found: np.ndarray
    speed: int
    seconds: float

    @property
    def wrong(self) -> np.ndarray:
        """Clocks at which they differ."""
        return np.flatnonzero(self.models != self.found)


def compare(periods: int, half: int = HALF) -> Compared:
    """The same closed loop twice."""
    of = of_half(half)
    golden = golden_run(of, periods, 1 << 40)
    words, seconds = in_ghdl(of, len(golden.words))
    return Compared(golden.words, words, golden.observed[-1]["omega_me"], seconds)


def main(periods: int = PERIODS, half: int = HALF) -> int:
    """Exit status 1 where a clock differs."""
    done = compare(periods, half)
    first = f", the first {done.wrong[0]}" if len(done.wrong) else ""
    print(f"{periods} periods, {len(done.found)} clocks in {done.seconds:.0f} s of processor time")
    print(f"speed {done.speed}; {len(done.wrong)} clocks differ{first}")
    return 1 if len(done.wrong) else 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
