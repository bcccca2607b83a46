-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the core and a motor in one for a simulator, registers as ports; with registers on a bus: fluxproof_hil.
-- Only wiring: the core's gates drive the motor, the motor's sensors are the core's samples.  Of given only references
-- and flags are used, the codes come from the sensors.
-- Formats: those of the blocks; docs/hil.md.
-- Latency: 13 clocks from sample_trigger to sample_valid.  Interval: a PWM period, or half of one.
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity core_and_motor is
  generic (
    ADC_BITS      : positive range 12 to 16   := 12;
    POSITION_BITS : positive range 12 to 18   := 16;
    CARRIER_HALF  : positive range 8 to 32767 := 2500;
    ESTIMATORS    : natural range 0 to 1      := 1
  );
  port (
    clk                 : in  std_logic;
    rst                 : in  std_logic;
    given               : in  sample_t;
    settings            : in  settings_t;
    enable              : in  std_logic;
    trip                : in  std_logic;
    clear_trip          : in  std_logic;
    host_write          : in  std_logic;
    motor_u_dc          : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    motor_load          : in  signed(FLUX_W - 1 downto 0);
    motor_start         : in  std_logic;
    motor_clear_faults  : in  std_logic;
    motor_stiffness     : in  unsigned(16 downto 0);
    motor_v_switch      : in  unsigned(21 downto 0);
    motor_v_diode       : in  unsigned(21 downto 0);
    motor_r_a           : in  unsigned(23 downto 0);
    motor_r_b           : in  unsigned(23 downto 0);
    motor_r_c           : in  unsigned(23 downto 0);
    motor_psi_start     : in  signed(FLUX_W - 1 downto 0);
    motor_psi_m         : in  signed(FLUX_W - 1 downto 0);
    motor_inv_l_d       : in  unsigned(24 downto 0);
    motor_inv_l_q       : in  unsigned(24 downto 0);
    motor_k_j           : in  unsigned(24 downto 0);
    motor_viscous       : in  unsigned(16 downto 0);
    motor_coulomb       : in  unsigned(22 downto 0);
    motor_pole_pairs    : in  unsigned(4 downto 0);
    motor_hold          : in  std_logic;
    motor_omega_set     : in  signed(17 downto 0);
    motor_inv_c         : in  unsigned(23 downto 0);
    motor_k_source      : in  unsigned(23 downto 0);
    motor_k_brake       : in  unsigned(23 downto 0);
    motor_rectifier     : in  std_logic;
    motor_table_write   : in  std_logic;
    motor_table_select  : in  unsigned(1 downto 0);
    motor_table_at      : in  unsigned(11 downto 0);
    motor_table_word    : in  unsigned(35 downto 0);
    motor_scale_a       : in  signed(24 downto 0);
    motor_scale_b       : in  signed(24 downto 0);
    motor_scale_c       : in  signed(24 downto 0);
    motor_scale_u       : in  signed(24 downto 0);
    motor_zero_a        : in  signed(PU_W - 1 downto 0);
    motor_zero_b        : in  signed(PU_W - 1 downto 0);
    motor_zero_c        : in  signed(PU_W - 1 downto 0);
    motor_zero_u        : in  signed(PU_W - 1 downto 0);
    motor_k_filter      : in  unsigned(16 downto 0);
    motor_ambient       : in  signed(15 downto 0);
    motor_t_ref         : in  signed(15 downto 0);
    motor_heating       : in  unsigned(23 downto 0);
    motor_k_winding     : in  unsigned(20 downto 0);
    motor_k_magnet      : in  unsigned(20 downto 0);
    motor_tcr_winding   : in  unsigned(16 downto 0);
    motor_tcr_magnet    : in  unsigned(16 downto 0);
    motor_noise_i       : in  unsigned(7 downto 0);
    motor_noise_u       : in  unsigned(7 downto 0);
    motor_angle_offset  : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    gate_high           : out unsigned(2 downto 0);
    gate_low            : out unsigned(2 downto 0);
    sample_trigger      : out std_logic;
    sample_valid        : out std_logic;
    running             : out std_logic;
    tripped             : out std_logic;
    fault_flags         : out unsigned(15 downto 0);
    values_valid        : out std_logic;
    observed            : out observed_t;
    estimated           : out estimated_t;
    motor_i_a           : out signed(PU_W - 1 downto 0);
    motor_i_b           : out signed(PU_W - 1 downto 0);
    motor_i_c           : out signed(PU_W - 1 downto 0);
    motor_torque        : out signed(FLUX_W - 1 downto 0);
    motor_omega_m       : out signed(MOTOR_SPEED_W - 1 downto 0);
    motor_theta_m       : out unsigned(MOTOR_ANGLE_W - 1 downto 0);
    motor_theta_e       : out unsigned(MOTOR_ANGLE_W - 1 downto 0);
    motor_u_bus         : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    motor_temp_winding  : out signed(15 downto 0);
    motor_temp_magnet   : out signed(15 downto 0);
    motor_shoot_through : out std_logic
  );
end entity core_and_motor;

