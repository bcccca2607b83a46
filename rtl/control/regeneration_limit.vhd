-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: limits the current that brakes, so that what braking feeds back does not charge the bus up to its trip.
--   most    = max(i_max - regen_slope*max(u_dc - regen_start, 0), 0), of the last sample
--   i_q_ref = limit(i_q_asked, +-most) while i_q_asked brakes (i_q_asked*omega_me < 0), else i_q_asked
-- regen_slope = 0: no limit.  The limit acts one sample late: its product is made bit by bit, one bit a clock, without a
-- multiplier, beside everything else.
-- Formats: current and speed PU, voltage U(1,16), slope U(8,8), product exact.
-- Latency: 1.  Interval: SLOPE_W + 3.
-- Rounding: the product is cut (floor) to PU, the limit is up to an LSB too high.  No overflow: it saturates at zero.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity regeneration_limit is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    i_q_asked     : in  signed(PU_W - 1 downto 0);
    omega_me      : in  signed(PU_W - 1 downto 0);
    u_dc          : in  unsigned(DUTY_W - 1 downto 0);
    i_max         : in  signed(PU_W - 1 downto 0);
    regen_start   : in  unsigned(DUTY_W - 1 downto 0);
    regen_slope   : in  unsigned(REGENERATION_LIMIT_SLOPE_W - 1 downto 0);
    out_valid     : out std_logic;
    i_q_ref       : out signed(PU_W - 1 downto 0);
    regen_limited : out std_logic
  );
end entity regeneration_limit;

architecture rtl of regeneration_limit is
  constant SLOPE_W : positive := REGENERATION_LIMIT_SLOPE_W;
  constant DROP    : positive := REGENERATION_LIMIT_DROP;
  constant LEFT_W  : positive := DUTY_W + SLOPE_W - DROP + 1;

  type state_t is record
    most : unsigned(PU_W - 2 downto 0);
  end record state_t;

  signal state : state_t;

  signal braking_0 : std_logic;
  signal past_0    : std_logic;
  signal busy      : std_logic;
  signal count     : natural range 0 to SLOPE_W;
  signal over_0    : signed(DUTY_W downto 0);
  signal over_1    : unsigned(DUTY_W - 1 downto 0);  -- what the bus is above regen_start
  signal upper     : unsigned(DUTY_W - 1 downto 0);  -- product, upper part
  signal lower     : unsigned(SLOPE_W - 1 downto 0);  -- bits of regen_slope that are left, below those of the product
  signal sum       : unsigned(DUTY_W downto 0);
  signal product   : unsigned(DUTY_W + SLOPE_W - 1 downto 0);
  signal left      : signed(LEFT_W - 1 downto 0);  -- i_max - product
begin
  -- A speed of zero has no direction that a current could brake
  braking_0 <= (i_q_asked(PU_W - 1) xor omega_me(PU_W - 1)) and (or omega_me);
  past_0    <= beyond(i_q_asked, state.most, 0) and braking_0;
  over_0    <= signed('0' & u_dc) - signed('0' & regen_start);

  -- Step k of the product: upper = (upper + over*bit k of regen_slope)/2
  sum     <= ('0' & upper) + (over_1 and lower(0));
  product <= upper & lower;
  left    <= resize(i_max, LEFT_W) - signed('0' & product(product'high downto DROP));

  process (clk)
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: i_q_ref = i_q_asked, limited where it brakes;  over = u_dc - regen_start, not below zero
      if in_valid = '1' then
        i_q_ref       <= i_q_asked;
        regen_limited <= past_0;
        if past_0 = '1' then
          i_q_ref <= within(i_q_asked, state.most, 0);
        end if;
        over_1 <= unsigned(over_0(DUTY_W - 1 downto 0)) and not over_0(DUTY_W);
        upper  <= (others => '0');
        lower  <= regen_slope;
        count  <= 0;
        busy   <= '1';
      elsif busy = '1' then
        -- Stages 2 to SLOPE_W + 1: product = over*regen_slope;  then most = i_max - product, not below zero
        if count = SLOPE_W then
          state.most <= unsigned(left(PU_W - 2 downto 0)) and not left(LEFT_W - 1);
          busy       <= '0';
        else
          upper <= sum(DUTY_W downto 1);
          lower <= sum(0) & lower(SLOPE_W - 1 downto 1);
          count <= count + 1;
        end if;
      end if;

      if rst = '1' then
        out_valid     <= '0';
        busy          <= '0';
        regen_limited <= '0';
        state.most    <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
