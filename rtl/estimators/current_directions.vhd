-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: predicted directions of the phase currents when the next sample's voltage acts, paper 000 eq. (6).
--   turn = k_ahead*omega_me;  x = i_alpha - turn*i_beta;  y = i_beta + turn*i_alpha
--   s_a = limit(k_sign*x, +-1)
--   s_b = limit(k_sign*(-x + sqrt(3)*y)/2, +-1);  s_c = limit(k_sign*(-x - sqrt(3)*y)/2, +-1)
--   s_alpha, s_beta: their Clarke transform
-- The phases follow each other through one multiplier, a, b, c.  The outputs are state: the next sample starts with
-- them.
-- Formats: PU in and out; k_ahead U(1,16), sqrt(3) U(1,16), k_sign U(12,12); products exact.
-- Latency: 23.  Interval: 23.
-- Rounding: every product half up.  turn, x, y and twice each phase current saturate; the other sums have the bits that
-- they need.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_directions is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_alpha   : in  signed(PU_W - 1 downto 0);
    i_beta    : in  signed(PU_W - 1 downto 0);
    omega_me  : in  signed(PU_W - 1 downto 0);
    k_ahead   : in  unsigned(16 downto 0);
    k_sign    : in  unsigned(23 downto 0);
    out_valid : out std_logic;
    s_alpha   : out signed(PU_W - 1 downto 0);
    s_beta    : out signed(PU_W - 1 downto 0)
  );
end entity current_directions;

architecture rtl of current_directions is
  constant LATENCY : positive                  := CURRENT_DIRECTIONS_LATENCY;
  constant BY_TURN : positive                  := CURRENT_DIRECTIONS_DROP_TURN;
  constant ROOT    : signed(PU_W - 1 downto 0) := resize(CURRENT_DIRECTIONS_SQRT3, PU_W);
  constant ONE     : signed(PU_W - 1 downto 0) := to_signed(CURRENT_DIRECTIONS_ONE, PU_W);
  constant NOTHING : signed(0 downto 0)        := "0";

  signal valid      : std_logic_vector(0 to LATENCY);
  signal by_k_ahead : signed(k_ahead'length downto 0);
  signal by_k_sign  : signed(k_sign'length downto 0);
  signal turn_3     : signed(PU_W - 1 downto 0);
  signal x_6        : signed(PU_W - 1 downto 0);
  signal y_6        : signed(PU_W - 1 downto 0);
  signal across_9   : signed(PU_W + 2 downto 0);
  signal twice_a_10 : signed(PU_W - 1 downto 0);
  signal twice_b_10 : signed(PU_W - 1 downto 0);
  signal twice_c_10 : signed(PU_W - 1 downto 0);
  signal twice_11   : signed(PU_W - 1 downto 0);   -- of a, b, c
  signal scaled_14  : signed(PU_W + 12 downto 0);  -- of a, b, c
  signal s_a        : signed(PU_W - 1 downto 0);   -- the three at clock 17
  signal s_b        : signed(PU_W - 1 downto 0);
  signal s_c        : signed(PU_W - 1 downto 0);
  signal alpha_22   : signed(PU_W - 1 downto 0);
  signal beta_22    : signed(PU_W - 1 downto 0);
begin
  valid(0)   <= in_valid;
  by_k_ahead <= signed('0' & k_ahead);
  by_k_sign  <= signed('0' & k_sign);

  -- Stages 1 to 3: turn = k_ahead*omega_me
  prediction : entity work.multiply_add
    generic map (DROP => BY_TURN)
    port map (clk => clk, a => omega_me, b => by_k_ahead, c => NOTHING, y => turn_3, limited => open);

  -- Stages 4 to 6: x = i_alpha - turn*i_beta;  y = i_beta + turn*i_alpha
  ahead_x : entity work.multiply_add
    generic map (DROP => BY_TURN, MINUS => 1)
    port map (clk => clk, a => turn_3, b => i_beta, c => i_alpha, y => x_6, limited => open);

  ahead_y : entity work.multiply_add
    generic map (DROP => BY_TURN)
    port map (clk => clk, a => turn_3, b => i_alpha, c => i_beta, y => y_6, limited => open);

  -- Stages 7 to 9: across = sqrt(3)*y
  crossing : entity work.multiply_add
    generic map (DROP => CURRENT_DIRECTIONS_DROP_SQRT3)
    port map (clk => clk, a => y_6, b => ROOT, c => NOTHING, y => across_9, limited => open);

  -- Stages 12 to 14: scaled = k_sign*twice/2
  slope : entity work.multiply_add
    generic map (DROP => CURRENT_DIRECTIONS_DROP)
    port map (clk => clk, a => by_k_sign, b => twice_11, c => NOTHING, y => scaled_14, limited => open);

  -- Stages 18 to 22: the Clarke transform of the directions
  directions : entity work.clarke
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => valid(17),
      i_a       => s_a,
      i_b       => s_b,
      i_c       => s_c,
      out_soon  => open,
      out_valid => open,
      i_alpha   => alpha_22,
      i_beta    => beta_22
    );

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 10: twice the phase currents, narrowed
      twice_a_10 <= saturate(x_6 & '0', PU_W);
      twice_b_10 <= saturate(resize(across_9, PU_W + 2) - x_6, PU_W);
      twice_c_10 <= saturate(-resize(across_9, PU_W + 2) - x_6, PU_W);

      -- Stages 11 to 13: a, b, c
      twice_11 <= twice_a_10;
      if valid(11) = '1' then
        twice_11 <= twice_b_10;
      elsif valid(12) = '1' then
        twice_11 <= twice_c_10;
      end if;

      -- Stages 15 to 17: the directions of a, b, c, limited to +-1, shifted in
      if valid(14) = '1' or valid(15) = '1' or valid(16) = '1' then
        s_c <= resize(clamp(scaled_14, -ONE, ONE), PU_W);
        s_b <= s_c;
        s_a <= s_b;
      end if;

      -- Stage 23: the directions of the next sample
      if valid(LATENCY - 1) = '1' then
        s_alpha <= alpha_22;
        s_beta  <= beta_22;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        s_alpha             <= (others => '0');
        s_beta              <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
