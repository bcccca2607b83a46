-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: an incremental encoder from its pins to code and speed: three filters, decoder, counter, index, edge timer.
-- Nothing is computed here.  From a pin to the count: filter_clocks + 5 clocks, to the code one more.
-- Formats: those of the blocks.  Latency: 1 (every clock is a sample); sample to code_theta 1, to omega_valid that of
-- edge_timer.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity incremental_encoder is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    pin_a           : in  std_logic;  -- asynchronous
    pin_b           : in  std_logic;  -- asynchronous
    pin_z           : in  std_logic;  -- asynchronous
    sample          : in  std_logic;
    start           : in  std_logic;
    start_count     : in  unsigned(17 downto 0);
    clear_faults    : in  std_logic;
    filter_clocks   : in  unsigned(9 downto 0);
    index_phase     : in  unsigned(1 downto 0);
    counts          : in  unsigned(18 downto 0);
    code_step       : in  unsigned(16 downto 0);
    code_rest       : in  unsigned(17 downto 0);
    correct_max     : in  unsigned(11 downto 0);
    index_once      : in  std_logic;
    reverse         : in  std_logic;
    k_edge          : in  unsigned(31 downto 0);
    whole_lines     : in  std_logic;
    code_theta      : out unsigned(POSITION_BITS - 1 downto 0);
    omega_me        : out signed(PU_W - 1 downto 0);
    omega_valid     : out std_logic;
    count           : out unsigned(17 downto 0);
    forward         : out std_logic;
    referenced      : out std_logic;
    moving          : out std_logic;
    index_count     : out unsigned(17 downto 0);
    illegal_count   : out unsigned(11 downto 0);
    lost_counts     : out unsigned(11 downto 0);
    index_lost      : out std_logic;
    index_wrong     : out std_logic;
    setting_refused : out std_logic
  );
end entity incremental_encoder;

architecture rtl of incremental_encoder is
  signal pins      : std_logic_vector(0 to 2);
  signal levels    : std_logic_vector(0 to 2);
  signal settleds  : std_logic_vector(0 to 2);
  signal settled   : std_logic;
  signal step_up   : std_logic;
  signal step_down : std_logic;
  signal index     : std_logic;
  signal count_now : unsigned(17 downto 0);
  signal pending   : signed(19 downto 0);
  signal restarted : std_logic;

  signal correct    : std_logic;
  signal correction : signed(19 downto 0);
  signal fast       : std_logic;
begin
  pins    <= (pin_a, pin_b, pin_z);
  settled <= and settleds;
  count   <= count_now;

  filters : for k in 0 to 2 generate

    filter : entity work.input_filter
      port map (
        clk           => clk,
        rst           => rst,
        pin           => pins(k),
        filter_clocks => filter_clocks,
        level         => levels(k),
        settled       => settleds(k)
      );

  end generate;

  decoder : entity work.quadrature_decoder
    port map (
      clk           => clk,
      rst           => rst,
      a             => levels(0),
      b             => levels(1),
      z             => levels(2),
      settled       => settled,
      clear_faults  => clear_faults,
      index_phase   => index_phase,
      step_up       => step_up,
      step_down     => step_down,
      forward       => forward,
      index         => index,
      illegal       => open,
      illegal_count => illegal_count
    );

  counter : entity work.turn_counter
    generic map (
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      step_up         => step_up,
      step_down       => step_down,
      sample          => sample,
      correct         => correct,
      correction      => correction,
      fast            => fast,
      counts          => counts,
      code_step       => code_step,
      code_rest       => code_rest,
      code_theta      => code_theta,
      count           => count_now,
      pending         => pending,
      moving          => moving,
      restarted       => restarted,
      setting_refused => setting_refused
    );

  check : entity work.index_check
    port map (
      clk          => clk,
      rst          => rst,
      index        => index,
      count        => count_now,
      pending      => pending,
      start        => start,
      start_count  => start_count,
      restart      => restarted,
      clear_faults => clear_faults,
      counts       => counts,
      correct_max  => correct_max,
      index_once   => index_once,
      correct      => correct,
      correction   => correction,
      fast         => fast,
      referenced   => referenced,
      index_count  => index_count,
      lost_counts  => lost_counts,
      index_lost   => index_lost,
      index_wrong  => index_wrong
    );

  timer : entity work.edge_timer
    port map (
      clk         => clk,
      rst         => rst,
      step_up     => step_up,
      step_down   => step_down,
      sample      => sample,
      reverse     => reverse,
      k_edge      => k_edge,
      whole_lines => whole_lines,
      omega_me    => omega_me,
      omega_valid => omega_valid
    );

end architecture rtl;
