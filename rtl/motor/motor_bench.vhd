-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a motor to test against: gates in; codes of a sample, encoder pins and the motor's values out.
-- Only wiring.  At sample_trigger currents, bus and angle are held, as converters do; their codes come 12 clocks later.
-- position_now: the code of the angle of now, for a front end that latches it at the trigger.
-- The bus voltage holds for a step; the charge of the step before and the brake resistor change that of the next one.
-- Formats: those of the blocks; docs/hil.md.
-- Latency: 12 clocks from sample_trigger to codes_valid.  Interval: as far as that.
-- Rounding: the code of the angle is cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity motor_bench is
  generic (
    ADC_BITS      : positive range 12 to 16 := 12;
    POSITION_BITS : positive range 12 to 18 := 16;
    TEMPERATURES  : natural range 0 to 1    := 1
  );
  port (
    clk                 : in  std_logic;
    rst                 : in  std_logic;
    gate_high           : in  unsigned(2 downto 0);
    gate_low            : in  unsigned(2 downto 0);
    sample_trigger      : in  std_logic;
    brake               : in  std_logic;
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
    motor_table_high    : in  unsigned(17 downto 0);
    motor_table_low     : in  unsigned(17 downto 0);
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
    motor_counts        : in  unsigned(15 downto 0);
    motor_hall_offset   : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    codes_valid         : out std_logic;
    code_a              : out unsigned(ADC_BITS - 1 downto 0);
    code_b              : out unsigned(ADC_BITS - 1 downto 0);
    code_c              : out unsigned(ADC_BITS - 1 downto 0);
    code_u_dc           : out unsigned(ADC_BITS - 1 downto 0);
    code_theta          : out unsigned(POSITION_BITS - 1 downto 0);
    position_now        : out unsigned(POSITION_BITS - 1 downto 0);
    pin_a               : out std_logic;
    pin_b               : out std_logic;
    pin_z               : out std_logic;
    hall_a              : out std_logic;
    hall_b              : out std_logic;
    hall_c              : out std_logic;
    motor_ready         : out std_logic;
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
end entity motor_bench;

architecture rtl of motor_bench is
  signal held       : std_logic;
  signal tick       : std_logic;
  signal ticked     : std_logic_vector(1 to 2);
  signal brake_1    : std_logic;
  signal starts     : std_logic;
  signal start_1    : std_logic;
  signal charge     : signed(MOTOR_CHARGE_W - 1 downto 0);
  signal u_bus      : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal u_next     : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal hot_a      : unsigned(23 downto 0);
  signal hot_b      : unsigned(23 downto 0);
  signal hot_c      : unsigned(23 downto 0);
  signal hot_psi    : signed(FLUX_W - 1 downto 0);
  signal filter_rst : std_logic;
  signal y_a        : signed(PU_W - 1 downto 0);
  signal y_b        : signed(PU_W - 1 downto 0);
  signal y_c        : signed(PU_W - 1 downto 0);
  signal i_a_0      : signed(PU_W - 1 downto 0);
  signal i_b_0      : signed(PU_W - 1 downto 0);
  signal i_c_0      : signed(PU_W - 1 downto 0);
  signal i_a_1      : signed(PU_W - 1 downto 0);
  signal i_b_1      : signed(PU_W - 1 downto 0);
  signal i_c_1      : signed(PU_W - 1 downto 0);
  signal u_dc_1     : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal theta_m_1  : unsigned(MOTOR_ANGLE_W - 1 downto 0);
  signal seen       : unsigned(MOTOR_ANGLE_W - 1 downto 0);
begin
  seen         <= motor_theta_m + motor_angle_offset;
  position_now <= seen(MOTOR_ANGLE_W - 1 downto MOTOR_ANGLE_W - POSITION_BITS);

  starts <= motor_start or not motor_ready;
  u_next <= motor_u_dc when starts = '1' else u_bus;

  -- Currents from before a reset stay at the outputs until the first step is through
  filter_rst <= rst or not motor_ready;

  -- What the converters see; without a filter the currents at once
  i_a_0 <= motor_i_a when motor_k_filter = 0 else y_a;
  i_b_0 <= motor_i_b when motor_k_filter = 0 else y_b;
  i_c_0 <= motor_i_c when motor_k_filter = 0 else y_c;

  -- Sample and hold
  process (clk)
  begin
    if rising_edge(clk) then
      held <= sample_trigger;
      if sample_trigger = '1' then
        i_a_1     <= i_a_0;
        i_b_1     <= i_b_0;
        i_c_1     <= i_c_0;
        u_dc_1    <= motor_u_bus;
        theta_m_1 <= motor_theta_m;
      end if;

      if motor_ready = '0' then
        i_a_1     <= (others => '0');
        i_b_1     <= (others => '0');
        i_c_1     <= (others => '0');
        theta_m_1 <= (others => '0');
      end if;

      if rst = '1' then
        held <= '0';
      end if;
    end if;
  end process;

  -- The bus of a step, charged while the motor starts, and when the charge of the last one is there
  process (clk)
  begin
    if rising_edge(clk) then
      ticked <= tick & ticked(1);
      if tick = '1' then
        motor_u_bus <= u_next;
        brake_1     <= brake;
        start_1     <= starts;
      end if;

      if rst = '1' then
        ticked      <= (others => '0');
        motor_u_bus <= (others => '0');
      end if;
    end if;
  end process;

  bus_charge : entity work.motor_charge
    port map (
      clk => clk, rst => rst, tick => tick, gate_high => gate_high, gate_low => gate_low, i_a => motor_i_a,
      i_b => motor_i_b, i_c => motor_i_c, charge => charge
    );

  bus_voltage : entity work.motor_bus
    port map (
      clk => clk, rst => rst, in_valid => ticked(2), charge => charge, u_source => motor_u_dc, brake => brake_1,
      start => start_1, inv_c => motor_inv_c, k_source => motor_k_source, k_brake => motor_k_brake,
      rectifier => motor_rectifier, out_valid => open, u_dc => u_bus
    );

  warm : if TEMPERATURES = 1 generate

    heat : entity work.motor_heat
      generic map (WINDOW_BITS => MOTOR_HEAT_WINDOW_BITS)
      port map (
        clk => clk, rst => rst, in_valid => ticked(2), i_a => motor_i_a, i_b => motor_i_b, i_c => motor_i_c,
        start => start_1, r_a => motor_r_a, r_b => motor_r_b, r_c => motor_r_c, psi_m => motor_psi_m,
        ambient => motor_ambient, t_ref => motor_t_ref, heating => motor_heating, k_winding => motor_k_winding,
        k_magnet => motor_k_magnet, tcr_winding => motor_tcr_winding, tcr_magnet => motor_tcr_magnet,
        out_valid => open, hot_a => hot_a, hot_b => hot_b, hot_c => hot_c, hot_psi => hot_psi,
        temp_winding => motor_temp_winding, temp_magnet => motor_temp_magnet
      );

  end generate;

  cold : if TEMPERATURES = 0 generate
    hot_a              <= motor_r_a;
    hot_b              <= motor_r_b;
    hot_c              <= motor_r_c;
    hot_psi            <= motor_psi_m;
    motor_temp_winding <= motor_ambient;
    motor_temp_magnet  <= motor_ambient;
  end generate;

  load_machine : entity work.motor_model
    port map (
      clk => clk, rst => rst, gate_high => gate_high, gate_low => gate_low, u_dc => u_next, load => motor_load,
      start => motor_start, clear_faults => motor_clear_faults, stiffness => motor_stiffness,
      v_switch => motor_v_switch, v_diode => motor_v_diode, r_a => hot_a, r_b => hot_b, r_c => hot_c,
      psi_start => motor_psi_start, psi_m => hot_psi, inv_l_d => motor_inv_l_d, inv_l_q => motor_inv_l_q,
      k_j => motor_k_j, viscous => motor_viscous, coulomb => motor_coulomb, pole_pairs => motor_pole_pairs,
      hold => motor_hold, omega_set => motor_omega_set, table_write => motor_table_write,
      table_select => motor_table_select, table_at => motor_table_at, table_word => motor_table_high & motor_table_low, tick => tick,
      ready => motor_ready, i_a => motor_i_a, i_b => motor_i_b, i_c => motor_i_c, torque => motor_torque,
      omega_m => motor_omega_m, theta_m => motor_theta_m, theta_e => motor_theta_e,
      shoot_through => motor_shoot_through
    );

  current_filter : entity work.motor_filter
    port map (
      clk => clk, rst => filter_rst, in_valid => ticked(2), i_a => motor_i_a, i_b => motor_i_b, i_c => motor_i_c,
      k_filter => motor_k_filter, out_valid => open, y_a => y_a, y_b => y_b, y_c => y_c
    );

  sensors : entity work.motor_sensors
    generic map (ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS)
    port map (
      clk => clk, rst => rst, in_valid => held, i_a => i_a_1, i_b => i_b_1, i_c => i_c_1, u_dc => u_dc_1,
      theta_m => theta_m_1, scale_a => motor_scale_a, scale_b => motor_scale_b, scale_c => motor_scale_c,
      scale_u => motor_scale_u, zero_a => motor_zero_a, zero_b => motor_zero_b, zero_c => motor_zero_c,
      zero_u => motor_zero_u, noise_i => motor_noise_i, noise_u => motor_noise_u, angle_offset => motor_angle_offset,
      out_valid => codes_valid, code_a => code_a, code_b => code_b, code_c => code_c, code_u_dc => code_u_dc,
      code_theta => code_theta
    );

  encoder : entity work.motor_encoder
    port map (
      clk => clk, rst => rst, in_valid => '1', theta_m => motor_theta_m, theta_e => motor_theta_e,
      counts => motor_counts, hall_offset => motor_hall_offset, out_valid => open, pin_a => pin_a, pin_b => pin_b,
      pin_z => pin_z, hall_a => hall_a, hall_b => hall_b, hall_c => hall_c
    );

end architecture rtl;
