-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: speed from two consecutive position codes, then a first-order filter.
--   raw(k)   = k_speed * wrap(code(k) - code(k-1))
--   omega(k) = omega(k-1) + k_filter*(raw(k) - omega_me(k-1));  omega_me = omega, rounded
-- Formats: difference S(-1,18) of a turn, k_speed U(12,12), k_filter U(1,16) up to 1, omega S(2,28), omega_me PU.
-- Latency: 7.  Interval: 4 (the state is read from stage 3 on and written at stage 7).
-- Rounding: half up; raw saturates at 2 per unit.  omega moves towards raw by at most their distance, so it stays within
-- half an LSB of PU of the range of raw, and omega_me within that range.
-- The first sample after reset has no predecessor: its difference is zero.  A sample with position_restart has none
-- either, and the filter keeps its speed.  With speed_given the speed is omega_given, measured elsewhere; the filter
-- goes on behind it.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk                : in  std_logic;
    rst                : in  std_logic;
    in_valid           : in  std_logic;
    code_theta         : in  unsigned(POSITION_BITS - 1 downto 0);
    reverse            : in  std_logic;
    k_speed            : in  unsigned(23 downto 0);
    k_filter           : in  unsigned(16 downto 0);
    position_restart   : in  std_logic;
    speed_given        : in  std_logic;
    omega_given        : in  signed(PU_W - 1 downto 0);
    out_valid          : out std_logic;
    omega_me           : out signed(PU_W - 1 downto 0);
    speed_was_given    : out std_logic;  -- this and the next: what the sample had, for a recording
    position_restarted : out std_logic
  );
end entity speed;

architecture rtl of speed is
  constant LATENCY : positive := SPEED_LATENCY;
  constant MOVED_W : positive := SPEED_OMEGA_W + 3;  -- the whole sum: nothing to saturate

  constant NOTHING : signed(0 downto 0) := "0";

  type state_t is record
    code  : signed(TURN_W - 1 downto 0);
    seen  : std_logic;
    omega : signed(SPEED_OMEGA_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal aligned_0 : signed(TURN_W - 1 downto 0);
  signal mech_0    : signed(TURN_W - 1 downto 0);
  signal last_0    : signed(TURN_W - 1 downto 0);
  signal apart_0   : signed(TURN_W downto 0);
  signal delta_0   : signed(TURN_W - 1 downto 0);
  signal by_speed  : signed(24 downto 0);
  signal raw_3     : signed(PU_W - 1 downto 0);
  signal err_3     : signed(PU_W downto 0);
  signal by_filter : signed(17 downto 0);
  signal moved_6   : signed(MOVED_W - 1 downto 0);
  signal omega_6   : signed(PU_W - 1 downto 0);
  signal omega_7   : signed(PU_W - 1 downto 0);  -- the state, rounded
begin
  valid(0)  <= in_valid;
  by_speed  <= signed('0' & k_speed);
  by_filter <= signed('0' & k_filter);

  -- The code as an angle, and its difference from the last one, the shorter angle: modulo one turn
  aligned_0 <= shift_left(signed(resize(code_theta, TURN_W)), TURN_W - POSITION_BITS);
  mech_0    <= -aligned_0 when reverse = '1' else aligned_0;
  last_0    <= state.code when state.seen = '1' else mech_0;
  apart_0   <= difference(mech_0, last_0);
  delta_0   <= apart_0(TURN_W - 1 downto 0);

  -- Stages 1 to 3: raw = delta*k_speed
  raw_part : entity work.multiply_add
    generic map (DROP => SPEED_DROP_RAW)
    port map (clk => clk, a => by_speed, b => delta_0, c => NOTHING, y => raw_3, limited => open);

  err_3 <= (others => '0') when position_restart = '1' else difference(raw_3, omega_7);

  -- Stages 4 to 6: moved = omega + err*k_filter
  filter_part : entity work.multiply_add
    generic map (DROP => SPEED_DROP_STATE)
    port map (clk => clk, a => err_3, b => by_filter, c => state.omega, y => moved_6, limited => open);

  omega_6 <= resize(round_half_up(moved_6, SPEED_TO_PU), PU_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the code for the next sample
      if valid(0) = '1' then
        state.code <= mech_0;
        state.seen <= '1';
      end if;

      -- Stage 7: omega = moved;  omega_me = omega, rounded, or omega_given
      if valid(6) = '1' then
        state.omega        <= resize(moved_6, SPEED_OMEGA_W);
        omega_7            <= omega_6;
        omega_me           <= omega_given when speed_given = '1' else omega_6;
        speed_was_given    <= speed_given;
        position_restarted <= position_restart;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.code          <= (others => '0');
        state.seen          <= '0';
        state.omega         <= (others => '0');
        omega_7             <= (others => '0');
        omega_me            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
