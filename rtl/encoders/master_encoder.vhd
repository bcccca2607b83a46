-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the second encoder of a board, the master of gear: A and B from the pins to a code of 18 bits a turn.
-- Two filters, a decoder and a counter; no index, since a gear needs its master's way and not its place.  A transition
-- that A and B cannot make is counted in master_illegal.  MASTER = 0: nothing is built.
-- Formats: those of the blocks.  Latency: 1 (every clock is a sample); from a pin to the count filter_clocks + 5 clocks.
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity master_encoder is
  generic (
    MASTER : natural range 0 to 1 := 1
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    master_a       : in  std_logic;  -- asynchronous
    master_b       : in  std_logic;  -- asynchronous
    sample_trigger : in  std_logic;
    clear_encoder  : in  std_logic;
    filter_clocks  : in  unsigned(9 downto 0);
    master_counts  : in  unsigned(18 downto 0);
    master_step    : in  unsigned(16 downto 0);
    master_rest    : in  unsigned(17 downto 0);
    master_code    : out unsigned(TURN_W - 1 downto 0);
    master_illegal : out unsigned(11 downto 0)
  );
end entity master_encoder;

architecture rtl of master_encoder is
begin

  built : if MASTER = 1 generate
    signal pins               : std_logic_vector(0 to 1);
    signal levels             : std_logic_vector(0 to 1);
    signal settleds           : std_logic_vector(0 to 1);
    signal settled            : std_logic;
    signal step_up, step_down : std_logic;
  begin
    pins    <= (master_a, master_b);
    settled <= and settleds;

    filters : for k in 0 to 1 generate

      filter : entity work.input_filter
        port map (clk => clk, rst => rst, pin => pins(k), filter_clocks => filter_clocks, level => levels(k),
                  settled => settleds(k));

    end generate;

    decoder : entity work.quadrature_decoder
      port map (clk => clk, rst => rst, a => levels(0), b => levels(1), z => '0', settled => settled,
                clear_faults => clear_encoder, index_phase => "00", step_up => step_up, step_down => step_down,
                forward => open, index => open, illegal => open, illegal_count => master_illegal);

    counter : entity work.turn_counter
      generic map (POSITION_BITS => TURN_W)
      port map (clk => clk, rst => rst, step_up => step_up, step_down => step_down, sample => sample_trigger,
                correct => '0', correction => (others => '0'), fast => '0', counts => master_counts,
                code_step => master_step, code_rest => master_rest, code_theta => master_code, count => open,
                pending => open, moving => open, restarted => open, setting_refused => open);

  else generate
    master_code    <= (others => '0');
    master_illegal <= (others => '0');
  end generate built;

end architecture rtl;