architecture rtl of core_and_motor is
  signal trigger    : std_logic;
  signal brake      : std_logic;
  signal sample     : sample_t;
  signal entered    : std_logic;
  signal converted  : std_logic;
  signal code_a     : unsigned(ADC_BITS - 1 downto 0);
  signal code_b     : unsigned(ADC_BITS - 1 downto 0);
  signal code_c     : unsigned(ADC_BITS - 1 downto 0);
  signal code_u_dc  : unsigned(ADC_BITS - 1 downto 0);
  signal code_theta : unsigned(POSITION_BITS - 1 downto 0);
begin
  sample_trigger <= trigger;
  sample_valid   <= entered;

  process (clk)
  begin
    if rising_edge(clk) then
      -- The sample of the core
      entered <= converted;
      if converted = '1' then
        sample               <= given;
        sample.adc_a         <= resize(code_a, CODE_W);
        sample.adc_b         <= resize(code_b, CODE_W);
        sample.adc_c         <= resize(code_c, CODE_W);
        sample.adc_u_dc      <= resize(code_u_dc, CODE_W);
        sample.position_code <= resize(code_theta, TURN_W);
      end if;

      if rst = '1' then
        entered <= '0';
      end if;
    end if;
  end process;

  core : entity work.fluxproof
    generic map (
      ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS, CARRIER_HALF => CARRIER_HALF, ESTIMATORS => ESTIMATORS
    )
    port map (
      clk => clk, rst => rst, sample_valid => entered, sample => sample, settings => settings, enable => enable,
      trip => trip, clear_trip => clear_trip, host_write => host_write, gate_high => gate_high, gate_low => gate_low,
      sample_trigger => trigger, running => running, tripped => tripped, fault_flags => fault_flags,
      values_valid => values_valid, observed => observed, estimated => estimated, sample_busy => open, brake => brake,
      first_fault => open, early_samples => open, setting_refused => open, min_pulse_used => open,
      double_used => open, carrier => open, duty_valid => open, compare_valid => open
    );

  load_machine : entity work.motor_bench
    generic map (ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS)
    port map (
      clk => clk, rst => rst, gate_high => gate_high, gate_low => gate_low, sample_trigger => trigger, brake => brake,
      motor_u_dc => motor_u_dc, motor_load => motor_load, motor_start => motor_start,
      motor_clear_faults => motor_clear_faults, motor_stiffness => motor_stiffness, motor_v_switch => motor_v_switch,
      motor_v_diode => motor_v_diode, motor_r_a => motor_r_a, motor_r_b => motor_r_b, motor_r_c => motor_r_c,
      motor_psi_start => motor_psi_start, motor_psi_m => motor_psi_m, motor_inv_l_d => motor_inv_l_d,
      motor_inv_l_q => motor_inv_l_q, motor_k_j => motor_k_j, motor_viscous => motor_viscous,
      motor_coulomb => motor_coulomb, motor_pole_pairs => motor_pole_pairs, motor_hold => motor_hold,
      motor_omega_set => motor_omega_set, motor_table_write => motor_table_write,
      motor_table_select => motor_table_select, motor_table_at => motor_table_at, motor_scale_a => motor_scale_a,
      motor_scale_b => motor_scale_b, motor_scale_c => motor_scale_c, motor_scale_u => motor_scale_u,
      motor_zero_a => motor_zero_a, motor_zero_b => motor_zero_b, motor_zero_c => motor_zero_c,
      motor_zero_u => motor_zero_u, motor_k_filter => motor_k_filter, motor_ambient => motor_ambient,
      motor_t_ref => motor_t_ref, motor_heating => motor_heating, motor_k_winding => motor_k_winding,
      motor_k_magnet => motor_k_magnet, motor_tcr_winding => motor_tcr_winding, motor_tcr_magnet => motor_tcr_magnet,
      motor_temp_winding => motor_temp_winding, motor_temp_magnet => motor_temp_magnet,
      motor_noise_i => motor_noise_i,
      motor_noise_u => motor_noise_u,
      motor_angle_offset => motor_angle_offset, motor_i_a => motor_i_a, motor_i_b => motor_i_b, motor_i_c => motor_i_c,
      motor_torque => motor_torque, motor_omega_m => motor_omega_m, motor_theta_m => motor_theta_m,
      motor_theta_e => motor_theta_e, motor_inv_c => motor_inv_c, motor_k_source => motor_k_source,
      motor_k_brake => motor_k_brake, motor_rectifier => motor_rectifier, motor_u_bus => motor_u_bus,
      motor_shoot_through => motor_shoot_through,
      motor_table_high => motor_table_word(35 downto 18), motor_table_low => motor_table_word(17 downto 0),
      motor_counts => (others => '0'), motor_hall_offset => (others => '0'), codes_valid => converted, code_a => code_a,
      code_b => code_b, code_c => code_c, code_u_dc => code_u_dc, code_theta => code_theta, position_now => open,
      pin_a => open, pin_b => open, pin_z => open, hall_a => open, hall_b => open, hall_c => open, motor_ready => open
    );

end architecture rtl;
