# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof_board in GHDL, its pins from a file and what it shows into another: every clock against the golden board.

    python -m cocotb_tests.support.board.ghdl_bench RUN PERIODS FOLDER

RUN is one of run_cases.RUNS.  A bench in VHDL plays the pins, because Python inside the simulator would take most of
the time.  Leaves board.json (facts), capture.bin (telemetry) in FOLDER; exit status 1 with the first difference.
"""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import numpy as np

from cocotb_tests.support.board.loop_bench import AXI, CONSTANT
from cocotb_tests.support.board.run_cases import RUNS, first_difference, status
from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim import ghdl
from fluxproof.cosim.board_clock import PINS, SEEN
from fluxproof.cosim.entity import read_entity
from fluxproof.files import write_text

NAME = "board_play"
STREAM = ("m_axis_tvalid", "m_axis_tdata")
PLAYED, SHOWN = (*AXI, *PINS), (*SEEN, *STREAM)
WIDE = {"ADC_BITS - 1": "adc_bits", "POSITION_BITS - 1": "position_bits", "SPI_LINES - 1": "spi_lines"}


def widths(generics: dict[str, int]) -> dict[str, int]:
    """Bits of every pin."""
    pins = read_entity(RTL / "generated" / "fluxproof_board.vhd").pins
    known = {text: generics[name.upper()] for text, name in WIDE.items()}
    return {n: 1 if p.left is None else known.get(p.left) or int(p.left) + 1 for n, p in pins.items()}


def bench() -> Path:
    """The bench: a line of pins.txt is a number of clocks and the levels of PLAYED, one of seen.txt a clock and
    the levels of SHOWN that it has left."""
    entity = read_entity(RTL / "generated" / "fluxproof_board.vhd")
    constant = {name: str(value) for name, value in CONSTANT.items()}
    signals, maps, inputs, outputs = [], [], [], []
    for name, pin in entity.pins.items():
        signals.append(f"  signal {name} : {pin.vhdl_type};")
        maps.append(f"{name} => {name}")
        if pin.is_input and name not in (*PLAYED, "aclk", "aresetn"):
            vector = pin.left is not None
            bits = "(others => '0')" if vector else "'0'"
            if name in constant:
                bits = "(others => '1')" if vector else "'1'"
            inputs.append(f"  {name} <= {bits};")
    size = {n: f"{n}'length" if entity.pins[n].left is not None else "1" for n in (*PLAYED, *SHOWN)}
    total = " + ".join(size[n] for n in PLAYED)
    place = []
    for n in PLAYED:
        target = n if entity.pins[n].left is not None else None
        place.append(f"      at := at - {size[n]};")
        slice_ = f"levels(at + {size[n]} - 1 downto at)" if target else "levels(at)"
        place.append(f"      {n} <= {slice_};")
    outputs = " & ".join(n if n != "m_axis_tdata" else "told" for n in SHOWN)
    generics = ";\n".join(f"    {g.name} : integer := {g.default}" for g in entity.generics.values())
    joined = ", ".join(f"{g} => {g}" for g in entity.generics)
    text = f"""\
library ieee;
use ieee.std_logic_1164.all;
use std.textio.all;
use std.env.all;

entity {NAME} is
  generic (
{generics}
  );
end entity {NAME};

architecture test of {NAME} is
{chr(10).join(signals)}
  signal told : std_logic_vector(31 downto 0);
