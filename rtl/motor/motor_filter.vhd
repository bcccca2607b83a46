-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a filter of first order between the phase currents and their converters, once a step of the motor.
--   y += k*(i - y);  k = 0: no filter, y is as with the largest k
-- Phases a, b, c go round in a ring of three registers: the one that leaves it is multiplied and enters again.
-- Formats: i PU; y S(1,39), cut to S(1,22) where it is multiplied, to PU at the outputs; k U(0,17).
-- Latency: 7.  Interval: 7.
-- Rounding: the two cuts alone; the product has the bits of y, whose sum stays within the range of i.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_filter is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_a       : in  signed(PU_W - 1 downto 0);
    i_b       : in  signed(PU_W - 1 downto 0);
    i_c       : in  signed(PU_W - 1 downto 0);
    k_filter  : in  unsigned(16 downto 0);
    out_valid : out std_logic;
    y_a       : out signed(PU_W - 1 downto 0);
    y_b       : out signed(PU_W - 1 downto 0);
    y_c       : out signed(PU_W - 1 downto 0)
  );
end entity motor_filter;

architecture rtl of motor_filter is
  constant LATENCY : positive := MOTOR_FILTER_LATENCY;
  constant Y_W     : positive := PU_W + MOTOR_FILTER_DROP_OUT;
  constant SEEN_W  : positive := Y_W - MOTOR_FILTER_DROP_SEEN;
  constant K_W     : positive := 18;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal i_0    : signed(PU_W - 1 downto 0);
  signal k_0    : unsigned(16 downto 0);
  signal k_1    : signed(K_W - 1 downto 0);
  signal d_1    : signed(SEEN_W downto 0);
  signal y_1    : signed(Y_W - 1 downto 0);  -- state, as y_2 and y_3: at rest c, b, a
  signal prod_2 : signed(SEEN_W + K_W downto 0);
  signal y_2    : signed(Y_W - 1 downto 0);
  signal y_3    : signed(Y_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The phase that enters: a, then b, then c
  i_0 <= i_b when valid(1) = '1' else i_c when valid(2) = '1' else i_a;
  k_0 <= (others => '1') when k_filter = 0 else k_filter;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: d = i - y
      d_1 <= shift_left(resize(i_0, SEEN_W + 1), MOTOR_FILTER_LIFT) - y_3(Y_W - 1 downto MOTOR_FILTER_DROP_SEEN);
      k_1 <= signed('0' & k_0);

      -- Stage 2: prod = k*d
      prod_2 <= d_1 * k_1;

      -- Stage 3: y = y + prod; the ring goes round twice, the first two and the last turn add nothing
      if (or valid(0 to 5)) = '1' then
        y_1 <= y_3;
        y_2 <= y_1;
        y_3 <= y_2;
        if (or valid(2 to 4)) = '1' then
          y_3 <= resize(y_2 + prod_2, Y_W);
        end if;
      end if;

      -- Stage 7: all three
      if valid(6) = '1' then
        y_a <= y_3(Y_W - 1 downto MOTOR_FILTER_DROP_OUT);
        y_b <= y_2(Y_W - 1 downto MOTOR_FILTER_DROP_OUT);
        y_c <= y_1(Y_W - 1 downto MOTOR_FILTER_DROP_OUT);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        y_1                 <= (others => '0');
        y_2                 <= (others => '0');
        y_3                 <= (others => '0');
        y_a                 <= (others => '0');
        y_b                 <= (others => '0');
        y_c                 <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
