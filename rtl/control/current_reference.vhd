-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the current reference of the torque table beside i_d, in the circle.
--   i_q_circle = limit(i_q_table of the last sample, +-i_q_max);  zero with use_table = 0
-- current_limit applies i_d with i_q_max one sample late; i_q waits for both: the three are of one table point.
-- Formats: PU.  Latency: 1.  Rounding: none; limited.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_reference is
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    in_valid   : in  std_logic;
    i_q_table  : in  signed(PU_W - 1 downto 0);
    i_q_max    : in  signed(PU_W - 1 downto 0);
    use_table  : in  std_logic;
    out_valid  : out std_logic;
    i_q_circle : out signed(PU_W - 1 downto 0)
  );
end entity current_reference;

architecture rtl of current_reference is
  type state_t is record
    i_q : signed(PU_W - 1 downto 0);
  end record state_t;

  signal state : state_t;
begin
  process (clk)
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: i_q of the last sample, limited
      if in_valid = '1' then
        i_q_circle <= within(state.i_q, unsigned(i_q_max), 0);
        state.i_q  <= (others => '0');
        if use_table = '1' then
          state.i_q <= i_q_table;
        end if;
      end if;

      if rst = '1' then
        out_valid <= '0';
        state.i_q <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
