-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a motor with its inverter: gate signals of every clock in, currents, torque, speed and angle out.
-- Only wiring: a step of STEP clocks begins with tick, each block starts when the one before it is done; what a block
-- reads is the newest that is there.  Which step that is of: golden_model/motor/motor_model.py.
-- Formats: those of the blocks; docs/hil.md.
-- Latency: 40 clocks from tick to the currents of the fluxes at tick, 53 to the angle.  Interval: STEP.
-- Rounding: none.
-- ready: the rotor is free; before, currents and angle may be those of before the reset.
-- table_select: 0 the map, d in the upper half of a word, address row and column; 1 harmonic fluxes; 2 cogging.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity motor_model is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    gate_high     : in  unsigned(2 downto 0);
    gate_low      : in  unsigned(2 downto 0);
    u_dc          : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    load          : in  signed(FLUX_W - 1 downto 0);
    start         : in  std_logic;
    clear_faults  : in  std_logic;
    stiffness     : in  unsigned(16 downto 0);
    v_switch      : in  unsigned(21 downto 0);
    v_diode       : in  unsigned(21 downto 0);
    r_a           : in  unsigned(23 downto 0);
    r_b           : in  unsigned(23 downto 0);
    r_c           : in  unsigned(23 downto 0);
    psi_start     : in  signed(FLUX_W - 1 downto 0);
    psi_m         : in  signed(FLUX_W - 1 downto 0);
    inv_l_d       : in  unsigned(24 downto 0);
    inv_l_q       : in  unsigned(24 downto 0);
    k_j           : in  unsigned(24 downto 0);
    viscous       : in  unsigned(16 downto 0);
    coulomb       : in  unsigned(22 downto 0);
    pole_pairs    : in  unsigned(4 downto 0);
    hold          : in  std_logic;
    omega_set     : in  signed(17 downto 0);
    table_write   : in  std_logic;
    table_select  : in  unsigned(1 downto 0);
    table_at      : in  unsigned(11 downto 0);
    table_word    : in  unsigned(35 downto 0);
    tick          : out std_logic;
    ready         : out std_logic;
    i_a           : out signed(PU_W - 1 downto 0);
    i_b           : out signed(PU_W - 1 downto 0);
    i_c           : out signed(PU_W - 1 downto 0);
    torque        : out signed(FLUX_W - 1 downto 0);
    omega_m       : out signed(MOTOR_SPEED_W - 1 downto 0);
    theta_m       : out unsigned(MOTOR_ANGLE_W - 1 downto 0);
    theta_e       : out unsigned(MOTOR_ANGLE_W - 1 downto 0);
    shoot_through : out std_logic
  );
end entity motor_model;

architecture rtl of motor_model is
  signal count        : unsigned(4 downto 0);
  signal starting     : unsigned(3 downto 0);
  signal first        : std_logic;
  signal go           : std_logic_vector(1 to 2);
  signal theta_e_1    : unsigned(MOTOR_ANGLE_W - 1 downto 0);
  signal theta_m_1    : unsigned(MOTOR_ANGLE_W - 1 downto 0);
  signal u_dc_1       : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal load_1       : signed(FLUX_W - 1 downto 0);
  signal start_1      : std_logic;
  signal high_a       : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal low_a        : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal off_a        : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal high_b       : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal low_b        : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal off_b        : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal high_c       : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal low_c        : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal off_c        : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal leg_a        : signed(MOTOR_LEG_W - 1 downto 0);
  signal leg_b        : signed(MOTOR_LEG_W - 1 downto 0);
  signal leg_c        : signed(MOTOR_LEG_W - 1 downto 0);
  signal flux_done    : std_logic;
  signal lambda_alpha : signed(FLUX_W - 1 downto 0);
  signal lambda_beta  : signed(FLUX_W - 1 downto 0);
  signal cos_theta    : signed(MOTOR_TRIG_W - 1 downto 0);
  signal sin_theta    : signed(MOTOR_TRIG_W - 1 downto 0);
  signal wave_d       : signed(MOTOR_WAVE_W - 1 downto 0);
  signal wave_q       : signed(MOTOR_WAVE_W - 1 downto 0);
  signal slope_d      : signed(PU_W - 1 downto 0);
  signal slope_q      : signed(PU_W - 1 downto 0);
  signal cogging      : signed(MOTOR_WAVE_W - 1 downto 0);
  signal placed       : std_logic;
  signal x_d          : signed(23 downto 0);
  signal x_q          : signed(23 downto 0);
  signal row          : unsigned(5 downto 0);
  signal column       : unsigned(5 downto 0);
  signal f_d          : unsigned(16 downto 0);
  signal f_q          : unsigned(16 downto 0);
  signal turn_d       : signed(FLUX_W - 1 downto 0);
  signal turn_q       : signed(FLUX_W - 1 downto 0);
  signal cos_held     : signed(MOTOR_TRIG_W - 1 downto 0);
  signal sin_held     : signed(MOTOR_TRIG_W - 1 downto 0);
  signal point_00     : unsigned(35 downto 0);
  signal point_01     : unsigned(35 downto 0);
  signal point_10     : unsigned(35 downto 0);
  signal point_11     : unsigned(35 downto 0);
  signal wave_before  : unsigned(35 downto 0);
  signal wave_after   : unsigned(35 downto 0);
  signal cog_before   : unsigned(17 downto 0);
  signal cog_after    : unsigned(17 downto 0);
  signal flows        : std_logic;
  signal i_d          : signed(PU_W - 1 downto 0);
  signal i_q          : signed(PU_W - 1 downto 0);
  signal turn_d_now   : signed(FLUX_W - 1 downto 0);
  signal turn_q_now   : signed(FLUX_W - 1 downto 0);
