-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the currents: those of a linear machine plus what saturation adds, between four points of the map.
--   lo = m_00 + (m_01 - m_00)*f_q;  hi = m_10 + (m_11 - m_10)*f_q;  i = x + lo + (hi - lo)*f_d
--   i_alpha = i_d*cos - i_q*sin;  i_beta = i_q*cos + i_d*sin;  i_a = i_alpha;  i_b, i_c = -i_a/2 +- sqrt(3)/2*i_beta
-- One pipeline for both axes, d a clock before q.  A sample enters while the last one is still in the rotation.
-- Formats: x S(1,22), points S(0,17), places U(0,17), between the points 21 fraction bits, currents PU.
-- Latency: 19; the points are needed 3 clocks after the cell.  Interval: 16.
-- Rounding: every product half up.  Sums saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_current is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x_d       : in  signed(23 downto 0);
    x_q       : in  signed(23 downto 0);
    f_d       : in  unsigned(16 downto 0);
    f_q       : in  unsigned(16 downto 0);
    cos_theta : in  signed(MOTOR_TRIG_W - 1 downto 0);
    sin_theta : in  signed(MOTOR_TRIG_W - 1 downto 0);
    turn_d_in : in  signed(FLUX_W - 1 downto 0);
    turn_q_in : in  signed(FLUX_W - 1 downto 0);
    d_00      : in  signed(17 downto 0);
    d_01      : in  signed(17 downto 0);
    d_10      : in  signed(17 downto 0);
    d_11      : in  signed(17 downto 0);
    q_00      : in  signed(17 downto 0);
    q_01      : in  signed(17 downto 0);
    q_10      : in  signed(17 downto 0);
    q_11      : in  signed(17 downto 0);
    out_valid : out std_logic;
    i_d       : out signed(PU_W - 1 downto 0);
    i_q       : out signed(PU_W - 1 downto 0);
    i_a       : out signed(PU_W - 1 downto 0);
    i_b       : out signed(PU_W - 1 downto 0);
    i_c       : out signed(PU_W - 1 downto 0);
    turn_d    : out signed(FLUX_W - 1 downto 0);
    turn_q    : out signed(FLUX_W - 1 downto 0)
  );
end entity motor_current;

