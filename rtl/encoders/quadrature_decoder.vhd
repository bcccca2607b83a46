-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: A, B and Z of an incremental encoder to steps of a quarter line, direction, index and illegal transitions.
-- A leads B forward: (a, b) = 00, 10, 11, 01 are the phases 0 to 3.  One phase on is a step up, one back a step down; a
-- change by two phases is illegal: it gives no step and is counted in illegal_count, which saturates.
-- index comes when Z is 1 in phase index_phase, once for each entry.  A quarter of a line is one place of the shaft
-- whatever the direction, so both directions find the same count, also after a reversal within Z.  This needs a Z of at
-- most one line (4 counts) that covers one quarter of that phase.
-- Inputs are read from settled on; the first phase is not a step.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity quadrature_decoder is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    a             : in  std_logic;
    b             : in  std_logic;
    z             : in  std_logic;
    settled       : in  std_logic;
    clear_faults  : in  std_logic;
    index_phase   : in  unsigned(1 downto 0);
    step_up       : out std_logic;
    step_down     : out std_logic;
    forward       : out std_logic;
    index         : out std_logic;
    illegal       : out std_logic;
    illegal_count : out unsigned(11 downto 0)
  );
end entity quadrature_decoder;

architecture rtl of quadrature_decoder is
  type state_t is record
    phase         : unsigned(1 downto 0);
    seen          : std_logic;
    at_index      : std_logic;
    forward       : std_logic;
    illegal_count : unsigned(11 downto 0);
  end record state_t;

  signal state : state_t;

  signal phase     : unsigned(1 downto 0);
  signal change    : unsigned(1 downto 0);
  signal step_up_0 : std_logic;
  signal step_dn_0 : std_logic;
  signal illegal_0 : std_logic;
  signal at_index  : std_logic;
begin
  phase     <= b & (a xor b);
  change    <= phase - state.phase when (state.seen and settled) = '1' else "00";
  step_up_0 <= '1' when change = 1 else '0';
  step_dn_0 <= '1' when change = 3 else '0';
  illegal_0 <= '1' when change = 2 else '0';
  at_index  <= settled and z when phase = index_phase else '0';

  process (clk)
    variable counted : unsigned(11 downto 0);
  begin
    if rising_edge(clk) then
      state.phase    <= phase;
      state.seen     <= settled;
      state.at_index <= at_index;
      state.forward  <= step_up_0 or (state.forward and not step_dn_0);

      step_up   <= step_up_0;
      step_down <= step_dn_0;
      index     <= at_index and not state.at_index;
      illegal   <= illegal_0;

      counted := state.illegal_count;
      if clear_faults = '1' then
        counted := (others => '0');
      end if;
      if illegal_0 = '1' and counted /= 4095 then
        counted := counted + 1;
      end if;
      state.illegal_count <= counted;

      if rst = '1' then
        state.phase         <= (others => '0');
        state.seen          <= '0';
        state.at_index      <= '0';
        state.forward       <= '0';
        state.illegal_count <= (others => '0');
        step_up             <= '0';
        step_down           <= '0';
        index               <= '0';
        illegal             <= '0';
      end if;
    end if;
  end process;

  forward       <= state.forward;
  illegal_count <= state.illegal_count;

end architecture rtl;
