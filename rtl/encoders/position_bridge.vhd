-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a position code for each sample from an absolute encoder: delay compensated, bad frames bridged, then trip.
--   good frame since the last sample:  place(k) = code,  delta(k) = delta(k-1) + (code - place(k-1) - delta(k-1)) / n
--   none:                              place(k) = place(k-1) + delta,  one more sample is bridged
--   code_theta(k) = place(k) + delay * delta
-- delay is the time from the encoder's latch to the sampling instant of the currents, in samples.  The first good
-- frame after a bridge holds the error of the whole bridge: n is 1 without a bridge, 2 after one bridged sample, 4 after
-- two or three; after more delta is kept.
-- More than bridge_max samples without a good frame set position_lost, which stays until clear_faults.
-- Formats: codes modulo one turn; delay U(2,16).  Latency: 1 (every clock is a sample), sample to code_theta 4.
-- Rounding: delay * delta half up, a part of an error is cut (floor).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity position_bridge is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    frame_code     : in  unsigned(POSITION_BITS - 1 downto 0);
    frame_valid    : in  std_logic;
    sample         : in  std_logic;
    clear_faults   : in  std_logic;
    delay          : in  unsigned(17 downto 0);
    bridge_max     : in  unsigned(7 downto 0);
    code_theta     : out unsigned(POSITION_BITS - 1 downto 0);
    code_valid     : out std_logic;
    position_valid : out std_logic;
    position_lost  : out std_logic;
    bridged_count  : out unsigned(11 downto 0)
  );
end entity position_bridge;

architecture rtl of position_bridge is
  type state_t is record
    fresh   : std_logic;  -- 1: a good frame since the last sample
    frame   : unsigned(POSITION_BITS - 1 downto 0);  -- its code
    seen    : std_logic;
    place   : unsigned(POSITION_BITS - 1 downto 0);
    delta   : signed(POSITION_BITS - 1 downto 0);
    missing : unsigned(7 downto 0);  -- samples since the last good frame
    lost    : std_logic;
    counted : unsigned(11 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to 4);
  signal product_2 : signed(POSITION_BITS + 18 downto 0);
  signal ahead_3   : signed(POSITION_BITS + 19 - POSITION_BRIDGE_DROP downto 0);

  signal bridge : std_logic;
  signal error  : signed(POSITION_BITS - 1 downto 0);  -- of a bridged place
  signal part   : signed(POSITION_BITS - 1 downto 0);
begin
  valid(0) <= sample;
  bridge   <= sample and not state.fresh;
  error    <= signed(state.frame - state.place) - state.delta;
  part     <= error when state.missing = 0 else
              shift_right(error, 1) when state.missing = 1 else
              shift_right(error, 2) when state.missing <= 3 else
              (others => '0');

  process (clk)
    variable counted : unsigned(11 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to 4) <= valid(0 to 3);

      state.fresh <= frame_valid or (state.fresh and not sample);
      if frame_valid = '1' then
        state.frame <= frame_code;
      end if;

      -- Stage 1: place and delta
      if (sample and state.fresh) = '1' then
        state.place   <= state.frame;
        state.seen    <= '1';
        state.missing <= (others => '0');
        if state.seen = '1' then
          state.delta <= state.delta + part;
        end if;
      elsif sample = '1' then
        state.place <= state.place + unsigned(state.delta);
        if state.missing /= 255 then
          state.missing <= state.missing + 1;
        end if;
      end if;

      -- Stage 2: delay * delta.  Stage 3: rounded
      product_2 <= state.delta * signed('0' & delay);
      ahead_3   <= round_half_up(product_2, POSITION_BRIDGE_DROP);

      -- Stage 4: code
      if valid(3) = '1' then
        code_theta <= state.place + unsigned(ahead_3(POSITION_BITS - 1 downto 0));
      end if;

      state.lost <= state.lost and not clear_faults;
      if bridge = '1' and state.missing >= bridge_max then
        state.lost <= '1';
      end if;
      counted := state.counted;
      if clear_faults = '1' then
        counted := (others => '0');
      end if;
      if bridge = '1' and counted /= 4095 then
        counted := counted + 1;
      end if;
      state.counted <= counted;

      if rst = '1' then
        valid(1 to 4) <= (others => '0');
        product_2     <= (others => '0');
        ahead_3       <= (others => '0');
        code_theta    <= (others => '0');
        state.fresh   <= '0';
        state.frame   <= (others => '0');
        state.seen    <= '0';
        state.place   <= (others => '0');
        state.delta   <= (others => '0');
        state.missing <= (others => '0');
        state.lost    <= '0';
        state.counted <= (others => '0');
      end if;
    end if;
  end process;

  code_valid     <= valid(4);
  position_valid <= state.seen;
  position_lost  <= state.lost;
  bridged_count  <= state.counted;

end architecture rtl;
