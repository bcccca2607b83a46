-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: trajectory to a target with limited speed, acceleration and jerk, and what the loops below are fed forward.
--   position_plan gives the jerk of each section of samples;  a += jerk;  v += a;  position_ref += v, torque_lead later
--   omega_ff += k_filter*(k_speed*v - omega_ff);  torque_ff = k_inertia*a + k_viscous*v + coulomb*sign(v)
-- Without position_mode or run the profile follows the measured speed and position_ref the position; torque_ff is zero.
-- One multiplier is used seven times a sample.
-- Formats: way S(13,44) turns, v and a S(-3,44), factors 34 bits in two halves; omega_ff S(1,28), torque_ff PU.
-- Latency: 36.  Interval: 37.
-- Rounding: half up; a's factor, omega_ff and torque_ff saturate; the way wraps.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity position_trajectory is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    shaft_position  : in  signed(31 downto 0);
    run             : in  std_logic;
    position_mode   : in  std_logic;
    position_target : in  signed(31 downto 0);
    move_speed      : in  unsigned(30 downto 0);
    move_step       : in  unsigned(30 downto 0);
    jerk_bits       : in  unsigned(2 downto 0);
    torque_lead     : in  unsigned(2 downto 0);
    use_stops       : in  std_logic;
    stop_low        : in  signed(31 downto 0);
    stop_high       : in  signed(31 downto 0);
    k_speed         : in  unsigned(23 downto 0);
    k_filter        : in  unsigned(16 downto 0);
    k_inertia       : in  unsigned(23 downto 0);
    k_viscous       : in  unsigned(KP_W - 1 downto 0);
    coulomb         : in  signed(PU_W - 1 downto 0);
    out_valid       : out std_logic;
    position_ref    : out signed(31 downto 0);
    omega_ff        : out signed(INTEGRAL_W - 1 downto 0);
    torque_ff       : out signed(PU_W - 1 downto 0);
    at_rest         : out std_logic
  );
end entity position_trajectory;

architecture rtl of position_trajectory is
  constant LATENCY  : positive := POSITION_TRAJECTORY_LATENCY;
  constant WAY_W    : positive := POSITION_PLAN_WAY_W;
  constant SMALL    : positive := POSITION_PLAN_SMALL;
  constant AHEAD_W  : positive := POSITION_PLAN_AHEAD_W;
  constant FACTOR_W : positive := POSITION_TRAJECTORY_FACTOR_W;
  constant V_W      : positive := WAY_W - 16;  -- S(-3,44)
  constant HALF_W   : positive := FACTOR_W / 2;
  constant SUM_W    : positive := FACTOR_W + 25;

  subtype v_t is signed(V_W - 1 downto 0);
  type past_t is array (0 to 7) of v_t;

  type state_t is record
    phase    : unsigned(7 downto 0);
    lead     : unsigned(2 downto 0);
    a        : v_t;
    v        : v_t;
    ahead    : signed(AHEAD_W - 1 downto 0);
    way      : signed(WAY_W - 1 downto 0);
    omega_ff : signed(INTEGRAL_W - 1 downto 0);
  end record state_t;

  signal state : state_t;
  signal past  : past_t;  -- v, newest first

  signal valid       : std_logic_vector(0 to LATENCY);
  signal active      : std_logic;
  signal starts      : std_logic;  -- the sample begins a section
  signal still       : std_logic;
  signal jerk        : signed(37 downto 0);
  signal advance     : signed(AHEAD_W - 1 downto 0);  -- way of the section
  signal last_sample : unsigned(7 downto 0);
  signal planned     : std_logic;
  signal v_used      : v_t;
  signal rounded     : signed(WAY_W + 1 - SMALL downto 0);
  signal factor_v    : signed(FACTOR_W - 1 downto 0);
  signal factor_a    : signed(FACTOR_W - 1 downto 0);
  signal factor_now  : signed(FACTOR_W - 1 downto 0);  -- v without torque_lead
  signal by_inertia  : signed(PU_W - 1 downto 0);
  signal viscous     : signed(PU_W - 1 downto 0);
  signal friction    : signed(PU_W - 1 downto 0);
  signal x           : signed(24 downto 0);
  signal y           : signed(17 downto 0);
  signal p           : signed(42 downto 0);
  signal sum         : signed(SUM_W - 1 downto 0);
  signal raw         : signed(INTEGRAL_W - 1 downto 0);

  -- The halves of a factor: the low one is positive
  function high (f : signed) return signed is
  begin
    return resize(shift_right(f, HALF_W), 18);
  end function;

  function low (f : signed) return signed is
  begin
    return signed('0' & f(HALF_W - 1 downto 0));
  end function;