begin
  first <= '1' when count = 0 else '0';
  tick  <= first;
  ready <= '1' when starting = 0 else '0';

  -- The clocks of a step, and what a step takes at its tick
  process (clk)
  begin
    if rising_edge(clk) then
      count <= count + 1;
      if count = MOTOR_STEP - 1 then
        count <= (others => '0');
      end if;
      go <= first & go(1);
      if first = '1' then
        u_dc_1  <= u_dc;
        load_1  <= load;
        start_1 <= start;
        -- The shaft's next angle comes while this one is looked up
        theta_e_1 <= theta_e;
        theta_m_1 <= theta_m;
        if starting /= 0 then
          start_1  <= '1';
          starting <= starting - 1;
        end if;
      end if;

      if rst = '1' then
        count    <= (others => '0');
        starting <= to_unsigned(MOTOR_STARTING, starting'length);
        go       <= (others => '0');
      end if;
    end if;
  end process;

  inverter : entity work.motor_inverter
    port map (
      clk => clk, rst => rst, tick => first, gate_high => gate_high, gate_low => gate_low, high_a => high_a,
      low_a => low_a, off_a => off_a, high_b => high_b, low_b => low_b, off_b => off_b, high_c => high_c,
      low_c => low_c, off_c => off_c, clear_faults => clear_faults, leg_a => leg_a, leg_b => leg_b, leg_c => leg_c,
      shoot_through => shoot_through
    );

  flux : entity work.motor_flux
    port map (
      clk => clk, rst => rst, in_valid => go(2), leg_a => leg_a, leg_b => leg_b, leg_c => leg_c, i_a => i_a,
      i_b => i_b, i_c => i_c, start => start_1, r_a => r_a, r_b => r_b, r_c => r_c, psi_start => psi_start,
      out_valid => flux_done, lambda_alpha => lambda_alpha, lambda_beta => lambda_beta
    );

  waves : entity work.motor_waves
    port map (
      clk => clk, theta_e => theta_e_1, theta_m => theta_m_1, table_write => table_write, table_select => table_select,
      table_at => table_at, table_word => table_word, wave_before => wave_before, wave_after => wave_after,
      cog_before => cog_before, cog_after => cog_after
    );

  angle : entity work.motor_angle
    port map (
      clk => clk, rst => rst, in_valid => go(2), theta_e => theta_e_1, theta_m => theta_m_1,
      wave_d_0 => signed(wave_before(35 downto 18)), wave_d_1 => signed(wave_after(35 downto 18)),
      wave_q_0 => signed(wave_before(17 downto 0)), wave_q_1 => signed(wave_after(17 downto 0)),
      cog_0 => signed(cog_before), cog_1 => signed(cog_after), out_valid => open, cos_theta => cos_theta,
      sin_theta => sin_theta, wave_d => wave_d, wave_q => wave_q, slope_d => slope_d, slope_q => slope_q,
      cogging => cogging
    );

  unsaturated : entity work.motor_unsaturated
    port map (
      clk => clk, rst => rst, in_valid => flux_done, lambda_alpha => lambda_alpha, lambda_beta => lambda_beta,
      cos_theta => cos_theta, sin_theta => sin_theta, wave_d => wave_d, wave_q => wave_q, slope_d => slope_d,
      slope_q => slope_q, psi_m => psi_m, inv_l_d => inv_l_d, inv_l_q => inv_l_q, out_valid => placed, x_d => x_d,
      x_q => x_q, row => row, column => column, f_d => f_d, f_q => f_q, turn_d => turn_d, turn_q => turn_q,
      cos_held => cos_held, sin_held => sin_held
    );

  map_points : entity work.motor_map
    port map (
      clk => clk, row => row, column => column, table_write => table_write, table_select => table_select,
      table_at => table_at, table_word => table_word, point_00 => point_00, point_01 => point_01,
      point_10 => point_10, point_11 => point_11
    );

  current : entity work.motor_current
    port map (
      clk => clk, rst => rst, in_valid => placed, x_d => x_d, x_q => x_q, f_d => f_d, f_q => f_q,
      cos_theta => cos_held, sin_theta => sin_held, turn_d_in => turn_d, turn_q_in => turn_q,
      d_00 => signed(point_00(35 downto 18)), d_01 => signed(point_01(35 downto 18)),
      d_10 => signed(point_10(35 downto 18)), d_11 => signed(point_11(35 downto 18)),
      q_00 => signed(point_00(17 downto 0)), q_01 => signed(point_01(17 downto 0)),
      q_10 => signed(point_10(17 downto 0)), q_11 => signed(point_11(17 downto 0)), out_valid => flows, i_d => i_d,
      i_q => i_q, i_a => i_a, i_b => i_b, i_c => i_c, turn_d => turn_d_now, turn_q => turn_q_now
    );

  legs : entity work.motor_legs
    port map (
      clk => clk, rst => rst, in_valid => flows, i_a => i_a, i_b => i_b, i_c => i_c, u_dc => u_dc_1,
      stiffness => stiffness, v_switch => v_switch, v_diode => v_diode, out_valid => open, high_a => high_a,
      low_a => low_a, off_a => off_a, high_b => high_b, low_b => low_b, off_b => off_b, high_c => high_c,
      low_c => low_c, off_c => off_c
    );

  shaft : entity work.motor_shaft
    port map (
      clk => clk, rst => rst, in_valid => flows, turn_d => turn_d_now, turn_q => turn_q_now, i_d => i_d, i_q => i_q,
      cogging => cogging, load => load_1, start => start_1, k_j => k_j, viscous => viscous, coulomb => coulomb,
      pole_pairs => pole_pairs, hold => hold, omega_set => omega_set, out_valid => open, torque => torque,
      omega_m => omega_m, theta_m => theta_m, theta_e => theta_e
    );

end architecture rtl;
