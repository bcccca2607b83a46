-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: three Hall sensors from their pins to a code and a speed: filters, hall_decoder, hall_angle and edge_timer.
-- Nothing is computed here.  The upper bits of hall_angle's angle are the code of a sensor alone, with pole_pairs 1; the
-- speed is that between two sectors, with k_edge for 6 counts a turn, and comes after the code.
-- Formats: those of the blocks.  Latency: 1 (every clock is a sample), sample_trigger to omega_valid that of edge_timer.
-- Rounding: the code is cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity hall_front is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    hall_a         : in  std_logic;  -- asynchronous
    hall_b         : in  std_logic;  -- asynchronous
    hall_c         : in  std_logic;  -- asynchronous
    sample_trigger : in  std_logic;
    clear_encoder  : in  std_logic;
    filter_clocks  : in  unsigned(9 downto 0);
    hall_reverse   : in  std_logic;
    hall_offset    : in  unsigned(TURN_W - 1 downto 0);
    start_first    : in  unsigned(17 downto 0);
    sector_counts  : in  unsigned(19 downto 0);
    reverse        : in  std_logic;
    k_edge         : in  unsigned(31 downto 0);
    code_theta     : out unsigned(POSITION_BITS - 1 downto 0);
    omega_me       : out signed(PU_W - 1 downto 0);
    omega_valid    : out std_logic;
    hall_valid     : out std_logic;
    start_count    : out unsigned(17 downto 0);
    start_valid    : out std_logic;
    illegal_count  : out unsigned(11 downto 0);
    skipped_count  : out unsigned(11 downto 0);
    skipped        : out std_logic
  );
end entity hall_front;

architecture rtl of hall_front is
  signal pins, levels, steady : std_logic_vector(0 to 2);
  signal settled              : std_logic;
  signal theta_hall, theta    : unsigned(TURN_W - 1 downto 0);
  signal skip                 : std_logic;
  signal step_up, step_down   : std_logic;
begin
  pins    <= hall_a & hall_b & hall_c;
  settled <= and steady;

  filters : for k in pins'range generate

    filter : entity work.input_filter
      port map (clk => clk, rst => rst, pin => pins(k), filter_clocks => filter_clocks, level => levels(k),
                settled => steady(k));

  end generate;

  decoder : entity work.hall_decoder
    port map (clk => clk, rst => rst, hall_a => levels(0), hall_b => levels(1), hall_c => levels(2),
              settled => settled, clear_faults => clear_encoder,
              hall_reverse => hall_reverse, hall_offset => hall_offset, start_first => start_first,
              sector_counts => sector_counts,
              theta_hall => theta_hall, sector => open, hall_valid => hall_valid, step_up => step_up,
              step_down => step_down, start_count => start_count, start_valid => start_valid,
              illegal_count => illegal_count, skipped_count => skipped_count, skipped => skip);

  skipped <= skip;

  angle : entity work.hall_angle
    port map (clk => clk, rst => rst, step_up => step_up, step_down => step_down, skipped => skip,
              theta_hall => theta_hall, sample => sample_trigger, theta => theta);

  code_theta <= theta(TURN_W - 1 downto TURN_W - POSITION_BITS);

  timer : entity work.edge_timer
    port map (clk => clk, rst => rst, step_up => step_up, step_down => step_down, sample => sample_trigger,
              reverse => reverse, k_edge => k_edge, whole_lines => '0',
              omega_me => omega_me, omega_valid => omega_valid);

end architecture rtl;
