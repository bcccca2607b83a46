-- Purpose: directions that the phase currents will have when the next sample's voltage acts, paper 000 eq. (6).
--   turn = k_ahead*omega_me;  x = i_alpha - turn*i_beta;  y = i_beta + turn*i_alpha
--   s_a = limit(k_sign*x, +-1)
--   s_b = limit(k_sign*(-x + sqrt(3)*y)/2, +-1);  s_c = limit(k_sign*(-x - sqrt(3)*y)/2, +-1)
--   s_alpha, s_beta: their Clarke transform
-- Seven products one after the other, through one multiplier.  The outputs are state: the next sample starts with them.
-- Formats: PU in and out; k_ahead U(1,16), sqrt(3) U(1,16), k_sign U(12,12); products exact.
-- Latency: 15.  Interval: 15.
-- Rounding: every product half up.  turn, x, y and twice each phase current saturate.

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
  constant LATENCY : positive := CURRENT_DIRECTIONS_LATENCY;
  constant WIDE_W  : positive := k_sign'length + 1;
  constant TURN_BY : positive := CURRENT_DIRECTIONS_DROP_TURN;
  constant SUM_W   : positive := PU_W + 2;
  constant ONE_W   : positive := PU_W - 1 + CURRENT_DIRECTIONS_DROP;  -- a product below one

  signal s_a       : signed(PU_W - 1 downto 0);
  signal s_b       : signed(PU_W - 1 downto 0);
  signal s_c       : signed(PU_W - 1 downto 0);
  signal alpha_14  : signed(PU_W - 1 downto 0);
  signal beta_14   : signed(PU_W - 1 downto 0);
  signal valid     : std_logic_vector(0 to LATENCY);
  signal factor    : signed(PU_W - 1 downto 0);             -- turn, y, twice the phase currents
  signal factor_by : signed(WIDE_W - 1 downto 0);
  signal mul_a     : signed(PU_W - 1 downto 0);
  signal mul_b     : signed(WIDE_W - 1 downto 0);
  signal prod      : signed(PU_W + WIDE_W - 1 downto 0);
  signal ahead_x   : signed(SUM_W - 1 downto 0);
  signal ahead_y   : signed(SUM_W - 1 downto 0);
  signal x_4       : signed(PU_W - 1 downto 0);
  signal across    : signed(PU_W downto 0);                 -- sqrt(3)*y at clock 7, its negative at clock 8
  signal twice     : signed(SUM_W - 1 downto 0);
  signal s         : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  vector : entity work.clarke
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => valid(11),
      i_a       => s_a,
      i_b       => s_b,
      i_c       => s_c,
      out_valid => open,
      i_alpha   => alpha_14,
      i_beta    => beta_14
    );

  mul_a <= omega_me when valid(0) = '1' else factor;
  mul_b <= signed(resize(k_ahead, WIDE_W)) when valid(0) = '1' else factor_by;

  ahead_x <= minus_rounded(resize(i_alpha, SUM_W), prod, TURN_BY);
  ahead_y <= plus_rounded(resize(i_beta, SUM_W), prod, TURN_BY);
  twice   <= resize(across, SUM_W) - x_4;

  -- Limited before it is rounded, which needs no comparison: the largest product below one rounds to one.
  s <= round_half_up(saturate(prod, ONE_W), CURRENT_DIRECTIONS_DROP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 3, 4, 6, 7, 9, 10: prod = omega_me*k_ahead, turn*i_beta, turn*i_alpha, sqrt(3)*y, then k_sign
      -- times twice each phase current
      if (valid(0) or valid(2) or valid(3) or valid(5) or valid(6) or valid(8) or valid(9)) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stage 2: turn = prod, narrowed
      if valid(1) = '1' then
        factor    <= round_sat(prod, TURN_BY, PU_W);
        factor_by <= resize(i_beta, WIDE_W);
      end if;

      -- Stage 3: i_alpha follows i_beta
      if valid(2) = '1' then
        factor_by <= resize(i_alpha, WIDE_W);
      end if;

      -- Stage 4: x = i_alpha - prod
      if valid(3) = '1' then
        x_4 <= saturate(ahead_x, PU_W);
      end if;

      -- Stage 5: y = i_beta + prod
      if valid(4) = '1' then
        factor    <= saturate(ahead_y, PU_W);
        factor_by <= resize(CURRENT_DIRECTIONS_SQRT3, WIDE_W);
      end if;

      -- Stage 6: twice = 2*x
      if valid(5) = '1' then
        factor    <= saturate(x_4 & '0', PU_W);
        factor_by <= signed('0' & k_sign);
      end if;

      -- Stage 7: across = prod, narrowed; at most 2*sqrt(3), so it fits
      if valid(6) = '1' then
        across <= resize(round_half_up(prod, CURRENT_DIRECTIONS_DROP_SQRT3), PU_W + 1);
      end if;

      -- Stages 8, 9: twice = across - x, then -across - x
      if valid(7) = '1' then
        across <= -across;
      end if;
      if valid(7) = '1' or valid(8) = '1' then
        factor <= saturate(twice, PU_W);
      end if;

      -- Stages 8, 10, 11: s = prod, limited, narrowed
      if valid(7) = '1' then
        s_a <= s;
      end if;
      if valid(9) = '1' then
        s_b <= s;
      end if;
      if valid(10) = '1' then
        s_c <= s;
      end if;

      -- Stages 12 to 14: Clarke transform;  stage 15: s_alpha, s_beta
      if valid(14) = '1' then
        s_alpha <= alpha_14;
        s_beta  <= beta_14;
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