architecture rtl of motor_current is
  constant LATENCY   : positive := MOTOR_CURRENT_LATENCY;
  constant POINT_W   : positive := 18;
  constant BETWEEN_W : positive := POINT_W + MOTOR_CURRENT_FINER + 1;
  constant SUM_W     : positive := 26;

  signal valid      : std_logic_vector(0 to LATENCY);
  signal m_00_3     : signed(POINT_W - 1 downto 0);
  signal m_01_3     : signed(POINT_W - 1 downto 0);
  signal m_10_3     : signed(POINT_W - 1 downto 0);
  signal m_11_3     : signed(POINT_W - 1 downto 0);
  signal rise_0_4   : signed(POINT_W downto 0);
  signal rise_1_4   : signed(POINT_W downto 0);
  signal base_0_4   : signed(BETWEEN_W - 1 downto 0);
  signal base_1_4   : signed(BETWEEN_W - 1 downto 0);
  signal by_q       : signed(17 downto 0);
  signal by_d       : signed(17 downto 0);
  signal lo_7       : signed(BETWEEN_W - 1 downto 0);
  signal hi_7       : signed(BETWEEN_W - 1 downto 0);
  signal lo_8       : signed(BETWEEN_W - 1 downto 0);
  signal rise_8     : signed(BETWEEN_W downto 0);
  signal more_11    : signed(BETWEEN_W - 1 downto 0);
  signal x_11       : signed(23 downto 0);
  signal i_12       : signed(PU_W - 1 downto 0);
  signal i_d_13     : signed(PU_W - 1 downto 0);
  signal i_q_14     : signed(PU_W - 1 downto 0);
  signal c_13       : signed(PU_W - 1 downto 0);
  signal turned_15  : signed(PU_W - 1 downto 0);
  signal turned_16  : signed(PU_W - 1 downto 0);
  signal i_alpha_17 : signed(PU_W - 1 downto 0);
  signal prod_17    : signed(PU_W + MOTOR_CURRENT_HALF_SQRT3'length - 1 downto 0);
  signal across_18  : signed(PU_W downto 0);
  signal half_18    : signed(PU_W downto 0);
  signal i_alpha_18 : signed(PU_W - 1 downto 0);
  signal turn_d_16  : signed(FLUX_W - 1 downto 0);
  signal turn_q_16  : signed(FLUX_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  by_q     <= signed('0' & f_q);
  by_d     <= signed('0' & f_d);

  -- The axis that enters
  m_00_3 <= d_00 when valid(3) = '1' else q_00;
  m_01_3 <= d_01 when valid(3) = '1' else q_01;
  m_10_3 <= d_10 when valid(3) = '1' else q_10;
  m_11_3 <= d_11 when valid(3) = '1' else q_11;

  -- Stages 5 to 7: lo and hi of d, then of q
  first_row : entity work.multiply_add
    generic map (DROP => MOTOR_CURRENT_DROP_FIRST)
    port map (clk => clk, a => rise_0_4, b => by_q, c => base_0_4, y => lo_7, limited => open);

  second_row : entity work.multiply_add
    generic map (DROP => MOTOR_CURRENT_DROP_FIRST)
    port map (clk => clk, a => rise_1_4, b => by_q, c => base_1_4, y => hi_7, limited => open);

  -- Stages 9 to 11: lo + (hi - lo)*f_d
  across_rows : entity work.multiply_add
    generic map (DROP => MOTOR_CURRENT_DROP_SECOND)
    port map (clk => clk, a => rise_8, b => by_d, c => lo_8, y => more_11, limited => open);

  x_11 <= x_d when valid(11) = '1' else x_q;

  -- Stages 13 to 15: i_beta, then i_alpha
  c_13 <= i_d_13 when valid(14) = '1' else i_12;

  rotation : entity work.sum_of_products
    generic map (DROP => MOTOR_CURRENT_DROP)
    port map (clk => clk, a => i_12, b => sin_theta, minus => valid(13), c => c_13, d => cos_theta, y => turned_15);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 4: the rises along the columns, of d, then of q
      rise_0_4 <= difference(m_01_3, m_00_3);
      rise_1_4 <= difference(m_11_3, m_10_3);
      base_0_4 <= shift_left(resize(m_00_3, BETWEEN_W), MOTOR_CURRENT_FINER);
      base_1_4 <= shift_left(resize(m_10_3, BETWEEN_W), MOTOR_CURRENT_FINER);

      -- Stage 8: the rise across the rows
      lo_8   <= lo_7;
      rise_8 <= resize(hi_7, BETWEEN_W + 1) - lo_7;

      -- Stage 12: i_d, then i_q
      i_12 <= round_sat(resize(x_11, SUM_W) + shift_left(resize(more_11, SUM_W), MOTOR_CURRENT_TO_X),
                        MOTOR_CURRENT_DROP_I, PU_W);
      if valid(12) = '1' then
        i_d_13 <= i_12;
      end if;
      if valid(13) = '1' then
        i_q_14 <= i_12;
      end if;

      -- Stages 16 to 18: i_beta, then i_alpha;  across = sqrt(3)/2*i_beta
      turned_16  <= turned_15;
      i_alpha_17 <= turned_15;
      prod_17    <= turned_16 * MOTOR_CURRENT_HALF_SQRT3;
      across_18  <= resize(round_half_up(prod_17, MOTOR_CURRENT_DROP_BETA), PU_W + 1);
      i_alpha_18 <= i_alpha_17;
      half_18    <= resize(round_half_up(i_alpha_17, 1), PU_W + 1);

      -- Stage 19: all phases
      if valid(18) = '1' then
        i_d    <= i_d_13;
        i_q    <= i_q_14;
        i_a    <= i_alpha_18;
        i_b    <= saturate(resize(across_18, PU_W + 2) - half_18, PU_W);
        i_c    <= saturate(-resize(across_18, PU_W + 2) - half_18, PU_W);
        turn_d <= turn_d_16;
        turn_q <= turn_q_16;
      end if;

      -- The fluxes of a sample, before the next one brings its own
      if valid(15) = '1' then
        turn_d_16 <= turn_d_in;
        turn_q_16 <= turn_q_in;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
