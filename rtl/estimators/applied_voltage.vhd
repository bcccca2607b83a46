-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the voltage commanded to the inverter for the coming period, in the stator frame.
--   u_applied_alpha = (2*compare_a - compare_b - compare_c) * u_dc/CARRIER_HALF * 1/3
--   u_applied_beta  = (compare_b - compare_c)               * u_dc/CARRIER_HALF * 1/sqrt(3)
-- voltage_known = 0: the gates are off, or the bus reading is at its end or below 1/32 per unit.
-- One pipeline for both axes: alpha, then beta a clock later, whose clocks are those of alpha with b in the place of a.
-- Formats: compare values in clocks; u_dc*2**SHIFT/CARRIER_HALF U(2,22), with SHIFT such that the constant is in
-- [1, 2); out FLUX.
-- Latency: 11 (alpha, then beta).  Interval: 11.
-- Rounding: half up after each product.  No saturation: compare values are at most CARRIER_HALF, so the voltage is at
-- most 2/3*u_dc.

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
  constant CLOCK_W : positive := 17;  -- up to 2*32767 clocks, with a sign
  constant U_W     : positive := SCALE_W + CLOCK_W + 2 - (SHIFT - APPLIED_VOLTAGE_TO_FLUX);

  constant NOTHING : signed(0 downto 0) := "0";

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

  signal valid         : std_logic_vector(0 to LATENCY);
  signal by_u_dc       : signed(U_DC_W downto 0);
  signal scale_3       : signed(SCALE_W downto 0);
  signal scale_4       : signed(SCALE_W downto 0);
  signal coefficient_4 : signed(COEFF_W - 1 downto 0);
  signal prod_5        : signed(SCALE_W + COEFF_W downto 0);
  signal first_4       : unsigned(15 downto 0);
  signal part_5        : signed(CLOCK_W - 1 downto 0);
  signal clocks_6      : signed(CLOCK_W - 1 downto 0);
  signal scaled_6      : signed(SCALE_W downto 0);
  signal u_9           : signed(U_W - 1 downto 0);

  -- A compare value, widened for the differences of compare values.
  function wide (compare : unsigned) return signed is
  begin
    return signed(resize(compare, CLOCK_W));
  end function;
begin
  valid(0) <= in_valid;
  by_u_dc  <= signed('0' & u_dc);

  -- Stages 1 to 3: scale = u_dc * 2**SHIFT/CARRIER_HALF
  bus_per_clock : entity work.multiply_add
    generic map (DROP => APPLIED_VOLTAGE_DROP_SCALE)
    port map (clk => clk, a => by_u_dc, b => K_CARRIER, c => NOTHING, y => scale_3, limited => open);

  -- Stages 7 to 9: u = scaled*clocks
  voltage : entity work.multiply_add
    generic map (DROP => SHIFT - APPLIED_VOLTAGE_TO_FLUX)
    port map (clk => clk, a => scaled_6, b => clocks_6, c => NOTHING, y => u_9, limited => open);

  first_4 <= compare_b when valid(5) = '1' else compare_a;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 4, 5: prod = scale*coefficient;  part = 2*first - compare_b
      scale_4       <= scale_3;
      coefficient_4 <= APPLIED_VOLTAGE_INV_SQRT3 when valid(4) = '1' else APPLIED_VOLTAGE_THIRD;
      prod_5        <= scale_4 * coefficient_4;
      part_5        <= shift_left(wide(first_4), 1) - wide(compare_b);

      -- Stage 6: scaled = prod, rounded;  clocks = part - compare_c
      scaled_6 <= resize(round_half_up(prod_5, APPLIED_VOLTAGE_DROP_THIRD), SCALE_W + 1);
      if valid(6) = '1' then
        scaled_6 <= resize(round_half_up(prod_5, APPLIED_VOLTAGE_DROP_INV_SQRT3), SCALE_W + 1);
      end if;
      clocks_6 <= part_5 - wide(compare_c);

      -- Stages 10, 11: the voltages, and whether they are known
      if valid(9) = '1' then
        u_applied_alpha <= resize(u_9, FLUX_W);
      end if;
      if valid(10) = '1' then
        u_applied_beta <= resize(u_9, FLUX_W);
        voltage_known  <= '0';
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
