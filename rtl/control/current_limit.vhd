-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: keeps the current references in the circle of radius i_max, d axis first, whatever their source.
--   i_d     = limit(i_d_ref, +-i_max)
--   i_q_max = floor(sqrt((i_max - i_d)*(i_max + i_d))), the limit of i_q in speed mode and in torque mode
-- Both apply to the next sample, as a pair.  Product and root are made bit by bit, one bit a clock, without a
-- multiplier, beside everything else: i_d_ref and i_max act one sample late, and nothing waits for the root.
-- Formats: references and limit in WIDTH bits, PU in the core; product exact.
-- Latency: 1 (the pair of the last sample).  Interval: 2*WIDTH.
-- Rounding: the root is floored: i_d**2 + i_q_max**2 <= i_max**2.  No overflow: the product is below i_max**2.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_limit is
  generic (
    WIDTH : positive range 4 to 18 := PU_W  -- less for the proof alone
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    i_d_ref     : in  signed(WIDTH - 1 downto 0);
    i_max       : in  signed(WIDTH - 1 downto 0);
    out_valid   : out std_logic;
    i_d_limited : out signed(WIDTH - 1 downto 0);
    i_q_max     : out signed(WIDTH - 1 downto 0)
  );
end entity current_limit;

architecture rtl of current_limit is
  constant REST_W : positive := WIDTH + 2;

  type state_t is record
    i_d     : signed(WIDTH - 1 downto 0);
    i_q_max : unsigned(WIDTH - 2 downto 0);
  end record state_t;

  signal state : state_t;

  signal busy    : std_logic;
  signal to_root : std_logic;  -- 0: steps of the product, 1: of the root
  signal count   : natural range 0 to WIDTH - 1;
  signal below_1 : signed(WIDTH downto 0);  -- i_max - i_d_ref; negative: i_d_ref is above i_max
  signal above_1 : signed(WIDTH downto 0);  -- i_max + i_d_ref; negative: i_d_ref is below -i_max
  signal upper   : unsigned(WIDTH - 1 downto 0);  -- product, upper part
  signal lower   : unsigned(WIDTH - 1 downto 0);
  signal factor  : std_logic;
  signal product : unsigned(2 * WIDTH - 1 downto 0);
  signal sum     : unsigned(WIDTH downto 0);
  signal pair    : unsigned(1 downto 0);
  signal rest    : signed(REST_W - 1 downto 0);
  signal shifted : signed(REST_W - 1 downto 0);
  signal turned  : signed(WIDTH - 1 downto 0);  -- root, or its complement
  signal taken   : signed(REST_W - 1 downto 0);
begin
  -- Step k of the product: upper = (upper + above*bit k of below)/2, zero if i_d is limited
  factor <= below_1(count) and not below_1(WIDTH) and not above_1(WIDTH) when to_root = '0' else '0';
  sum    <= resize(upper, WIDTH + 1) + (unsigned(above_1(WIDTH - 1 downto 0)) and factor);

  -- Step k of the root: the next pair of bits of the product, from the left; below 2**(2*WIDTH - 2)
  product <= upper & lower;
  pair    <= product(2 * (WIDTH - 2 - count) + 1 downto 2 * (WIDTH - 2 - count)) when to_root = '1' else "00";

  -- Not restoring: rest = 4*rest + pair - (4*root + 1) where rest >= 0, + (4*root + 3) where it is negative:
  -- -(4*root + 1) is 4*(not root) + 3, so that one adder does both
  shifted <= rest(REST_W - 3 downto 0) & signed(pair);
  turned  <= signed('0' & state.i_q_max) xor not rest(REST_W - 1);
  taken   <= shifted + (turned & "11");

  process (clk)
    variable nearest : signed(WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: the pair of the last sample;  below = i_max - i_d_ref;  above = i_max + i_d_ref
      if in_valid = '1' then
        i_d_limited <= state.i_d;
        i_q_max     <= signed(resize(state.i_q_max, WIDTH));
        below_1     <= resize(i_max, WIDTH + 1) - i_d_ref;
        above_1     <= resize(i_max, WIDTH + 1) + i_d_ref;
        busy        <= '1';
        to_root     <= '0';
        count       <= 0;
        upper       <= (others => '0');
        rest        <= (others => '0');
      elsif busy = '1' then
        -- Stage 2: i_d = i_d_ref, limited
        if count = 0 and to_root = '0' then
          nearest := i_d_ref;
          if below_1(WIDTH) = '1' then
            nearest := i_max;
          elsif above_1(WIDTH) = '1' then
            nearest := not i_max;
          end if;
          state.i_d     <= plus_carry(nearest, above_1(WIDTH));
          state.i_q_max <= (others => '0');
        end if;

        -- Stages 2 to WIDTH + 1: product = below*above;  then WIDTH - 1 stages: i_q_max = its root
        if to_root = '0' then
          upper <= sum(WIDTH downto 1);
          lower <= sum(0) & lower(WIDTH - 1 downto 1);
        else
          rest          <= taken;
          state.i_q_max <= state.i_q_max(WIDTH - 3 downto 0) & not taken(REST_W - 1);
        end if;
        if to_root = '0' and count = WIDTH - 1 then
          to_root <= '1';
          count   <= 0;
        elsif to_root = '1' and count = WIDTH - 2 then
          busy <= '0';
        else
          count <= count + 1;
        end if;
      end if;

      if rst = '1' then
        out_valid     <= '0';
        busy          <= '0';
        state.i_d     <= (others => '0');
        state.i_q_max <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
