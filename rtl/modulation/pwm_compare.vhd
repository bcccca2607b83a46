-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: duties to compare values of the carrier, compare = duty * CARRIER_HALF, short pulses dropped.
--   2*compare < min_pulse: 0;  CARRIER_HALF - compare < min_pulse: CARRIER_HALF
-- Each low end of a period counts alone, because the period before or after may be high throughout.  With double_update
-- each half of the high pulse counts alone for the same reason: compare < min_pulse: 0.
-- One pipeline for the three legs: a, then b and c, each a clock later.
-- Formats: duty U(1,16), 0 to 1; compare 0 to CARRIER_HALF; min_pulse in clocks.
-- Latency: 7.  Interval: 3.  The three values change together.
-- Rounding: half up to whole clocks; no overflow, duty <= 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity pwm_compare is
  generic (
    CARRIER_HALF : positive range 8 to 32767 := 10000
  );
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    duty_a        : in  unsigned(DUTY_W - 1 downto 0);
    duty_b        : in  unsigned(DUTY_W - 1 downto 0);
    duty_c        : in  unsigned(DUTY_W - 1 downto 0);
    min_pulse     : in  unsigned(11 downto 0);
    double_update : in  std_logic;
    out_valid     : out std_logic;
    compare_a     : out unsigned(15 downto 0);
    compare_b     : out unsigned(15 downto 0);
    compare_c     : out unsigned(15 downto 0)
  );
end entity pwm_compare;

architecture rtl of pwm_compare is
  constant LATENCY  : positive              := PWM_COMPARE_LATENCY;
  constant HALF     : unsigned(15 downto 0) := to_unsigned(CARRIER_HALF, 16);
  constant RESULT_W : positive              := 19 + DUTY_W - PWM_COMPARE_DROP;  -- nothing to saturate

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid     : std_logic_vector(0 to LATENCY);
  signal duty_0    : signed(DUTY_W downto 0);
  signal by_half   : signed(16 downto 0);
  signal result_3  : signed(RESULT_W - 1 downto 0);
  signal compare_3 : unsigned(15 downto 0);
  signal longest   : signed(17 downto 0);  -- from clock 1 on
  signal shortest  : unsigned(12 downto 0);  -- of 2*compare, from clock 1 on
  signal room_3    : signed(17 downto 0);
  signal compare_4 : unsigned(15 downto 0);
  signal short_4   : std_logic;
  signal long_4    : std_logic;
  signal dropped_4 : unsigned(15 downto 0);
  signal kept_a_5  : unsigned(15 downto 0);
  signal kept_b_6  : unsigned(15 downto 0);
begin
  valid(0) <= in_valid;

  -- The leg that enters: a, then b, then c
  duty_0  <= signed('0' & duty_b) when valid(1) = '1' else signed('0' & duty_c) when valid(2) = '1' else
             signed('0' & duty_a);
  by_half <= signed('0' & HALF);

  -- Stages 1 to 3: compare = duty*CARRIER_HALF in clocks
  compare_part : entity work.multiply_add
    generic map (DROP => PWM_COMPARE_DROP)
    port map (clk => clk, a => duty_0, b => by_half, c => NOTHING, y => result_3, limited => open);

  compare_3 <= unsigned(result_3(15 downto 0));

  -- Negative if the low end is too short; only the sign is used, so that nothing follows the carry chain
  room_3 <= longest - signed(resize(compare_3, 18));

  dropped_4 <= to_unsigned(0, 16) when short_4 = '1' else HALF when long_4 = '1' else compare_4;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: longest = CARRIER_HALF - min_pulse;  shortest = min_pulse, twice that with double_update
      longest  <= signed(resize(HALF, 18)) - signed(resize(min_pulse, 18));
      shortest <= min_pulse & '0' when double_update = '1' else '0' & min_pulse;

      -- Stage 4: whether the high pulse or a low end is too short
      compare_4 <= compare_3;
      short_4   <= '1' when (compare_3 & '0') < shortest else '0';
      long_4    <= room_3(17);

      -- Stages 5, 6, 7: short pulses dropped;  a and b wait for c
      if valid(4) = '1' then
        kept_a_5 <= dropped_4;
      end if;
      if valid(5) = '1' then
        kept_b_6 <= dropped_4;
      end if;
      if valid(6) = '1' then
        compare_a <= kept_a_5;
        compare_b <= kept_b_6;
        compare_c <= dropped_4;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        compare_a           <= (others => '0');
        compare_b           <= (others => '0');
        compare_c           <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