begin
  rounded  <= round_half_up(resize(state.way, WAY_W + 1), SMALL);
  valid(0) <= in_valid;
  active   <= position_mode and run;
  starts   <= in_valid when state.phase = 0 else '0';

  plan : entity work.position_plan
    port map (clk => clk, rst => rst, in_valid => starts,
              shaft_position => shaft_position, active => active, way => state.way, ahead => state.ahead,
              position_target => position_target, move_speed => move_speed, move_step => move_step,
              jerk_bits => jerk_bits, use_stops => use_stops, stop_low => stop_low, stop_high => stop_high,
              out_valid => planned, jerk => jerk, advance => advance, last_sample => last_sample, still => still,
              at_rest => at_rest);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      p <= x * y;

      -- Stages 21, 22: a += jerk;  v += a;  stage 23: v of torque_lead samples ago
      if valid(20) = '1' then
        state.a <= resize(state.a + jerk, V_W);
        if planned = '1' then
          state.ahead <= state.ahead + advance;
          if still = '1' then
            state.lead <= torque_lead;
          end if;
        end if;
        state.phase <= state.phase + 1;
        if state.phase = last_sample then
          state.phase <= (others => '0');
        end if;
      end if;
      if valid(21) = '1' then
        state.v <= state.v + state.a;
      end if;
      if valid(22) = '1' then
        past <= state.v & past(0 to 6);
      end if;
      v_used <= past(to_integer(state.lead));

      -- Stage 25: the way, from where the shaft is while it is followed;  factors
      if valid(24) = '1' then
        state.ahead <= state.ahead - v_used;
        state.way   <= state.way + v_used;
        if active = '0' then
          state.way <= shift_left(resize(shaft_position, WAY_W), SMALL) + v_used;
        end if;
        factor_v <= resize(round_half_up(v_used, POSITION_TRAJECTORY_V_DROP), FACTOR_W);
        factor_a <= round_sat(state.a, POSITION_TRAJECTORY_A_DROP, FACTOR_W);

        factor_now <= resize(round_half_up(state.v, POSITION_TRAJECTORY_V_DROP), FACTOR_W);
        friction   <= negated(coulomb, state.v(V_W - 1));
        if state.v = 0 then
          friction <= (others => '0');
        end if;
      end if;

      -- Stages 26 to 31: k_speed*v, k_inertia*a and k_viscous*v, a half at a time
      if valid(25) = '1' then
        x            <= signed('0' & k_speed);
        y            <= high(factor_v);
        position_ref <= rounded(31 downto 0);
      end if;
      if valid(26) = '1' then
        y <= low(factor_v);
      end if;
      if valid(27) = '1' then
        x <= signed('0' & k_inertia);
        y <= high(factor_a);
      end if;
      if valid(28) = '1' then
        y <= low(factor_a);
      end if;
      if valid(29) = '1' then
        x <= signed('0' & k_viscous);
        y <= high(factor_now);
      end if;
      if valid(30) = '1' then
        y <= low(factor_now);
      end if;

      -- Stages 28 to 33: sums of the halves
      if valid(27) = '1' or valid(29) = '1' or valid(31) = '1' then
        sum <= shift_left(resize(p, SUM_W), HALF_W);
      end if;
      if valid(28) = '1' or valid(30) = '1' or valid(32) = '1' then
        sum <= sum + p;
      end if;

      -- Stage 30: raw = k_speed*v;  stages 32, 34, 35: torque_ff
      if valid(29) = '1' then
        raw <= round_sat(sum, POSITION_TRAJECTORY_DROP_OMEGA, INTEGRAL_W);
      end if;
      if valid(31) = '1' then
        by_inertia <= round_sat(sum, POSITION_TRAJECTORY_DROP_TORQUE, PU_W);
      end if;
      if valid(33) = '1' then
        viscous <= round_sat(sum, POSITION_TRAJECTORY_DROP_VISCOUS, PU_W);
      end if;
      if valid(34) = '1' then
        torque_ff <= saturate(resize(by_inertia, PU_W + 2) + viscous + friction, PU_W);
        if active = '0' then
          torque_ff <= (others => '0');
        end if;
      end if;

      -- Stages 32 to 34: omega_ff += k_filter*(raw - omega_ff)
      if valid(31) = '1' then
        x <= resize(round_half_up(resize(raw, INTEGRAL_W + 1) - state.omega_ff, POSITION_TRAJECTORY_DROP_ERROR), 25);
        y <= signed('0' & k_filter);
      end if;
      if valid(33) = '1' then
        state.omega_ff <= saturate(resize(state.omega_ff, 44) + round_half_up(p, POSITION_TRAJECTORY_DROP_FILTER),
                                   INTEGRAL_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (phase => (others => '0'), lead => (others => '0'), a => (others => '0'),
                                v => (others => '0'), ahead => (others => '0'), way => (others => '0'),
                                omega_ff => (others => '0'));
        past                <= (others => (others => '0'));
      end if;
    end if;
  end process;

  omega_ff  <= state.omega_ff;
  out_valid <= valid(LATENCY);

end architecture rtl;