begin
{chr(10).join(inputs)}
  told <= m_axis_tdata when m_axis_tvalid = '1' else (others => '0');

  clock : process
  begin
    aclk <= '0';
    wait for 5 ns;
    aclk <= '1';
    wait for 5 ns;
  end process;

  play : process
    file pins      : text open read_mode is "pins.txt";
    file seen      : text open write_mode is "seen.txt";
    variable row   : line;
    variable count : natural;
    variable clock : natural := 0;
    variable at    : integer;
    variable bits  : bit_vector({total} - 1 downto 0);
    variable levels : std_logic_vector({total} - 1 downto 0);
    variable shows : std_logic_vector({" + ".join(size[n] for n in SHOWN)} - 1 downto 0);
    variable last  : std_logic_vector(shows'range);
  begin
    aresetn <= '0';
    levels := (others => '0');
    for k in 1 to 8 loop
      at := levels'length;
{chr(10).join(place)}
      if k = 7 then
        aresetn <= '1';
      end if;
      wait until falling_edge(aclk);
    end loop;
    while not endfile(pins) loop
      readline(pins, row);
      read(row, count);
      read(row, bits);
      levels := to_stdlogicvector(bits);
      at := levels'length;
{chr(10).join(place)}
      for k in 1 to count loop
        wait until falling_edge(aclk);
        shows := {outputs};
        if clock = 0 or shows /= last then
          write(row, clock);
          write(row, ' ');
          write(row, to_string(shows));
          writeline(seen, row);
          last := shows;
        end if;
        clock := clock + 1;
      end loop;
    end loop;
    finish;
  end process;

  board : entity work.fluxproof_board
    generic map ({joined})
    port map ({", ".join(maps)});
end architecture test;
"""
    return write_text(ROOT / "build" / "tb" / f"{NAME}.vhd", text)


def pin_lines(chunks, width: dict[str, int]):
    """Lines of pins.txt: how long which levels stand."""
    rows = (row for chunk in chunks for row in rows_of(chunk.inputs, width))
    for levels, same in groupby(rows):
        yield f"{sum(1 for _ in same)} {levels}\n"


def rows_of(inputs: dict[str, np.ndarray], width: dict[str, int]) -> list[str]:
    """The levels of PLAYED at each clock, as binary digits."""
    length = len(next(iter(inputs.values())))
    text = [[format(int(v), f"0{width[n]}b") for v in inputs[n]] if n in inputs else None for n in PLAYED]
    still = ["0" * width[n] for n in PLAYED]
    return ["".join(still[j] if text[j] is None else text[j][k] for j in range(len(PLAYED))) for k in range(length)]


def shown(path: Path, clocks: int, width: dict[str, int]) -> np.ndarray:
    """(clocks, len(SHOWN)) of seen.txt; ValueError for a metavalue."""
    values, last, at = np.zeros((clocks, len(SHOWN)), np.int64), None, 0
    for line in path.read_text().splitlines():
        number, levels = line.split()
        if last is not None:
            values[at : int(number)] = last
        at, last, begin = int(number), [], 0
        for name in SHOWN:
            last.append(int(levels[begin : begin + width[name]], 2))
            begin += width[name]
    values[at:] = last
    return values


def main(run: str, periods: int, folder: Path) -> int:
    loop = RUNS[run]()
    chunks, width = list(loop.run(periods)), widths(loop.generics())
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "pins.txt").write_text("".join(pin_lines(chunks, width)))
    program = ghdl.build(NAME, extra=[bench()])
    command = [str(program / NAME)]
    if not Path(command[0]).exists():  # the mcode back end makes no program
        command = ["ghdl", "-r", "--std=08", "--work=top", f"--workdir={program}", NAME]
    command += [*(f"-g{n}={v}" for n, v in loop.generics().items()), "--ieee-asserts=disable", *ghdl.waves(folder)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        print((done.stdout + done.stderr)[-2000:], file=sys.stderr)
        return 1
    clocks = sum(len(chunk.seen) for chunk in chunks)
    got, at = shown(folder / "seen.txt", clocks, width), 0
    for chunk in chunks:
        part = got[at : at + len(chunk.seen), : len(SEEN)]
        if problem := first_difference(part, chunk.seen, SEEN, chunk.number):
            print(problem, file=sys.stderr)
            return 1
        at += len(chunk.seen)
    got[got[:, SHOWN.index("m_axis_tvalid")] == 1, SHOWN.index("m_axis_tdata")].astype("<u4").tofile(
        folder / "capture.bin"
    )
    facts = {"clocks": clocks, "samples": loop.golden.samples, "rpm": chunks[-1].omega_m * 9.549, **status(chunks[-1])}
    facts["fault_flags"] = loop.golden.state.of_core.of_fault_latch.flags
    facts["gates_after"] = int(chunks[-1].seen[-100:, :2].max())
    facts["history"] = [[list(map(int, row)) for row in pair] for pair in loop.golden.history]
    write_text(folder / "board.json", json.dumps(facts))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])))
