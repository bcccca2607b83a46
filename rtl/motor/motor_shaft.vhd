-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: torque, speed and angle of the shaft, with viscous and Coulomb friction, load and cogging.
--   torque = turn_d*i_q - turn_q*i_d;  net = torque + cogging - load - viscous*omega
--   omega += k_j*(net -+ coulomb);  theta += omega;  theta_e = pole_pairs*theta
-- Coulomb friction holds a shaft at standstill and never turns it back.  hold: the speed is omega_set.
-- Formats: torques S(1,23), k_j U(-31,56), viscous U(12,5); speed S(-13,56) turns a step, angle U(0,56) turns.
-- Latency: 13.  Interval: 13; cogging and start are read in the first clock.
-- Rounding: products half up; the outputs are cut.  Sums saturate, the angle wraps.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_shaft is
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    in_valid   : in  std_logic;
    turn_d     : in  signed(FLUX_W - 1 downto 0);
    turn_q     : in  signed(FLUX_W - 1 downto 0);
    i_d        : in  signed(PU_W - 1 downto 0);
    i_q        : in  signed(PU_W - 1 downto 0);
    cogging    : in  signed(MOTOR_WAVE_W - 1 downto 0);
    load       : in  signed(FLUX_W - 1 downto 0);
    start      : in  std_logic;
    k_j        : in  unsigned(24 downto 0);
    viscous    : in  unsigned(16 downto 0);
    coulomb    : in  unsigned(22 downto 0);
    pole_pairs : in  unsigned(4 downto 0);
    hold       : in  std_logic;
    omega_set  : in  signed(17 downto 0);
    out_valid  : out std_logic;
    torque     : out signed(FLUX_W - 1 downto 0);
    omega_m    : out signed(MOTOR_SPEED_W - 1 downto 0);
    theta_m    : out unsigned(MOTOR_ANGLE_W - 1 downto 0);
    theta_e    : out unsigned(MOTOR_ANGLE_W - 1 downto 0)
  );
end entity motor_shaft;

architecture rtl of motor_shaft is
  constant LATENCY : positive           := MOTOR_SHAFT_LATENCY;
  constant LOW     : positive           := MOTOR_SHAFT_LOW_BITS;
  constant OMEGA_W : positive           := MOTOR_SHAFT_OMEGA_W;
  constant THETA_W : positive           := MOTOR_SHAFT_THETA_W;
  constant NET_W   : positive           := FLUX_W + 4;
  constant NOTHING : signed(0 downto 0) := "0";
  constant MINUS   : std_logic          := '1';

  signal valid      : std_logic_vector(0 to LATENCY);
  signal start_1    : std_logic;
  signal cogging_1  : signed(MOTOR_WAVE_W - 1 downto 0);
  signal by_viscous : signed(17 downto 0);
  signal speed      : signed(MOTOR_SPEED_W - 1 downto 0);
  signal torque_3   : signed(FLUX_W - 1 downto 0);
  signal drag_3     : signed(FLUX_W + 1 downto 0);
  signal torque_4   : signed(FLUX_W - 1 downto 0);
  signal rest_4     : signed(NET_W - 1 downto 0);
  signal net_5      : signed(FLUX_W - 1 downto 0);
  signal rests      : std_logic;
  signal back_5     : std_logic;
  signal held_5     : std_logic;
  signal less_5     : signed(FLUX_W + 1 downto 0);
  signal friction   : signed(23 downto 0);
  signal moving_6   : signed(FLUX_W - 1 downto 0);
  signal by_hi_7    : signed(FLUX_W + 17 downto 0);
  signal by_lo_7    : signed(FLUX_W + LOW downto 0);
  signal sum_8      : signed(FLUX_W + 18 + LOW downto 0);
  signal omega_9    : signed(OMEGA_W downto 0);
  signal stops_9    : std_logic;
  signal omega_10   : signed(OMEGA_W - 1 downto 0);  -- state
  signal theta_11   : unsigned(THETA_W - 1 downto 0);  -- state
  signal theta_m_12 : unsigned(MOTOR_ANGLE_W - 1 downto 0);
  signal product_12 : unsigned(MOTOR_ANGLE_W + 4 downto 0);
