-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the gain that makes the fundamental of a clamped modulation the voltage asked for, up to six-step.
--   m_square = min(u_d**2 + sum_q**2, u_max**2) / u_dc**2,  sum_q = u_pi_q + u_dec_q + u_comp_q;  last sample's u_dc
--   gain     = R(m)/m of the table, 1 within the circle:  docs/overmodulation.md
--   inverse_used = gain*inverse,  inverse_beta_used = gain*inverse_beta
-- Formats: sum PU; square exact, then U(0,17); 1/u_dc**2 U(4,14); table U(3,13) in steps of 2**-11; inverses U(5,17).
-- Latency: 14.  Interval: 14.
-- The q axis' inputs are needed after one clock, u_d after two, when voltage_limit has it, the inverses after eleven.
-- One multiplier squares sum_q, u_d, u_max and the inverse, one after the other.
-- Rounding: squares floored, products with the inverses half up.  Saturation: sum at PU, inverses at their range.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity overmodulation is
  port (
    clk               : in  std_logic;
    rst               : in  std_logic;
    in_valid          : in  std_logic;
    u_d               : in  signed(PU_W - 1 downto 0);
    u_pi_q            : in  signed(PU_W - 1 downto 0);
    u_dec_q           : in  signed(PU_W - 1 downto 0);
    u_comp_q          : in  signed(PU_W - 1 downto 0);
    u_max             : in  unsigned(U_MAX_W - 1 downto 0);
    inverse           : in  unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    inverse_beta      : in  unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    out_valid         : out std_logic;
    inverse_used      : out unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    inverse_beta_used : out unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0)
  );
end entity overmodulation;

architecture rtl of overmodulation is
  constant LATENCY   : positive := OVERMODULATION_LATENCY;
  constant SUM_W     : positive := PU_W + 2;
  constant TWICE_W   : positive := 2 * PU_W;
  constant INVERSE_W : positive := U_DC_PROCESSING_INVERSE_W;
  constant FACTOR_W  : positive := OVERMODULATION_GAIN_BITS;
  constant ASKED_W   : positive := OVERMODULATION_ASKED_W;
  constant SCALED_W  : positive := ASKED_W + OVERMODULATION_SQUARE_W + 1;

  type state_t is record
    inverse_square : unsigned(OVERMODULATION_SQUARE_W - 1 downto 0);  -- 1/u_dc**2 of the last sample
  end record state_t;

  signal state : state_t;

  signal valid          : std_logic_vector(0 to LATENCY);
  signal sum_q_2        : signed(SUM_W - 1 downto 0);
  signal part           : signed(PU_W - 1 downto 0);  -- sum_q, u_d, u_max, then the inverse
  signal product        : signed(TWICE_W - 1 downto 0);
  signal square         : unsigned(TWICE_W - 1 downto 0);
  signal asked_7        : unsigned(ASKED_W - 1 downto 0);
  signal excess_7       : signed(SCALED_W - 1 downto 0);
  signal beyond_8       : signed(SCALED_W - 1 downto 0);
  signal step_8         : signed(SCALED_W - OVERMODULATION_DROP_STEP - 1 downto 0);
  signal index_9        : natural range 0 to OVERMODULATION_STEPS;
  signal gain_10        : unsigned(FACTOR_W - 1 downto 0);
  signal short_11       : unsigned(OVERMODULATION_SHORT_W - 1 downto 0);
  signal inverse_12     : unsigned(INVERSE_W - 1 downto 0);
  signal inverse_b_12   : unsigned(INVERSE_W - 1 downto 0);
  signal product_13     : unsigned(INVERSE_W + FACTOR_W - 1 downto 0);
  signal product_b_13   : unsigned(INVERSE_W + FACTOR_W - 1 downto 0);

  -- The inverse times the gain, rounded half up and saturated
  function scaled (x : unsigned) return unsigned is
  begin
    return saturate_u(round_half_up(signed('0' & x), OVERMODULATION_DROP_GAIN), INVERSE_W);
  end function;
begin
  valid(0) <= in_valid;

  short_11 <= saturate_u(signed('0' & inverse(INVERSE_W - 1 downto OVERMODULATION_DROP_INVERSE)), OVERMODULATION_SHORT_W);
  excess_7 <= signed('0' & (asked_7 * state.inverse_square)) - OVERMODULATION_CIRCLE;
  step_8   <= beyond_8(SCALED_W - 1 downto OVERMODULATION_DROP_STEP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 2: sum_q
      sum_q_2 <= resize(u_pi_q, SUM_W) + u_dec_q + u_comp_q;

      -- Stages 3, 4, 5, 12: what is squared: sum_q, u_d, u_max, the inverse with less bits
      if valid(2) = '1' then
        part <= saturate(sum_q_2, PU_W);
      elsif valid(3) = '1' then
        part <= u_d;
      elsif valid(4) = '1' then
        part <= signed(resize(u_max, PU_W));
      else
        part <= signed(resize(short_11, PU_W));
      end if;

      -- Stages 4, 5, 6, 13: its square
      product <= part * part;

      -- Stages 5, 6: square = sum_q**2 + u_d**2
      square <= unsigned(product);
      if valid(5) = '1' then
        square <= square + unsigned(product);
      end if;

      -- Stage 7: asked = min(square, u_max**2), floored
      if valid(6) = '1' then
        asked_7 <= resize(shift_right(minimum(square, unsigned(product)), OVERMODULATION_DROP_ASKED), ASKED_W);
      end if;

      -- Stage 8: beyond = asked/u_dc**2 - 1/3
      beyond_8 <= excess_7;

      -- Stage 9: index of the table, 0 within the circle;  stage 10: gain
      if step_8 < 0 then
        index_9 <= 0;
      elsif step_8 >= OVERMODULATION_STEPS then
        index_9 <= OVERMODULATION_STEPS;
      else
        index_9 <= to_integer(unsigned(step_8(8 downto 0))) + 1;
      end if;
      if valid(9) = '1' then
        gain_10 <= OVERMODULATION_GAINS(index_9);
      end if;

      -- Stage 12: the inverses;  stage 13: times the gain;  stage 14: rounded, saturated
      inverse_12   <= inverse;
      inverse_b_12 <= inverse_beta;
      product_13   <= inverse_12 * gain_10;
      product_b_13 <= inverse_b_12 * gain_10;
      if valid(LATENCY - 1) = '1' then
        inverse_used      <= scaled(product_13);
        inverse_beta_used <= scaled(product_b_13);
      end if;

      -- Stage 14: inverse_square = inverse**2, for the next sample
      if valid(LATENCY - 1) = '1' then
        state.inverse_square <= resize(shift_right(unsigned(product), OVERMODULATION_DROP_SQUARE), OVERMODULATION_SQUARE_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY)  <= (others => '0');
        state.inverse_square <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
