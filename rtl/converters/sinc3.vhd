-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: third-order sinc filter of a delta-sigma modulator's bits, one result for each trigger.
--   acc_1 += weight*bit;  acc_2 += acc_1;  acc_3 += acc_2   at every bit, each from the values before
--   total = third difference of acc_3 over four instants, oversampling bits apart
--   code  = total * gain * 2**(ADC_BITS - 24): 0 to 1 is the density of ones
-- Window: the first instant is the first bit with bits_valid 2 + start_clocks clocks after the trigger or later.  The
-- result weighs this bit and the following 3*(oversampling - 1) symmetrically.
-- weight: 1, 8, 64, 512 for an oversampling of 129..256, 65..128, 33..64, 32: total is at most 2**24.
-- Wrap: the accumulators wrap modulo 2**25 by design; their difference over the window is at most 2**24, and
-- differences of wrapped numbers are the same modulo 2**25 as of unwrapped ones.
-- window_error: a window ends without a result, because the next one starts, or a trigger comes too early.
-- Formats: gain U(3,14), code U(0,ADC_BITS).  Latency: 1 (every clock is a sample; code six clocks after its last bit).
-- Rounding: total loses its lowest bit, the product is rounded half up and saturated at all ones.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sinc3 is
  generic (
    ADC_BITS : positive range 12 to 16 := 16
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    sample_trigger : in  std_logic;
    mod_bit        : in  std_logic;
    bits_valid     : in  std_logic;
    oversampling   : in  unsigned(8 downto 0);
    gain           : in  unsigned(16 downto 0);
    start_clocks   : in  unsigned(15 downto 0);
    code           : out unsigned(ADC_BITS - 1 downto 0);
    code_valid     : out std_logic;
    window_error   : out std_logic
  );
end entity sinc3;

architecture rtl of sinc3 is
  constant W    : positive := SINC3_TOTAL_W;
  constant DROP : positive := SINC3_PRODUCT - ADC_BITS;

  type state_t is record
    acc_1     : unsigned(W - 1 downto 0);
    acc_2     : unsigned(W - 1 downto 0);
    acc_3     : unsigned(W - 1 downto 0);
    last_1    : unsigned(W - 1 downto 0);  -- of the differences, rotating: acc_3, first, second
    last_2    : unsigned(W - 1 downto 0);
    last_3    : unsigned(W - 1 downto 0);
    waiting   : std_logic;                 -- start_clocks are counted
    remaining : unsigned(15 downto 0);
    armed     : std_logic;                 -- the next bit is the first of a window
    window    : std_logic;                 -- a window is open
    bits_left : unsigned(8 downto 0);      -- until the next instant
    instant   : unsigned(1 downto 0);
  end record state_t;

  signal state : state_t;

  signal weight : unsigned(9 downto 0);
  signal starts : std_logic;
  signal first  : std_logic;
  signal later  : std_logic;
  signal valid  : std_logic_vector(0 to 6);
  signal total  : unsigned(W - 1 downto 0);
  signal prod_5 : signed(W + 17 downto 0);
  signal sum_5  : signed(W + 17 downto 0);
begin
  weight <= 10d"1" when oversampling > 128 else 10d"8" when oversampling > 64 else 10d"64" when oversampling > 32 else
            10d"512";
  starts <= state.waiting when state.remaining = 0 else '0';
  first  <= bits_valid and state.armed;
  later  <= bits_valid and state.window and not first when state.bits_left = 0 else '0';
  sum_5  <= prod_5 + half(DROP, W + 18);

  valid(0) <= first or later;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Integrators, modulo 2**W
      if bits_valid = '1' then
        if mod_bit = '1' then
          state.acc_1 <= state.acc_1 + weight;
        end if;
        state.acc_2 <= state.acc_2 + state.acc_1;
        state.acc_3 <= state.acc_3 + state.acc_2;
      end if;

      -- Start of the window
      if state.waiting = '1' and starts = '0' then
        state.remaining <= state.remaining - 1;
      end if;
      if first = '1' then
        state.armed <= '0';
      end if;
      if starts = '1' then
        state.waiting <= '0';
        state.armed   <= '1';
      end if;
      if sample_trigger = '1' then
        state.waiting   <= '1';
        state.remaining <= start_clocks;
      end if;

      -- Instants of the window
      if first = '1' then
        state.window    <= '1';
        state.bits_left <= oversampling - 1;
        state.instant   <= (others => '0');
      elsif later = '1' then
        state.window    <= '1' when state.instant + 1 < SINC3_INSTANTS else '0';
        state.bits_left <= oversampling - 1;
        state.instant   <= state.instant + 1;
      elsif bits_valid = '1' and state.window = '1' then
        state.bits_left <= state.bits_left - 1;
      end if;
      window_error <= (first and state.window) or (starts and state.armed)
                      or (sample_trigger and state.waiting and not starts);

      valid(1 to 6) <= valid(0 to 5);
      valid(4)      <= valid(3) when state.instant = SINC3_INSTANTS else '0';

      -- Stages 1 to 4: total = acc_3, then three differences with the last ones, modulo 2**W
      if valid(0) = '1' then
        total <= state.acc_3;
      elsif (or valid(1 to 3)) = '1' then
        total        <= total - state.last_1;
        state.last_1 <= state.last_2;
        state.last_2 <= state.last_3;
        state.last_3 <= total;
      end if;

      -- Stage 5: prod = total/2 * gain
      if valid(4) = '1' then
        prod_5 <= signed('0' & total(W - 1 downto 1)) * signed('0' & gain);
      end if;

      -- Stage 6: code = prod, rounded and saturated
      if valid(5) = '1' then
        code <= saturate_u(sum_5(W + 17 downto DROP), ADC_BITS);
      end if;

      if rst = '1' then
        state.acc_1     <= (others => '0');
        state.acc_2     <= (others => '0');
        state.acc_3     <= (others => '0');
        state.last_1    <= (others => '0');
        state.last_2    <= (others => '0');
        state.last_3    <= (others => '0');
        state.waiting   <= '0';
        state.remaining <= (others => '0');
        state.armed     <= '0';
        state.window    <= '0';
        state.bits_left <= (others => '0');
        state.instant   <= (others => '0');
        valid(1 to 6)   <= (others => '0');
        code            <= (others => '0');
        window_error    <= '0';
      end if;
    end if;
  end process;

  code_valid <= valid(6);

end architecture rtl;
