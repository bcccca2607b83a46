-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: runs every function of fixed_pkg on the lines of a file and writes what comes out.
-- A line holds drop, width and x as a bit string; so one run covers any number of formats.
-- Output line: round_half_up, saturate, exceeds, saturate_u, round_sat, clamp to +-2**(width-1), the difference to its
-- rounded value and, where drop > 0, minus_half_up and turned_half_up with both signs, as bit strings.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use std.textio.all;
use work.fixed_pkg.all;

entity fixed_tb is
  generic (
    STIMULI : string;
    RESULTS : string
  );
end entity fixed_tb;

architecture sim of fixed_tb is
begin

  process
    file stimuli_file     : text open read_mode is STIMULI;
    file results_file     : text open write_mode is RESULTS;
    variable line_in      : line;
    variable line_out     : line;
    variable drop, width  : natural;
    variable bits         : natural;
    variable x            : std_logic_vector(63 downto 0);

    -- A window of the vector as a number whose indices do not start at zero, as in real use.
    procedure run (v : signed) is
      constant WIDE  : signed(v'length downto 0) := resize(v, v'length + 1);
      constant LIMIT : signed(v'length downto 0) := shift_left(to_signed(1, WIDE'length), minimum(width, v'length) - 1);
    begin
      write(line_out, to_string(std_logic_vector(round_half_up(v, drop))) & " ");
      write(line_out, to_string(std_logic_vector(saturate(v, width))) & " ");
      write(line_out, to_string(exceeds(v, width)) & " ");
      write(line_out, to_string(std_logic_vector(saturate_u(v, width))) & " ");
      write(line_out, to_string(std_logic_vector(round_sat(v, drop, width))) & " ");
      write(line_out, to_string(std_logic_vector(clamp(WIDE, -LIMIT, LIMIT))) & " ");
      write(line_out, to_string(std_logic_vector(difference(v, round_half_up(v, drop)))));
      if drop > 0 then
        write(line_out, " " & to_string(std_logic_vector(minus_half_up(v, drop))));
        write(line_out, " " & to_string(std_logic_vector(turned_half_up(v, '0', drop))));
        write(line_out, " " & to_string(std_logic_vector(turned_half_up(v, '1', drop))));
      end if;
      writeline(results_file, line_out);
    end procedure;
  begin
    while not endfile(stimuli_file) loop
      readline(stimuli_file, line_in);
      read(line_in, drop);
      read(line_in, width);
      read(line_in, bits);
      read(line_in, x(bits downto 1));
      run(signed(x(bits downto 1)));
    end loop;
    wait;
  end process;

end architecture sim;
