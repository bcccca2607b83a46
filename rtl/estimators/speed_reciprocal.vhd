-- Purpose: 1/omega_me for delta_lambda, fading out towards standstill.
--   factor * 2**n_omega = weight/omega_me;  weight = limit((|omega_me| - omega_min)*k_ramp, 0, 1)
-- Formats: |omega_me| U(1,16), at least 2**-12 in the reciprocal; k_ramp U(12,4), weight U(1,16), factor S(0,17).
-- Latency: 24.  Interval: 24, as the quotient of the reciprocal needs one clock per bit.
-- Rounding: weight and |factor| half up.  |omega_me| = 2 is replaced by the next smaller number; factor fits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed_reciprocal is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    omega_me  : in  signed(PU_W - 1 downto 0);
    omega_min : in  unsigned(16 downto 0);
    k_ramp    : in  unsigned(15 downto 0);
    out_valid : out std_logic;
    factor    : out signed(RECIPROCAL_W downto 0);
    n_omega   : out unsigned(3 downto 0)
  );
end entity speed_reciprocal;

architecture rtl of speed_reciprocal is
  constant LATENCY  : positive := SPEED_RECIPROCAL_LATENCY;
  constant WEIGHT_W : positive := DUTY_W;

  signal valid       : std_logic_vector(0 to LATENCY);
  signal size_0      : signed(PU_W downto 0);
  signal magnitude_1 : unsigned(U_DC_W - 1 downto 0);
  signal above_1     : signed(U_DC_W downto 0);
  signal above_2     : signed(U_DC_W downto 0);
  signal prod_3      : signed(U_DC_W + k_ramp'length + 1 downto 0);
  signal sum_4       : signed(U_DC_W + k_ramp'length + 2 downto 0);
  signal ramp_4      : signed(U_DC_W + k_ramp'length + 2 - SPEED_RECIPROCAL_DROP_WEIGHT downto 0);
  signal past_5      : std_logic;
  signal weight_6    : unsigned(WEIGHT_W - 1 downto 0);
  signal m_22        : unsigned(RECIPROCAL_W - 1 downto 0);
  signal prod_23     : signed(RECIPROCAL_W + WEIGHT_W + 1 downto 0);
  signal turned_23   : signed(RECIPROCAL_W + WEIGHT_W + 2 - SPEED_RECIPROCAL_DROP_FACTOR downto 0);
begin
  valid(0) <= in_valid;

  inverse : entity work.reciprocal
    generic map (
      N_MAX => SPEED_RECIPROCAL_N_MAX
    )
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => valid(1),
      x         => magnitude_1,
      out_valid => open,
      m         => m_22,
      n         => n_omega,
      low       => open
    );

  size_0  <= abs(resize(omega_me, PU_W + 1));
  above_1 <= signed('0' & magnitude_1) - signed('0' & omega_min);
  ramp_4  <= sum_4(sum_4'high downto SPEED_RECIPROCAL_DROP_WEIGHT);

  -- The complement turns rounding half up into half down, as the negative of a number rounded half up requires.
  turned_23 <= not prod_23(prod_23'high downto SPEED_RECIPROCAL_DROP_FACTOR - 1) when omega_me < 0 else
               prod_23(prod_23'high downto SPEED_RECIPROCAL_DROP_FACTOR - 1);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: magnitude = min(|omega_me|, the largest number below 2)
      if valid(0) = '1' then
        magnitude_1 <= saturate_u(size_0, U_DC_W);
      end if;

      -- Stage 2: above = max(magnitude - omega_min, 0); in parallel, 2 to 22: the reciprocal
      if valid(1) = '1' then
        above_2 <= above_1;
        if above_1 < 0 then
          above_2 <= (others => '0');
        end if;
      end if;

      -- Stage 3: prod = above * k_ramp
      if valid(2) = '1' then
        prod_3 <= above_2 * signed('0' & k_ramp);
      end if;

      -- Stages 4 to 6: weight = prod, narrowed, at most 1
      if valid(3) = '1' then
        sum_4 <= rounding_base("0", SPEED_RECIPROCAL_DROP_WEIGHT, sum_4'length) + prod_3;
      end if;
      if valid(4) = '1' then
        past_5 <= '0';
        if ramp_4(ramp_4'high downto WEIGHT_W - 1) /= 0 then
          past_5 <= '1';
        end if;
      end if;
      if valid(5) = '1' then
        weight_6 <= unsigned(ramp_4(WEIGHT_W - 1 downto 0));
        if past_5 = '1' then
          weight_6 <= to_unsigned(SPEED_RECIPROCAL_WEIGHT_ONE, WEIGHT_W);
        end if;
      end if;

      -- Stage 23: prod = m * weight
      if valid(22) = '1' then
        prod_23 <= signed('0' & m_22) * signed('0' & weight_6);
      end if;

      -- Stage 24: factor = prod, narrowed, with the sign of omega_me; m*weight < 1, so it fits
      if valid(23) = '1' then
        factor <= resize(round_half_up(turned_23, 1), RECIPROCAL_W + 1);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
