-- Purpose: the voltage commanded to the inverter for the coming period, in the stator frame; alpha first, then beta.
--   u_applied_alpha = (2*compare_a - compare_b - compare_c) * u_dc/CARRIER_HALF * 1/3
--   u_applied_beta  = (compare_b - compare_c)               * u_dc/CARRIER_HALF * 1/sqrt(3)
-- voltage_known = 0: the gates are off, or the bus reading is at its end or below 1/32 per unit.
-- Formats: compare values in clocks; u_dc*2**SHIFT/CARRIER_HALF U(2,22), with SHIFT such that the constant is in
-- [1, 2); out FLUX.
-- Latency: 11 (alpha, then beta).  Interval: 11.
-- Rounding: half up after each product.  Saturated; compare values up to CARRIER_HALF do not reach the limit.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity applied_voltage is
  generic (
    CARRIER_HALF : positive range 8 to 32767 := 10000
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    compare_a       : in  unsigned(15 downto 0);
    compare_b       : in  unsigned(15 downto 0);
    compare_c       : in  unsigned(15 downto 0);
    u_dc            : in  unsigned(U_DC_W - 1 downto 0);
    u_dc_at_rail    : in  std_logic;
    run             : in  std_logic;
    out_valid       : out std_logic;
    u_applied_alpha : out signed(FLUX_W - 1 downto 0);
    u_applied_beta  : out signed(FLUX_W - 1 downto 0);
    voltage_known   : out std_logic
  );
end entity applied_voltage;

architecture rtl of applied_voltage is

  -- Smallest n with 2**n >= CARRIER_HALF.
  function carrier_shift return natural is
    variable n : natural := 0;
  begin
    while 2 ** n < CARRIER_HALF loop
      n := n + 1;
    end loop;
    return n;
  end function;

  constant LATENCY : positive := APPLIED_VOLTAGE_LATENCY;
  constant SCALE_W : positive := APPLIED_VOLTAGE_SCALE_W;
  constant COEFF_W : positive := APPLIED_VOLTAGE_THIRD'length;
  constant SHIFT   : positive := carrier_shift;
  constant SUM_W   : positive := 18;

  -- 2**SHIFT/CARRIER_HALF, half up; divided bit by bit, because 2**(K_FRAC + SHIFT) may exceed an integer.
  function carrier_constant return natural is
    variable remainder : natural := 2 ** SHIFT;
    variable quotient  : natural := 0;
  begin
    for k in 0 to APPLIED_VOLTAGE_K_FRAC loop
      quotient := 2 * quotient;
      if remainder >= CARRIER_HALF then
        quotient  := quotient + 1;
        remainder := remainder - CARRIER_HALF;
      end if;
      remainder := 2 * remainder;
    end loop;
    if remainder >= CARRIER_HALF then
      quotient := quotient + 1;
    end if;
    return quotient;
  end function;

  constant K_CARRIER : signed(17 downto 0) := to_signed(carrier_constant, 18);

  -- Half an LSB for each product, added in the adder behind its multiplier
  constant PROD_1_W   : positive                      := U_DC_W + K_CARRIER'length + 1;
  constant PROD_8_W   : positive                      := SCALE_W + SUM_W + 1;
  constant HALF_SCALE : signed(PROD_1_W - 1 downto 0) := half(APPLIED_VOLTAGE_DROP_SCALE, PROD_1_W);
  constant HALF_U     : signed(PROD_8_W - 1 downto 0) := half(SHIFT - APPLIED_VOLTAGE_TO_FLUX, PROD_8_W);

  signal valid    : std_logic_vector(0 to LATENCY);
  signal prod_1   : signed(PROD_1_W - 1 downto 0);
  signal sum_2    : signed(PROD_1_W - 1 downto 0);
  signal scale_2  : signed(SCALE_W downto 0);
  signal coeff_3  : signed(COEFF_W - 1 downto 0);
  signal prod_4   : signed(SCALE_W + COEFF_W downto 0);
  signal half_4   : signed(SCALE_W + COEFF_W downto 0);
  signal sum_5    : signed(SCALE_W + COEFF_W downto 0);
  signal first_5  : unsigned(15 downto 0);
  signal scaled_6 : signed(SCALE_W downto 0);
  signal part_6   : signed(SUM_W - 1 downto 0);
  signal clocks_7 : signed(SUM_W - 1 downto 0);
  signal scaled_7 : signed(SCALE_W downto 0);
  signal prod_8   : signed(PROD_8_W - 1 downto 0);
  signal sum_9    : signed(PROD_8_W - 1 downto 0);
  signal u_9      : signed(FLUX_W - 1 downto 0);

  -- A compare value, widened for the differences of compare values.
  function wide (compare : unsigned) return signed is
  begin
    return signed(resize(compare, SUM_W));
  end function;
