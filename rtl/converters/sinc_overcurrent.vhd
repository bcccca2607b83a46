-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: short third-order sinc filter of a modulator's bits for fast overcurrent alone.
--   acc_1 += bit;  acc_2 += acc_1;  acc_3 += acc_2     at every bit, each from the values before
--   total = third difference of acc_3 over oversampling bits, every oversampling bits: 0 to oversampling**3
--   over  = total >= limit_high or total <= limit_low  until the next total
-- It runs all the time, without a trigger; over is for the pin trip of the core, which latches it.
-- Wrap: the accumulators wrap modulo 2**16 by design; total is at most 2**15, and differences of wrapped numbers are
-- the same modulo 2**16 as of unwrapped ones.  The first three totals after a reset see less than a window and never
-- trip.
-- Formats: counts.  Latency: 1 (every clock is a sample; over five clocks after the last bit).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity sinc_overcurrent is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    mod_bit      : in  std_logic;
    bits_valid   : in  std_logic;
    oversampling : in  unsigned(5 downto 0);
    limit_high   : in  unsigned(15 downto 0);
    limit_low    : in  unsigned(15 downto 0);
    over         : out std_logic;
    total        : out unsigned(15 downto 0);
    total_valid  : out std_logic
  );
end entity sinc_overcurrent;

architecture rtl of sinc_overcurrent is
  constant W : positive := SINC_OVERCURRENT_TOTAL_W;

  type state_t is record
    acc_1     : unsigned(W - 1 downto 0);
    acc_2     : unsigned(W - 1 downto 0);
    acc_3     : unsigned(W - 1 downto 0);
    last_1    : unsigned(W - 1 downto 0);  -- of the differences, rotating: acc_3, first, second
    last_2    : unsigned(W - 1 downto 0);
    last_3    : unsigned(W - 1 downto 0);
    bits_left : unsigned(5 downto 0);      -- until the next total
    seen      : unsigned(1 downto 0);      -- totals since the reset, WARM at most
  end record state_t;

  signal state : state_t;

  signal valid   : std_logic_vector(0 to 5);
  signal total_4 : unsigned(W - 1 downto 0);
begin
  valid(0) <= bits_valid when state.bits_left = 0 else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      -- Integrators, modulo 2**W
      if bits_valid = '1' then
        if mod_bit = '1' then
          state.acc_1 <= state.acc_1 + 1;
        end if;
        state.acc_2 <= state.acc_2 + state.acc_1;
        state.acc_3 <= state.acc_3 + state.acc_2;
      end if;

      -- Every oversampling bits
      if valid(0) = '1' then
        state.bits_left <= oversampling - 1;
      elsif bits_valid = '1' then
        state.bits_left <= state.bits_left - 1;
      end if;
      valid(1 to 5) <= valid(0 to 4);

      -- Stages 1 to 4: total = acc_3, then three differences with the last ones, modulo 2**W
      if valid(0) = '1' then
        total_4 <= state.acc_3;
      elsif (or valid(1 to 3)) = '1' then
        total_4      <= total_4 - state.last_1;
        state.last_1 <= state.last_2;
        state.last_2 <= state.last_3;
        state.last_3 <= total_4;
      end if;

      -- Stage 5: over = total beyond a limit
      if valid(4) = '1' then
        total <= total_4;
        if state.seen = SINC_OVERCURRENT_WARM then
          over <= (total_4 ?>= limit_high) or (total_4 ?<= limit_low);
        else
          state.seen <= state.seen + 1;
        end if;
      end if;

      if rst = '1' then
        state.acc_1     <= (others => '0');
        state.acc_2     <= (others => '0');
        state.acc_3     <= (others => '0');
        state.last_1    <= (others => '0');
        state.last_2    <= (others => '0');
        state.last_3    <= (others => '0');
        state.bits_left <= (others => '0');
        state.seen      <= (others => '0');
        valid(1 to 5)   <= (others => '0');
        over            <= '0';
        total           <= (others => '0');
      end if;
    end if;
  end process;

  total_valid <= valid(5);

end architecture rtl;
