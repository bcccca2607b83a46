-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: plausibility checks of the motion, one bit each, evaluated with every sample after the speed regulator.
--   0  overspeed   |omega_me| >= omega_trip
--   1  runaway     speed mode: against the reference, at omega_away or faster, and for runaway_samples samples in
--                  sequence not slower than at the slowest of them
--   2  stall       speed mode: i_q_ref at its limit for stall_samples in sequence, and the shaft stayed on a way of twice
--                  way_stall
-- A reversal, a stop and a load step brake: the speed falls below its own minimum, and the count starts anew.
-- A reference of zero is against either direction.  While the bus voltage limits the braking current (regen_limited)
-- the shaft coasts, and the count of a runaway waits.
-- The way is the sum of omega_me since the current came to its limit; a sample that ends beyond way_stall on either side
-- begins the count anew, and is left out where it leads further out: the middle of the way follows a shaft that gets on,
-- no tremble.
-- Formats: limits U(1,8), way_stall U(12,8), the way S(12,16), the minimum in full.
-- Latency: 4.  Interval: 4.  Rounding: |x| is the one's complement where x is negative, and cut (floor) to the limits'
-- format: up to 1/256 late.  The counters saturate; the way fits whatever comes.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motion_checks is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    omega_me        : in  signed(PU_W - 1 downto 0);
    omega_ref       : in  signed(PU_W - 1 downto 0);
    speed_mode      : in  std_logic;
    speed_limited   : in  std_logic;
    regen_limited   : in  std_logic;
    run             : in  std_logic;
    omega_trip      : in  unsigned(LIMIT_W - 1 downto 0);
    omega_away      : in  unsigned(LIMIT_W - 1 downto 0);
    runaway_samples : in  unsigned(11 downto 0);
    way_stall       : in  unsigned(19 downto 0);
    stall_samples   : in  unsigned(15 downto 0);
    out_valid       : out std_logic;
    motion_faults   : out unsigned(2 downto 0)
  );
end entity motion_checks;

architecture rtl of motion_checks is
  constant LATENCY : positive := MOTION_CHECKS_LATENCY;
  constant WAY_W   : positive := 29;

  type state_t is record
    slowest : unsigned(PU_W - 2 downto 0);
    away    : unsigned(11 downto 0);
    stalled : unsigned(15 downto 0);
    way     : signed(WAY_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal size_1    : unsigned(PU_W - 2 downto 0);
  signal against_1 : std_logic;
  signal coarse_1  : unsigned(LIMIT_W - 1 downto 0);
  signal gone_1    : signed(WAY_W downto 0);
  signal length_1  : unsigned(WAY_W - 1 downto 0);
  signal over_2    : std_logic;
  signal leaving_2 : std_logic;
  signal slower_2  : std_logic;
  signal held_2    : std_logic;
  signal leaves_2  : std_logic;
  signal outward_2 : std_logic;
  signal over_3    : std_logic;

  function reaches (count : unsigned; limit : unsigned) return std_logic is
  begin
    if count >= limit and count /= 0 then
      return '1';
    end if;
    return '0';
  end function;
begin
  valid(0) <= in_valid;
  coarse_1 <= size_1(PU_W - 2 downto PU_W - 1 - LIMIT_W);
  length_1 <= unsigned(gone_1(WAY_W - 1 downto 0) xor gone_1(WAY_W));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: size = |omega_me|;  against = the signs of speed and reference differ, or the reference is zero;
      -- gone = way + omega_me
      if valid(0) = '1' then
        gone_1    <= resize(state.way, WAY_W + 1) + omega_me;
        size_1    <= resize(unsigned(omega_me xor omega_me(PU_W - 1)), PU_W - 1);
        against_1 <= (omega_me(PU_W - 1) xor omega_ref(PU_W - 1)) or (nor omega_ref);
      end if;

      -- Stage 2: comparisons with the limits, and with the slowest of the samples that are counted
      if valid(1) = '1' then
        over_2    <= '1' when coarse_1 >= omega_trip else '0';
        leaving_2 <= run and speed_mode and against_1 when coarse_1 >= omega_away else '0';
        slower_2  <= '1' when size_1 < state.slowest or state.away = 0 else '0';
        held_2    <= run and speed_mode and speed_limited;
        leaves_2  <= '1' when shift_right(length_1, PU_W - 1 - LIMIT_W) >= way_stall else '0';
        outward_2 <= state.way(WAY_W - 1) xnor omega_me(PU_W - 1);
      end if;

      -- Stage 3: away = samples not slower than the slowest;  stalled = samples at the limit on this way
      if valid(2) = '1' then
        over_3 <= over_2;
        if slower_2 = '1' then
          state.slowest <= size_1;
        end if;
        if leaving_2 = '0' then
          state.away <= (others => '0');
        elsif slower_2 = '1' then
          state.away <= to_unsigned(1, 12);
        elsif (and state.away) = '0' and regen_limited = '0' then
          state.away <= state.away + 1;
        end if;
        if held_2 = '0' then
          state.way <= (others => '0');
        elsif (leaves_2 and outward_2) = '0' then
          state.way <= gone_1(WAY_W - 1 downto 0);
        end if;
        if held_2 = '0' or leaves_2 = '1' then
          state.stalled <= (others => '0');
        elsif (and state.stalled) = '0' then
          state.stalled <= state.stalled + 1;
        end if;
      end if;

      -- Stage 4: faults of this sample
      if valid(3) = '1' then
        motion_faults <= reaches(state.stalled, stall_samples) & reaches(state.away, runaway_samples) & over_3;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (way => (others => '0'), others => (others => '0'));
        motion_faults       <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
