-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: whether encoder and motor agree: the EMF that the voltage shows against what angle and speed promise.
--   e_d = u_d - u_comp_d - r_s*i_d - emf_l*(i_d - mean_d) + omega_me*model_q
--   e_q = u_q - u_comp_q - r_s*i_q - emf_l*(i_q - mean_q) - omega_me*model_d;  mean += (i - mean)/8 after each sample
--   over = |e| > emf_min + emf_i*|i| + emf_w*|omega_me|
-- encoder_lost when emf_samples more samples were over than not; emf_samples = 0 or run = 0: nothing is counted.
-- |x| of a vector is the larger component and half the smaller one.  One multiplier makes the eight products in turn.
-- Formats: fluxes S(1,23), model saturated.  Latency: 13.  Interval: 13.
-- Rounding: products are cut (floor) to 2**-16, |x| is the one's complement where x is negative; |i| saturates at 2, i - mean
-- at 1, mean is cut from three bits below; the counter saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity emf_check is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    u_d          : in  signed(PU_W - 1 downto 0);
    u_q          : in  signed(PU_W - 1 downto 0);
    u_comp_d     : in  signed(PU_W - 1 downto 0);
    u_comp_q     : in  signed(PU_W - 1 downto 0);
    i_d          : in  signed(PU_W - 1 downto 0);
    i_q          : in  signed(PU_W - 1 downto 0);
    model_d      : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    model_q      : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    omega_me     : in  signed(PU_W - 1 downto 0);
    run          : in  std_logic;
    r_s          : in  unsigned(RESISTANCE_W - 1 downto 0);
    emf_min      : in  unsigned(16 downto 0);
    emf_l        : in  unsigned(23 downto 0);
    emf_i        : in  unsigned(22 downto 0);
    emf_w        : in  unsigned(23 downto 0);
    emf_samples  : in  unsigned(11 downto 0);
    out_valid    : out std_logic;
    encoder_lost : out std_logic
  );
end entity emf_check;

architecture rtl of emf_check is
  constant LATENCY : positive := EMF_CHECK_LATENCY;
  constant DROP    : natural  := EMF_CHECK_DROP;
  constant E_W     : positive := 22;

  subtype sum_t is signed(E_W - 1 downto 0);

  -- State: eight times the mean currents, samples over less those that were not
  signal sum_d, sum_q : signed(PU_W + EMF_CHECK_MEAN - 1 downto 0);
  signal count        : unsigned(11 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal a_1       : signed(PU_W - 1 downto 0);
  signal b_1       : signed(FLUX_W - 1 downto 0);
  signal prod_1    : signed(PU_W + FLUX_W - 1 downto 0);
  signal prod_2    : signed(PU_W + FLUX_W - 1 downto 0);
  signal cut_2     : sum_t;
  signal less_1    : std_logic;
  signal current_2 : signed(PU_W - 1 downto 0);
  signal e_d, e_q  : sum_t;
  signal most      : sum_t;
  signal less_9    : std_logic;
  signal size_10   : sum_t;
  signal over_11   : std_logic;

  -- 2*(i - mean), saturated
  function change (i : signed; sum : signed) return signed is
  begin
    return saturate(shift_left(resize(i, PU_W + 2) - shift_right(sum, EMF_CHECK_MEAN), 1), PU_W);
  end function;

begin
  valid(0) <= in_valid;
  prod_1   <= a_1 * b_1;
  cut_2    <= resize(shift_right(prod_2, DROP), E_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);
      prod_2              <= prod_1;

      -- Stages 1 to 8: the factors of r_s*i, omega_me*model, emf_l*(i - mean) of d, the same of q, emf_i*|i|,
      -- emf_w*|omega_me|
      a_1 <= i_d;
      b_1 <= signed(resize(shift_right(r_s, EMF_CHECK_HALF_R), FLUX_W));
      if (valid(1) or valid(4)) = '1' then
        a_1 <= omega_me;
        b_1 <= saturate(model_q(model_q'high downto FLUX_MODELS_DROP_MODEL), FLUX_W);
        if valid(4) = '1' then
          b_1 <= saturate(model_d(model_d'high downto FLUX_MODELS_DROP_MODEL), FLUX_W);
        end if;
      elsif (valid(2) or valid(5)) = '1' then
        a_1 <= change(i_d, sum_d);
        b_1 <= signed(resize(emf_l, FLUX_W));
        if valid(5) = '1' then
          a_1 <= change(i_q, sum_q);
        end if;
      elsif valid(3) = '1' then
        a_1 <= i_q;
      elsif valid(6) = '1' then
        a_1 <= current_2;
        b_1 <= signed(resize(emf_i, FLUX_W));
      elsif valid(7) = '1' then
        a_1 <= size(omega_me);
        b_1 <= signed(resize(emf_w, FLUX_W));
      end if;
      less_1    <= smaller_is(i_d, i_q);
      current_2 <= saturate(length(i_d, i_q, less_1), PU_W);

      -- Stages 3 to 10: e_d, e_q, most, a product each
      if valid(2) = '1' then
        e_d <= resize(u_d, E_W) - u_comp_d - cut_2;
      elsif valid(3) = '1' then
        e_d <= e_d + cut_2;
      elsif valid(4) = '1' then
        e_d <= e_d - cut_2;
      end if;
      if valid(5) = '1' then
        e_q <= resize(u_q, E_W) - u_comp_q - cut_2;
      elsif (valid(6) or valid(7)) = '1' then
        e_q <= e_q - cut_2;
      end if;
      if valid(8) = '1' then
        most <= signed(resize(emf_min, E_W)) + cut_2;
      elsif valid(9) = '1' then
        most <= most + cut_2;
      end if;

      -- Stages 9 and 10: |e|.  Stage 11: over
      less_9  <= smaller_is(e_d, e_q);
      size_10 <= resize(length(e_d, e_q, less_9), E_W);
      over_11 <= '1' when size_10 > most else '0';

      -- Stage 12: the means;  samples over, less those that were not
      if valid(11) = '1' then
        sum_d <= sum_d + i_d - shift_right(sum_d, EMF_CHECK_MEAN);
        sum_q <= sum_q + i_q - shift_right(sum_q, EMF_CHECK_MEAN);
        if run = '0' or emf_samples = 0 then
          count <= (others => '0');
        elsif over_11 = '1' and (and count) = '0' then
          count <= count + 1;
        elsif over_11 = '0' and count /= 0 then
          count <= count - 1;
        end if;
      end if;

      -- Stage 13: the verdict
      if valid(12) = '1' then
        encoder_lost <= '1' when count >= emf_samples and count /= 0 else '0';
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        sum_d               <= (others => '0');
        sum_q               <= (others => '0');
        count               <= (others => '0');
        encoder_lost        <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
