-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: plausibility checks of the motion, one bit each, evaluated with every sample after the speed regulator.
--   0  overspeed   |omega_me| >= omega_trip
--   1  runaway     speed mode: against the reference, at omega_away or faster, and for runaway_samples samples in
--                  sequence not slower than at the slowest of them
--   2  stall       speed mode: i_q_ref at its limit and |omega_me| < omega_stall in stall_samples in sequence
-- A reversal, a stop and a load step brake: the speed falls below its own minimum, and the count starts anew.
-- A reference of zero is against either direction.  While the bus voltage limits the braking current (regen_limited)
-- the shaft coasts, and the count of a runaway waits.
-- Formats: limits U(1,8), the minimum in full.
-- Latency: 4.  Interval: 4.  Rounding: |omega_me| is the one's complement where it is negative, and cut (floor) to the
-- limits' format: up to 1/256 late.  The counters saturate.

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
    omega_stall     : in  unsigned(LIMIT_W - 1 downto 0);
    stall_samples   : in  unsigned(15 downto 0);
    out_valid       : out std_logic;
    motion_faults   : out unsigned(2 downto 0)
  );
end entity motion_checks;

architecture rtl of motion_checks is
  constant LATENCY : positive := MOTION_CHECKS_LATENCY;

  type state_t is record
    slowest : unsigned(PU_W - 2 downto 0);
    away    : unsigned(11 downto 0);
    stalled : unsigned(15 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal size_1    : unsigned(PU_W - 2 downto 0);
  signal against_1 : std_logic;
  signal coarse_1  : unsigned(LIMIT_W - 1 downto 0);
  signal over_2    : std_logic;
  signal leaving_2 : std_logic;
  signal slower_2  : std_logic;
  signal held_2    : std_logic;
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

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: size = |omega_me|;  against = the signs of speed and reference differ, or the reference is zero
      if valid(0) = '1' then
        size_1    <= resize(unsigned(omega_me xor omega_me(PU_W - 1)), PU_W - 1);
        against_1 <= (omega_me(PU_W - 1) xor omega_ref(PU_W - 1)) or (nor omega_ref);
      end if;

      -- Stage 2: comparisons with the limits, and with the slowest of the samples that are counted
      if valid(1) = '1' then
        over_2    <= '1' when coarse_1 >= omega_trip else '0';
        leaving_2 <= run and speed_mode and against_1 when coarse_1 >= omega_away else '0';
        slower_2  <= '1' when size_1 < state.slowest or state.away = 0 else '0';
        held_2    <= run and speed_mode and speed_limited when coarse_1 < omega_stall else '0';
      end if;

      -- Stage 3: away = samples not slower than the slowest;  stalled = samples at the limit without motion
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
        state               <= (others => (others => '0'));
        motion_faults       <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