begin
  valid(0) <= in_valid;
  -- Friction stops a shaft whose speed changes its sign
  stops_9 <= (or coulomb) and not rests and (omega_10(omega_10'high) xor omega_9(omega_9'high));

  by_viscous <= signed('0' & viscous);
  friction   <= signed('0' & coulomb);
  speed      <= omega_10(OMEGA_W - 1 downto MOTOR_SHAFT_DROP_OMEGA);

  -- Stages 1 to 3: torque;  drag = viscous*omega
  air_gap : entity work.sum_of_products
    generic map (DROP => MOTOR_SHAFT_DROP_TORQUE)
    port map (clk => clk, a => turn_q, b => i_d, minus => MINUS, c => turn_d, d => i_q, y => torque_3);

  bearing : entity work.multiply_add
    generic map (DROP => MOTOR_SHAFT_DROP_VISCOUS)
    port map (clk => clk, a => speed, b => by_viscous, c => NOTHING, y => drag_3, limited => open);

  -- Which way the shaft moves, or would move: at standstill the torque decides, if it exceeds the friction
  rests  <= nor omega_10;
  back_5 <= net_5(net_5'high) when rests = '1' else omega_10(omega_10'high);
  -- net -+ friction with one sum: the carry that a complement needs comes from the bit below
  less_5 <= (resize(net_5, FLUX_W + 1) & '1') + ((resize(friction, FLUX_W + 1) xor not back_5) & not back_5);
  held_5 <= rests and ((less_5(less_5'high) xor back_5) or nor less_5(FLUX_W + 1 downto 1));

  process (clk)
    variable following : signed(OMEGA_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);
      if in_valid = '1' then
        start_1   <= start;
        cogging_1 <= cogging;
      end if;

      -- Stage 4: rest = cogging - load - drag
      torque_4 <= torque_3;
      rest_4   <= shift_left(resize(cogging_1, NET_W), MOTOR_SHAFT_WAVE_SHIFT) - load - drag_3;

      -- Stage 5: net = torque + rest
      net_5 <= saturate(torque_4 + rest_4, FLUX_W);

      -- Stage 6: what friction leaves of it
      moving_6 <= saturate(less_5(FLUX_W + 1 downto 1), FLUX_W);
      if held_5 = '1' then
        moving_6 <= (others => '0');
      end if;

      -- Stages 7, 8: k_j*moving in two parts, and the half that rounds it
      by_hi_7 <= moving_6 * signed('0' & k_j(24 downto LOW));
      by_lo_7 <= moving_6 * signed('0' & k_j(LOW - 1 downto 0));
      sum_8   <= shift_left(resize(by_hi_7, sum_8'length), LOW)
                 + (resize(by_lo_7, FLUX_W + LOW + 2) + half(MOTOR_SHAFT_DROP_J, FLUX_W + LOW + 2));

      -- Stage 9: omega, if nothing stops it
      omega_9 <= resize(omega_10, OMEGA_W + 1) + shift_right(sum_8, MOTOR_SHAFT_DROP_J)(OMEGA_W - 1 downto 0);

      -- Stage 10: friction stops at zero
      if valid(9) = '1' then
        following := omega_9;
        if stops_9 = '1' then
          following := (others => '0');
        end if;
        omega_10 <= saturate(following, OMEGA_W);
        if hold = '1' then
          omega_10 <= shift_left(resize(omega_set, OMEGA_W), MOTOR_SHAFT_SET_SHIFT);
        end if;
        if start_1 = '1' then
          omega_10 <= (others => '0');
        end if;
      end if;

      -- Stage 11: theta
      if valid(10) = '1' then
        theta_11 <= theta_11 + unsigned(resize(omega_10, THETA_W));
        if start_1 = '1' then
          theta_11 <= (others => '0');
        end if;
      end if;

      -- Stage 12: theta_e = pole_pairs*theta, modulo a turn
      theta_m_12 <= theta_11(THETA_W - 1 downto THETA_W - MOTOR_ANGLE_W);
      product_12 <= theta_11(THETA_W - 1 downto THETA_W - MOTOR_ANGLE_W) * pole_pairs;

      -- Stage 13
      if valid(12) = '1' then
        torque  <= torque_4;
        omega_m <= speed;
        theta_m <= theta_m_12;
        theta_e <= product_12(MOTOR_ANGLE_W - 1 downto 0);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        omega_10            <= (others => '0');
        theta_11            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