begin
  valid(0) <= in_valid;

  -- u_dc and the constant are below 2, so the product fits.
  scale_2 <= resize(sum_2(sum_2'high downto APPLIED_VOLTAGE_DROP_SCALE), SCALE_W + 1);

  -- The axis of this clock: alpha first, then beta, whose sum is that of alpha with b in the place of a.
  half_4  <= half(APPLIED_VOLTAGE_DROP_INV_SQRT3, SCALE_W + COEFF_W + 1) when valid(5) = '1' else
             half(APPLIED_VOLTAGE_DROP_THIRD, SCALE_W + COEFF_W + 1);
  first_5 <= compare_b when valid(6) = '1' else compare_a;
  u_9     <= saturate(sum_9(sum_9'high downto SHIFT - APPLIED_VOLTAGE_TO_FLUX), FLUX_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: scale = u_dc * 2**SHIFT/CARRIER_HALF
      if valid(0) = '1' then
        prod_1 <= signed('0' & u_dc) * K_CARRIER;
      end if;
      if valid(1) = '1' then
        sum_2 <= prod_1 + HALF_SCALE;
      end if;

      -- Stages 4 to 6: scaled = scale * 1/3 or 1/sqrt(3);  part = 2*first - compare_b
      coeff_3 <= APPLIED_VOLTAGE_INV_SQRT3 when valid(3) = '1' else APPLIED_VOLTAGE_THIRD;
      if valid(3) = '1' or valid(4) = '1' then
        prod_4 <= scale_2 * coeff_3;
      end if;
      if valid(4) = '1' or valid(5) = '1' then
        sum_5 <= prod_4 + half_4;
      end if;
      if valid(5) = '1' or valid(6) = '1' then
        scaled_6 <= sum_5(SCALE_W + APPLIED_VOLTAGE_DROP_THIRD downto APPLIED_VOLTAGE_DROP_THIRD);
        if valid(6) = '1' then
          scaled_6 <= sum_5(SCALE_W + APPLIED_VOLTAGE_DROP_INV_SQRT3 downto APPLIED_VOLTAGE_DROP_INV_SQRT3);
        end if;
        part_6 <= shift_left(wide(first_5), 1) - wide(compare_b);
      end if;

      -- Stage 7: clocks = part - compare_c
      if valid(6) = '1' or valid(7) = '1' then
        scaled_7 <= scaled_6;
        clocks_7 <= part_6 - wide(compare_c);
      end if;

      -- Stages 8, 9: u = scaled * clocks
      if valid(7) = '1' or valid(8) = '1' then
        prod_8 <= scaled_7 * clocks_7;
      end if;
      if valid(8) = '1' or valid(9) = '1' then
        sum_9 <= prod_8 + HALF_U;
      end if;

      -- Stage 10: u_applied = u, narrowed; alpha at clock 10, shifted on from beta's register, beta at 11
      if valid(9) = '1' or valid(10) = '1' then
        u_applied_beta  <= u_9;
        u_applied_alpha <= u_applied_beta;
      end if;
      if valid(10) = '1' then
        voltage_known <= '0';
        if run = '1' and u_dc_at_rail = '0' and u_dc >= U_DC_PROCESSING_U_DC_MIN then
          voltage_known <= '1';
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
