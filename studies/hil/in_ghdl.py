# SPDX-License-Identifier: BSD-3-Clause
"""Core and motor in one (`core_and_motor`) in GHDL, the VHDL as it is: its gates at every clock against the models.

python -m studies.hil.in_ghdl [PERIODS]

A bench without software: constants at all inputs, the gates of every clock in a file.  The motor is linear, as its
tables stay as an FPGA's configuration leaves them; a period has 3000 clocks.
"""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np

from fluxproof.checkout import BUILD, DRIVES
from fluxproof.cosim import ghdl
from fluxproof.cosim.entity import read_entity
from fluxproof.cosim.flat import flat_top
from fluxproof.files import write_text
from golden_model import drive as drives
from golden_model.motor import motor_model
from studies.hil.closed_loop import Parts, golden_run, parts, references

HALF = 1500  # clocks of half a period
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


def in_ghdl(of: Parts, clocks: int) -> tuple[np.ndarray, float]:
    """(Gate words after each clock from the end of the reset on, processor time of GHDL [s])."""
    _, (flat_file,) = flat_top("core_and_motor")
    bench = write_text(FOLDER / f"{BENCH}.vhd", bench_text(of, flat_file))
    built = ghdl.build(BENCH, extra=[bench, flat_file])
    began = time.monotonic()
    command = ["ghdl", "-r", "--std=08", "--work=top", f"--workdir={built}", BENCH, f"-gCLOCKS={clocks}"]
    program = built / BENCH  # which `ghdl -r` starts in its folder; mcode makes none
    if program.exists():
        command = [str(program), f"-gCLOCKS={clocks}"]
    subprocess.run([*command, "--ieee-asserts=disable"], cwd=FOLDER, check=True)
    return np.loadtxt(FOLDER / "gates.txt", dtype=np.int64), time.monotonic() - began


def compare(periods: int) -> tuple[np.ndarray, np.ndarray, int]:
    """(Gate words of the models, of GHDL; the last speed) of the same closed loop."""
    drive = drives.with_carrier(drives.load(DRIVES / "servo_24v.toml"), HALF)
    of = parts(drive)._replace(tables=motor_model.no_tables())
    golden = golden_run(of, periods, 1 << 40)
    words, seconds = in_ghdl(of, len(golden.words))
    print(f"{periods} periods, {len(words)} clocks in {seconds:.0f} s")
    return golden.words, words, golden.observed[-1]["omega_me"]


if __name__ == "__main__":
    models, found, speed = compare(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
    wrong = np.flatnonzero(models != found)
    print(f"speed {speed}; {len(wrong)} clocks differ" + (f", the first {wrong[0]}" if len(wrong) else ""))
    sys.exit(1 if len(wrong) else 0)
