-- Purpose: the estimated flux linkages, paper 001 eq. (17): merged models plus the compensation.
--   lambda_d = lambda_m_d - rho*i_d + lambda_pi_d      where the voltage is known and a merge is wanted
--   lambda_d = lambda_mg + l_d*i_d  + lambda_pi_d      else; q alike, without lambda_mg
-- Formats: currents and lambda_mg PU, lambda_m and lambda_pi FLUX; sum in FLUX with four more integer bits.
-- Latency: 3.  Interval: 1.
-- Rounding: the product is floored to FLUX's LSB, which the sum's half up to PU cannot see.  Saturated and told;
-- a merged flux at its end is told too: the rotation before has saturated.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_estimate is
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    i_d              : in  signed(PU_W - 1 downto 0);
    i_q              : in  signed(PU_W - 1 downto 0);
    lambda_m_d       : in  signed(FLUX_W - 1 downto 0);
    lambda_m_q       : in  signed(FLUX_W - 1 downto 0);
    lambda_pi_d      : in  signed(FLUX_W - 1 downto 0);
    lambda_pi_q      : in  signed(FLUX_W - 1 downto 0);
    merge_known      : in  std_logic;
    run              : in  std_logic;
    rho              : in  unsigned(RESISTANCE_W - 1 downto 0);
    flux_mode        : in  unsigned(1 downto 0);
    l_d              : in  unsigned(INDUCTANCE_W - 1 downto 0);
    l_q              : in  unsigned(INDUCTANCE_W - 1 downto 0);
    lambda_mg        : in  signed(PU_W - 1 downto 0);
    out_valid        : out std_logic;
    lambda_d         : out signed(PU_W - 1 downto 0);
    lambda_q         : out signed(PU_W - 1 downto 0);
    estimate_limited : out std_logic
  );
end entity flux_estimate;

architecture rtl of flux_estimate is
  constant LATENCY       : positive := FLUX_ESTIMATE_LATENCY;
  constant CURRENT_MODEL : natural  := FLUX_ESTIMATE_CURRENT_MODEL;
  constant SHIFT_MERGED  : positive := FLUX_ESTIMATE_SHIFT_BASE;
  constant SHIFT_MODEL   : positive := FLUX_ESTIMATE_SHIFT_BASE - FLUX_ESTIMATE_SHIFT_MODEL;
  constant DROP          : positive := FLUX_ESTIMATE_DROP - FLUX_ESTIMATE_SHIFT_BASE;
  constant PROD_W        : positive := PU_W + RESISTANCE_W + 1;
  constant SUM_W         : positive := FLUX_W + 1 + SHIFT_MERGED + 2;
  constant SCALED_W      : positive := SUM_W - SHIFT_MODEL;

  signal valid       : std_logic_vector(0 to LATENCY);
  signal merged_0    : std_logic;
  signal factor_d_0  : unsigned(RESISTANCE_W - 1 downto 0);
  signal factor_q_0  : unsigned(RESISTANCE_W - 1 downto 0);
  signal start_d_0   : signed(FLUX_W downto 0);
  signal start_q_0   : signed(FLUX_W downto 0);
  signal merged_1    : std_logic;
  signal ended_1     : std_logic;
  signal prod_d_1    : signed(PROD_W - 1 downto 0);
  signal prod_q_1    : signed(PROD_W - 1 downto 0);
  signal base_d_1    : signed(FLUX_W downto 0);
  signal base_q_1    : signed(FLUX_W downto 0);
  signal ended_2     : std_logic;
  signal sum_d_2     : signed(SUM_W - 1 downto 0);
  signal sum_q_2     : signed(SUM_W - 1 downto 0);
  signal merged_2    : std_logic;
  signal rounded_d_2 : signed(SCALED_W - DROP downto 0);
  signal rounded_q_2 : signed(SCALED_W - DROP downto 0);

  -- Whether x is the first or the last number of its format.
  function at_end (x : signed) return std_logic is
    alias v : signed(x'length - 1 downto 0) is x;
  begin
    return (v(v'high) and not (or v(v'high - 1 downto 0))) or (not v(v'high) and (and v(v'high - 1 downto 0)));
  end function;

  -- base at the scale of the product, or its complement, from which the complement of base - prod comes: the adder
  -- behind the multiplier only adds.
  function aligned (base : signed; merged : std_logic) return signed is
  begin
    if merged = '1' then
      return not shift_left(resize(base, SUM_W), SHIFT_MERGED);
    end if;
    return shift_left(resize(base, SUM_W), SHIFT_MODEL);
  end function;

  -- The sum at the scale of FLUX, floored.
  function scaled (sum : signed; merged : std_logic) return signed is
  begin
    if merged = '1' then
      return not resize(sum(SUM_W - 1 downto SHIFT_MERGED), SCALED_W);
    end if;
    return sum(SUM_W - 1 downto SHIFT_MODEL);
  end function;
begin
  valid(0) <= in_valid;

  merged_0   <= merge_known and run when flux_mode /= CURRENT_MODEL else '0';
  factor_d_0 <= rho when merged_0 = '1' else l_d;
  factor_q_0 <= rho when merged_0 = '1' else l_q;
  start_d_0  <= resize(lambda_m_d, FLUX_W + 1) when merged_0 = '1' else
                shift_left(resize(lambda_mg, FLUX_W + 1), PU_TO_FLUX);
  start_q_0  <= resize(lambda_m_q, FLUX_W + 1) when merged_0 = '1' else (others => '0');

  rounded_d_2 <= round_half_up(scaled(sum_d_2, merged_2), DROP);
  rounded_q_2 <= round_half_up(scaled(sum_q_2, merged_2), DROP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = rho*i or l*i;  base = lambda_m or lambda_mg, + lambda_pi
      if valid(0) = '1' then
        merged_1 <= merged_0;
        ended_1  <= merged_0 and (at_end(lambda_m_d) or at_end(lambda_m_q));
        prod_d_1 <= i_d * signed('0' & factor_d_0);
        prod_q_1 <= i_q * signed('0' & factor_q_0);
        base_d_1 <= lambda_pi_d + start_d_0;
        base_q_1 <= lambda_pi_q + start_q_0;
      end if;

      -- Stage 2: sum = base - prod or base + prod
      if valid(1) = '1' then
        ended_2  <= ended_1;
        merged_2 <= merged_1;
        sum_d_2  <= aligned(base_d_1, merged_1) + prod_d_1;
        sum_q_2  <= aligned(base_q_1, merged_1) + prod_q_1;
      end if;

      -- Stage 3: lambda = sum, narrowed
      if valid(2) = '1' then
        lambda_d         <= saturate(rounded_d_2, PU_W);
        lambda_q         <= saturate(rounded_q_2, PU_W);
        estimate_limited <= ended_2 or exceeds(rounded_d_2, PU_W) or exceeds(rounded_q_2, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
