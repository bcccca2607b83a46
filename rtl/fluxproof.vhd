-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the whole drive: raw samples in, gate signals out.  This top only instantiates.
--
--   raw sample -> conditioning -> transforms -> control -> modulation -> gates;  estimators beside it
--
-- Each block starts when its last input is valid and runs in parallel with the blocks that do not depend on it.  Which
-- input is the last is known, because latencies are constants (a test compares them with the measured ones).
-- An instance's lines: strobes; inputs; settings; outputs.  o: observed signals; e: estimates.
-- ESTIMATORS = 0 leaves out the flux estimator and both Adalines: the decoupling then uses the current model alone, as
-- with flux_mode 0, dead time is not compensated, and what they would show is zero.
-- REFERENCES = 1 builds the torque table: with use_table the speed regulator's output is a torque, i_q_ext too, and the
-- table gives both current references at the flux limit of speed and bus voltage, see control/reference_table.vhd.
-- POSITION_LOOP = 1 builds a position loop over the speed loop and the trajectory that it follows, used with
-- position_mode, see control/position_trajectory.vhd.
-- GEARING = 1 lets this loop follow a second encoder, whose code is settings.gear_code, see control/gear.vhd.
-- MODES = 1 builds voltage mode and changes of mode without a step of the voltage, see control/mode_references.vhd.
-- OVERMODULATION = 1 lets the fundamental of the voltage go up to six-step, see modulation/overmodulation.vhd.
-- RESIDUAL = 1 compares the motor with its description, see estimators/motor_residual.vhd.
-- Formats: per unit, see golden_model/formats.py; settings as `fluxproof registers drive.toml` prints them.
-- Latency: sample_valid to duty_valid FLUXPROOF_SAMPLE_TO_DUTY clocks; samples FLUXPROOF_SAMPLE_INTERVAL or more apart.
-- Settings change only between samples, at the latest at the edge at which a sample enters (a setting then applies to
-- this sample, a reference to the next; i_d_ref and i_max, a pair, one sample later); dead_time and min_pulse at any
-- time, they take effect at the valley; double_update while the gates are off; watchdog and fault_ignore at any time.
-- Protection: a sample that comes too early is rejected; what switches the gates off is in io/protection.vhd.
-- Rounding: see the blocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity fluxproof is
  generic (
    ADC_BITS      : positive range 12 to 16   := 16;
    POSITION_BITS : positive range 8 to 18    := 16;
    CARRIER_HALF  : positive range 8 to 32767 := 10000;  -- half a PWM period in clocks
    ESTIMATORS    : natural range 0 to 1      := 1;  -- 0: field-oriented control alone
    REFERENCES    : natural range 0 to 1      := 0;  -- 1: current references by a table of torque and flux limit
    POSITION_LOOP : natural range 0 to 1      := 0;  -- 1: a position loop over the speed loop, and its trajectory
    RESIDUAL      : natural range 0 to 1      := 0;  -- 1: the residual of the motor, with the estimators
    MODES         : natural range 0 to 1      := 0;  -- 1: voltage mode, changes of mode without a step of the voltage
    OVERMODULATION : natural range 0 to 1     := 0;  -- 1: fundamentals up to six-step
    GEARING       : natural range 0 to 1      := 0  -- 1: a gear to a second encoder, with the position loop
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;  -- synchronous, active high
    sample_valid    : in  std_logic;  -- 1: the raw sample below is valid
    sample          : in  sample_t;  -- codes of converters and encoder, references
    settings        : in  settings_t;  -- registers
    enable          : in  std_logic;  -- 1: gates may switch
    trip            : in  std_logic;  -- 1: gates off, latched
    clear_trip      : in  std_logic;  -- 1: clear the latched trip
    host_write      : in  std_logic;  -- 1: the host has written a register, see host_watch
    gate_high       : out unsigned(2 downto 0);  -- upper gates, bit 0 is leg a
    gate_low        : out unsigned(2 downto 0);  -- lower gates, bit 0 is leg a
    sample_trigger  : out std_logic;  -- middle of the zero vector (of both with double_update): take a sample
    running         : out std_logic;  -- gates are switching
    tripped         : out std_logic;  -- 1: a trip is latched
    sample_busy     : out std_logic;  -- a sample is in flight: settings must not change
    brake           : out std_logic;  -- brake resistor on
    fault_flags     : out unsigned(15 downto 0);  -- faults since the last clear_trip, see fault_latch
    first_fault     : out unsigned(15 downto 0);  -- faults that tripped first
    early_samples   : out unsigned(7 downto 0);  -- samples rejected because they came too early
    setting_refused : out std_logic;  -- 1: dead_time and min_pulse contradict each other, refused
    min_pulse_used  : out unsigned(11 downto 0);  -- minimum pulse in force
    double_used     : out std_logic;  -- double_update in force
    carrier         : out unsigned(15 downto 0);  -- carrier, for observation
    duty_valid      : out std_logic;  -- 1: the duties of the sample are valid
    compare_valid   : out std_logic;  -- 1: the compare values are valid
    values_valid    : out std_logic;  -- 1: all of the sample's values below are valid
    observed        : out observed_t;  -- values of the sample, from conditioning to compare values
    estimated       : out estimated_t  -- values of the estimators
  );
end entity fluxproof;

architecture rtl of fluxproof is
  -- The sample that is processed
  signal code_a, code_b, code_c, code_u_dc         : unsigned(ADC_BITS - 1 downto 0);
  signal code_theta                                : unsigned(POSITION_BITS - 1 downto 0);
  signal omega_ref, i_d_ref, i_q_ext               : signed(PU_W - 1 downto 0);
  signal temp_winding                              : signed(15 downto 0);
  signal speed_mode, temp_valid, clear_faults, run : std_logic;

  -- Strobes
  signal sample_entered, latch_valid, current_soon    : std_logic;
  signal current_valid, theta_valid, omega_valid      : std_logic;
  signal dc_valid, circle_valid, reference_valid      : std_logic;
  signal i_q_valid                                    : std_logic;
  signal dc_soon, alpha_beta_soon, dq_soon            : std_logic;
  signal trig_soon, trig_valid                        : std_logic;
  signal models_valid, lambda_valid, decoupling_valid : std_logic;
  signal dq_voltage_soon, dq_voltage_valid            : std_logic;
  signal ab_voltage_valid, duty_ready, compare_ready  : std_logic;

  -- Values between the blocks of the control
  signal inverse, inverse_beta                  : unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
  signal i_alpha, i_beta, i_d_limited, i_q_max  : signed(PU_W - 1 downto 0);
  signal i_q_asked                              : signed(PU_W - 1 downto 0);
  signal theta_out                              : unsigned(TURN_W - 1 downto 0);
  signal cos_theta, sin_theta, cos_out, sin_out : signed(PU_W - 1 downto 0);
  signal u_pi_d, u_pi_q                         : signed(PU_W - 1 downto 0);
  signal model_d, model_q                       : signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
  signal merged_d, merged_q                     : signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
  signal merged, ended, estimate_limited        : std_logic;

  -- From the torque table to the control
  signal i_d_asked, torque_limit, torque_ref : signed(PU_W - 1 downto 0);

  -- From the position loop to the speed regulator
  signal omega_source             : signed(PU_W - 1 downto 0);
  signal omega_asked, torque_ff   : signed(PU_W - 1 downto 0);
  signal regulates, position_acts : std_logic;
  signal torque_ff_used           : signed(PU_W - 1 downto 0);

  -- From the modes to the regulators and to the circle
  signal by_voltage, take_over, follows       : std_logic;
  signal i_q_used, i_q_made                   : signed(PU_W - 1 downto 0);
  signal i_d_source                           : signed(PU_W - 1 downto 0);
  signal u_rest_d, u_rest_q                   : signed(PU_W - 1 downto 0);
  signal asked_d, asked_q, turned_d, turned_q : signed(PU_W - 1 downto 0);

  -- Of the over-modulation
  signal rip_alpha, rip_beta             : signed(PU_W - 1 downto 0);
  signal u_rip_d, u_rip_q                : signed(PU_W - 1 downto 0);
  signal freed_d, freed_q                : signed(PU_W - 1 downto 0);  -- rotational voltage without the ripple
  signal inverse_used, inverse_beta_used : unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);

  -- From the estimators to the control
  signal flux_mode              : unsigned(1 downto 0);
  signal lambda_m_d, lambda_m_q : signed(FLUX_W - 1 downto 0);
  signal minus_rho              : signed(MINUS_RHO_W - 1 downto 0);

  -- Protection
  signal guard_busy, gate_trip, gate_clear, period : std_logic;
  signal gates_on, charging, charged               : std_logic;
  signal compare_a, compare_b, compare_c           : unsigned(15 downto 0);

  signal o : observed_t;
  signal e : estimated_t;
begin
  -- Raw sample

  sample_entered <= sample_valid and not guard_busy;

  latch : entity work.sample_latch
    generic map (ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, in_valid => sample_entered,
              adc_a => sample.adc_a(ADC_BITS - 1 downto 0), adc_b => sample.adc_b(ADC_BITS - 1 downto 0),
              adc_c => sample.adc_c(ADC_BITS - 1 downto 0), adc_u_dc => sample.adc_u_dc(ADC_BITS - 1 downto 0),
              position_code => sample.position_code(POSITION_BITS - 1 downto 0), omega_ref_in => sample.omega_ref,
              i_d_ref_in => sample.i_d_ref, i_q_ext_in => sample.i_q_ext, speed_mode_in => sample.speed_mode,
              temp_winding_in => sample.temp_winding, temp_valid_in => sample.temp_valid,
              clear_faults_in => sample.clear_faults, run_in => running,
              out_valid => latch_valid, code_a => code_a, code_b => code_b, code_c => code_c, code_u_dc => code_u_dc,
              code_theta => code_theta, omega_ref => omega_ref, i_d_ref => i_d_ref, i_q_ext => i_q_ext,
              speed_mode => speed_mode, temp_winding => temp_winding, temp_valid => temp_valid,
              clear_faults => clear_faults, run => run);

  -- Conditioning

  conditioning : entity work.current_conditioning
    generic map (ADC_BITS => ADC_BITS)
    port map (clk => clk, rst => rst, in_valid => latch_valid,
              code_a => code_a, code_b => code_b, code_c => code_c,
              offset_a => settings.offset_a, offset_b => settings.offset_b, offset_c => settings.offset_c,
              gain_a => settings.gain_a, gain_b => settings.gain_b, gain_c => settings.gain_c,
              two_sensors => settings.two_sensors,
              out_soon => current_soon, out_valid => current_valid, i_a => o.i_a, i_b => o.i_b, i_c => o.i_c,
              current_at_rail => o.current_at_rail);

  angle : entity work.position
    generic map (POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, in_valid => latch_valid,
              code_theta => code_theta,
              reverse => settings.reverse, pole_pairs => settings.pole_pairs, theta_offset => settings.theta_offset,
              out_valid => theta_valid, theta_me => o.theta_me);

  speed_measurement : entity work.speed
    generic map (POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, in_valid => latch_valid, code_theta => code_theta,
              reverse => settings.reverse, k_speed => settings.k_speed, k_filter => settings.k_filter,
              position_restart => settings.position_restart, speed_given => settings.speed_given,
              omega_given => settings.omega_given, out_valid => omega_valid, omega_me => o.omega_me,
              speed_was_given => o.speed_was_given, position_restarted => o.position_restarted);

  bus_voltage : entity work.u_dc_conditioning
    generic map (ADC_BITS => ADC_BITS)
    port map (clk => clk, rst => rst, in_valid => latch_valid,
              code_u_dc => code_u_dc,
              u_dc_offset => settings.u_dc_offset, u_dc_gain => settings.u_dc_gain, k_u_max => settings.k_u_max,
              out_soon => dc_soon, out_valid => dc_valid, u_dc => o.u_dc, u_max => o.u_max, u_dc_at_rail => o.u_dc_at_rail);

  bus_reciprocal : entity work.u_dc_processing
    port map (clk => clk, rst => rst, in_valid => dc_soon,
              u_dc => o.u_dc,
              out_valid => open, inverse => inverse, inverse_beta => inverse_beta, u_dc_low => o.u_dc_low);

  -- Transforms

  stator_frame : entity work.clarke
    port map (clk => clk, rst => rst, in_valid => current_soon,
              i_a => o.i_a, i_b => o.i_b, i_c => o.i_c,
              out_soon => alpha_beta_soon, out_valid => open, i_alpha => i_alpha, i_beta => i_beta);

  delay : entity work.svm_delay_compensation
    port map (clk => clk, rst => rst, in_valid => omega_valid,
              theta_me => o.theta_me, omega_me => o.omega_me,
              k_delay => settings.k_delay,
              out_valid => open, theta_out => theta_out);

  trig : entity work.sincos
    port map (clk => clk, rst => rst, in_valid => theta_valid,
              theta_me => o.theta_me, theta_out => theta_out,
              out_soon => trig_soon, out_valid => trig_valid, cos_theta => cos_theta, sin_theta => sin_theta,
              cos_out => cos_out, sin_out => sin_out);

  rotor_frame : entity work.park
    port map (clk => clk, rst => rst, in_valid => alpha_beta_soon,
              i_alpha => i_alpha, i_beta => i_beta, cos_theta => cos_theta, sin_theta => sin_theta,
              out_soon => dq_soon, out_valid => open, i_d => o.i_d, i_q => o.i_q);

  -- Control

  current_circle : entity work.current_limit
    port map (clk => clk, rst => rst, in_valid => latch_valid,
              i_d_ref => i_d_asked,
              i_max => settings.i_max,
              out_valid => circle_valid, i_d_limited => i_d_limited, i_q_max => i_q_max);

  by_position : if POSITION_LOOP = 1 generate
    signal position_ref   : signed(o.shaft_position'range);
    signal omega_ff       : signed(INTEGRAL_W - 1 downto 0);
    signal at_rest        : std_logic;
    signal led            : signed(o.shaft_position'range);
    signal gear_free      : std_logic;
    signal at_stop        : std_logic;
  begin
    position_acts <= settings.position_mode;

    position_regulator : entity work.position_control
      generic map (POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, in_valid => latch_valid,
                code_theta => code_theta, position_ref => position_ref, omega_ff => omega_ff, at_rest => at_rest,
                omega_ref => omega_source, speed_mode => speed_mode,
                reverse => settings.reverse, position_restart => settings.position_restart,
                position_mode => settings.position_mode, position_kp => settings.position_kp,
                position_band => settings.position_band, omega_most => settings.omega_most,
                out_valid => open, shaft_position => o.shaft_position, position_error => o.position_error,
                omega_asked => omega_asked, regulates => regulates);

    by_gear : if GEARING = 1 generate
      master_gear : entity work.gear
        port map (clk => clk, rst => rst, in_valid => latch_valid,
                  gear_free => gear_free, at_stop => at_stop,
                  gear_code => settings.gear_code, gear_on => settings.gear_on,
                  gear_numerator => settings.gear_numerator, gear_denominator => settings.gear_denominator,
                  gear_step => settings.gear_step, gear_lead => settings.gear_lead, gear_smooth => settings.gear_smooth,
                  out_valid => open, gear_way => o.gear_way, led => led, gear_engaged => o.gear_engaged,
                  gear_stopped => o.gear_stopped);
    else generate
      led            <= (others => '0');
      o.gear_way     <= (others => '0');
      o.gear_engaged <= '0';
      o.gear_stopped <= '0';
    end generate by_gear;

    trajectory : entity work.position_trajectory
      port map (clk => clk, rst => rst, in_valid => latch_valid,
                shaft_position => o.shaft_position, led => led, run => run,
                position_mode => settings.position_mode, position_target => settings.position_target,
                move_speed => settings.move_speed, move_step => settings.move_step, jerk_bits => settings.jerk_bits,
                use_stops => settings.use_stops, stop_low => settings.stop_low, stop_high => settings.stop_high,
                torque_lead => settings.torque_lead, k_speed => settings.k_speed, k_filter => settings.k_filter,
                k_inertia => settings.k_inertia, k_viscous => settings.k_viscous, coulomb => settings.coulomb,
                out_valid => open, position_ref => position_ref, omega_ff => omega_ff, torque_ff => torque_ff,
                at_rest => at_rest, gear_free => gear_free, at_stop => at_stop);
  else generate
    position_acts    <= '0';
    omega_asked      <= omega_source;
    regulates        <= speed_mode;
    torque_ff        <= (others => '0');
    o.shaft_position <= (others => '0');
    o.position_error <= (others => '0');
    o.gear_way       <= (others => '0');
    o.gear_engaged   <= '0';
    o.gear_stopped   <= '0';
  end generate by_position;

  by_mode : if MODES = 1 generate
    signal u_d_now, u_q_now, i_d_now, i_q_now, omega_now : signed(PU_W - 1 downto 0);
    signal hold_d, hold_q, hold_omega, by_speed          : std_logic;
  begin
    modes : entity work.mode_change
      port map (clk => clk, rst => rst, in_valid => latch_valid,
                speed_mode => speed_mode, by_position => position_acts,
                voltage_mode => settings.voltage_mode,
                out_valid => open, by_voltage => by_voltage, take_over => take_over, follows => follows);

    beginnings : entity work.mode_references
      port map (clk => clk, rst => rst, in_valid => dq_voltage_valid,
                u_d => o.u_d, u_q => o.u_q, u_dec_d => o.u_dec_d, u_dec_q => o.u_dec_q, u_comp_d => e.u_comp_d,
                u_comp_q => e.u_comp_q, i_d => o.i_d, i_q_made => i_q_made, i_d_source => i_d_source,
                i_q_ext => i_q_ext, torque_ref => torque_ref, omega_me => o.omega_me, omega_ref => omega_ref,
                by_voltage => by_voltage, by_speed => by_speed, regulates => regulates, run => run,
                u_d_ext => settings.u_d_ext, u_q_ext => settings.u_q_ext, u_step => settings.u_step,
                i_step => settings.i_step, omega_step => settings.omega_step,
                out_valid => open, u_d_now => u_d_now, u_q_now => u_q_now, i_d_now => i_d_now, i_q_now => i_q_now,
                hold_d => hold_d, hold_q => hold_q, omega_now => omega_now, hold_omega => hold_omega,
                u_rest_d => u_rest_d, u_rest_q => u_rest_q);

    by_speed     <= speed_mode and not position_acts;
    omega_source <= omega_now when by_speed = '1' and hold_omega = '1' else omega_ref;
    i_d_asked    <= i_d_now when hold_d = '1' else i_d_source;
    i_q_used     <= i_q_now when hold_q = '1' or take_over = '1' else i_q_ext;
    -- The trajectory's torque of the sample before ends with position mode, not a sample after it
    torque_ff_used <= torque_ff and position_acts;

    asked_d  <= u_d_now when by_voltage = '1' else u_pi_d;
    asked_q  <= u_q_now when by_voltage = '1' else u_pi_q;
    turned_d <= freed_d and not by_voltage;
    turned_q <= freed_q and not by_voltage;
  else generate
    by_voltage     <= '0';
    take_over      <= '0';
    follows        <= '0';
    i_d_asked      <= i_d_source;
    i_q_used       <= i_q_ext;
    omega_source   <= omega_ref;
    torque_ff_used <= torque_ff;
    u_rest_d       <= (others => '0');
    u_rest_q       <= (others => '0');
    asked_d        <= u_pi_d;
    asked_q        <= u_pi_q;
    turned_d       <= freed_d;
    turned_q       <= freed_q;
  end generate by_mode;

  speed_regulator : entity work.speed_pi
    port map (clk => clk, rst => rst, in_valid => omega_valid,
              omega_ref => omega_asked, omega_me => o.omega_me, i_q_ext => i_q_used, i_q_max => torque_limit,
              regen_limited => o.regen_limited, speed_mode => regulates, take_over => take_over, run => run,
              torque_ff => torque_ff_used,
              speed_kp => settings.speed_kp, speed_ki => settings.speed_ki,
              out_valid => reference_valid, i_q_ref => torque_ref, speed_limited => o.speed_limited);

  by_table : if REFERENCES = 1 generate
    signal i_d_table, i_q_table, i_q_circle, torque_max, torque_now : signed(PU_W - 1 downto 0);
    signal flux_part, share                                         : unsigned(15 downto 0);
    signal torque_gain                                              : unsigned(16 downto 0);
    signal flux_part_valid, references_valid                        : std_logic;
    signal calm, torque_limited                                     : std_logic;
  begin
    flux_circle : entity work.flux_limit
      port map (clk => clk, rst => rst, in_valid => dc_valid,
                omega_me => o.omega_me, u_max => o.u_max, share => share,
                k_flux => settings.k_flux,
                out_valid => flux_part_valid, flux_part => flux_part);

    voltage_regulator : entity work.voltage_loop
      port map (clk => clk, rst => rst, in_valid => dq_voltage_valid,
                u_max => o.u_max, run => run, u_d => o.u_d, u_q => o.u_q,
                u_share => settings.u_share, k_voltage => settings.k_voltage, share_min => settings.share_min,
                out_valid => open, share => share, calm => calm);

    ramp : entity work.torque_ramp
      port map (clk => clk, rst => rst, in_valid => reference_valid,
                torque_ref => torque_ref, run => run,
                torque_step => settings.torque_step,
                out_valid => open, torque_now => torque_now);

    references : entity work.reference_table
      port map (clk => clk, rst => rst, in_valid => flux_part_valid,
                flux_part => flux_part, torque_now => torque_now, torque_gain => torque_gain,
                table_word => settings.table_word,
                out_valid => references_valid, i_d_table => i_d_table, i_q_table => i_q_table,
                torque_max => torque_max, torque_limited => torque_limited);

    map_correction : entity work.torque_correction
      port map (clk => clk, rst => rst, in_valid => references_valid,
                torque_now => torque_now, torque => e.torque, omega_me => o.omega_me,
                torque_limited => torque_limited, calm => calm, run => run,
                k_torque => settings.k_torque, omega_learn => settings.omega_learn,
                out_valid => open, torque_gain => torque_gain);

    table_current : entity work.current_reference
      port map (clk => clk, rst => rst, in_valid => circle_valid,
                i_q_table => i_q_table, i_q_max => i_q_max,
                use_table => settings.use_table,
                out_valid => open, i_q_circle => i_q_circle);

    i_d_source   <= i_d_table when settings.use_table = '1' else i_d_ref;
    torque_limit <= torque_max when settings.use_table = '1' else i_q_max;
    i_q_made     <= e.torque when settings.use_table = '1' else o.i_q;
    i_q_asked    <= i_q_circle when settings.use_table = '1' else torque_ref;
  else generate
    i_d_source   <= i_d_ref;
    torque_limit <= i_q_max;
    i_q_made     <= o.i_q;
    i_q_asked    <= torque_ref;
  end generate by_table;

  regeneration : entity work.regeneration_limit
    port map (clk => clk, rst => rst, in_valid => reference_valid,
              i_q_asked => i_q_asked, omega_me => o.omega_me, u_dc => o.u_dc,
              i_max => settings.i_max, regen_start => settings.regen_start, regen_slope => settings.regen_slope,
              out_valid => i_q_valid, i_q_ref => o.i_q_ref, regen_limited => o.regen_limited);

  current_regulators : entity work.current_pi
    port map (clk => clk, rst => rst, in_valid => dq_soon,
              i_d => o.i_d, i_q => o.i_q, i_d_ref => i_d_limited, i_q_ref => o.i_q_ref, sat_d => o.sat_d, sat_q => o.sat_q,
              u_rest_d => u_rest_d, u_rest_q => u_rest_q, follows => follows, by_voltage => by_voltage, run => run,
              kp_d => settings.kp_d, ki_d => settings.ki_d, kp_q => settings.kp_q, ki_q => settings.ki_q,
              out_soon => open, out_valid => open, u_pi_d => u_pi_d, u_pi_q => u_pi_q, u_int_d => o.u_int_d,
              u_int_q => o.u_int_q);

  models : entity work.flux_models
    port map (clk => clk, rst => rst, in_valid => dq_soon,
              i_d => o.i_d, i_q => o.i_q, lambda_m_d => lambda_m_d, lambda_m_q => lambda_m_q,
              merge_known => e.merge_known, run => run, minus_rho => minus_rho,
              flux_mode => flux_mode, l_d => settings.l_d, l_q => settings.l_q, lambda_mg => settings.lambda_mg,
              out_valid => models_valid, model_d => model_d, model_q => model_q, merged_d => merged_d,
              merged_q => merged_q, merged => merged, ended => ended);

  flux : entity work.flux_estimate
    port map (clk => clk, rst => rst, in_valid => models_valid,
              model_d => model_d, model_q => model_q, merged_d => merged_d, merged_q => merged_q, merged => merged,
              ended => ended, lambda_pi_d => e.lambda_pi_d, lambda_pi_q => e.lambda_pi_q,
              out_valid => lambda_valid, lambda_d => o.lambda_d, lambda_q => o.lambda_q,
              estimate_limited => estimate_limited);

  chord : entity work.chord_speed
    port map (clk => clk, rst => rst, in_valid => omega_valid,
              omega_me => o.omega_me,
              k_chord => settings.k_chord,
              out_valid => open, omega_chord => o.omega_chord);

  cross_coupling : entity work.decoupling
    port map (clk => clk, rst => rst, in_valid => lambda_valid,
              omega_chord => o.omega_chord, lambda_d => o.lambda_d, lambda_q => o.lambda_q,
              out_valid => decoupling_valid, u_dec_d => o.u_dec_d, u_dec_q => o.u_dec_q);

  by_hexagon : if OVERMODULATION = 1 generate
    ripple_answer : entity work.ripple_voltage
      port map (clk => clk, rst => rst, in_valid => trig_soon,
                rip_alpha => rip_alpha, rip_beta => rip_beta, cos_theta => cos_theta, sin_theta => sin_theta,
                omega_me => o.omega_me,
                k_ripple => settings.k_ripple,
                out_valid => open, u_rip_d => u_rip_d, u_rip_q => u_rip_q);

    hexagon : entity work.overmodulation
      port map (clk => clk, rst => rst, in_valid => decoupling_valid,
                u_d => o.u_d, u_pi_q => asked_q, u_dec_q => turned_q, u_comp_q => e.u_comp_q, u_max => o.u_max,
                inverse => inverse, inverse_beta => inverse_beta,
                out_valid => open, inverse_used => inverse_used, inverse_beta_used => inverse_beta_used);

    freed_d <= saturate(resize(o.u_dec_d, PU_W + 1) + u_rip_d, PU_W);
    freed_q <= saturate(resize(o.u_dec_q, PU_W + 1) + u_rip_q, PU_W);
  else generate
    u_rip_d           <= (others => '0');
    u_rip_q           <= (others => '0');
    freed_d           <= o.u_dec_d;
    freed_q           <= o.u_dec_q;
    inverse_used      <= inverse;
    inverse_beta_used <= inverse_beta;
  end generate by_hexagon;

  circle : entity work.voltage_limit
    port map (clk => clk, rst => rst, in_valid => decoupling_valid,
              u_pi_d => asked_d, u_pi_q => asked_q, u_dec_d => turned_d, u_dec_q => turned_q, u_comp_d => e.u_comp_d,
              u_comp_q => e.u_comp_q, u_max => o.u_max, lambda_d => o.lambda_d,
              out_soon => dq_voltage_soon, out_valid => dq_voltage_valid, u_d => o.u_d, u_q => o.u_q, sat_d => o.sat_d,
              sat_q => o.sat_q);

  -- Modulation

  stator_voltage : entity work.inverse_park
    port map (clk => clk, rst => rst, in_valid => dq_voltage_soon,
              u_d => o.u_d, u_q => o.u_q, cos_theta => cos_out, sin_theta => sin_out,
              out_valid => ab_voltage_valid, u_alpha => o.u_alpha, u_beta => o.u_beta);

  modulator : entity work.svm
    generic map (OVERMODULATION => OVERMODULATION)
    port map (clk => clk, rst => rst, in_valid => ab_voltage_valid,
              u_alpha => o.u_alpha, u_beta => o.u_beta, inverse => inverse_used, inverse_beta => inverse_beta_used,
              out_valid => duty_ready, duty_a => o.duty_a, duty_b => o.duty_b, duty_c => o.duty_c);

  compare : entity work.pwm_compare
    generic map (CARRIER_HALF => CARRIER_HALF)
    port map (clk => clk, rst => rst, in_valid => duty_ready,
              duty_a => o.duty_a, duty_b => o.duty_b, duty_c => o.duty_c,
              min_pulse => min_pulse_used, double_update => double_used,
              out_valid => compare_ready, compare_a => o.compare_a, compare_b => o.compare_b, compare_c => o.compare_c);

  -- Estimators

  estimation : if ESTIMATORS = 1 generate
    signal period_valid, model_valid, model_ab_valid : std_logic;
    signal factor_valid, delta_valid, merge_valid    : std_logic;
    signal comp_valid                                : std_logic;
    signal towards_valid                             : std_logic;
    signal towards_alpha, towards_beta               : signed(PU_W - 1 downto 0);
    signal r                                         : unsigned(RESISTANCE_W - 1 downto 0);
    signal rho                                       : unsigned(RHO_W - 1 downto 0);
    signal voltage_known, loss_shown                 : std_logic;
    signal regulated, resumes                        : std_logic;
    signal u_clean_alpha, u_clean_beta               : signed(FLUX_W - 1 downto 0);
    signal lambda_c_alpha, lambda_c_beta             : signed(FLUX_W - 1 downto 0);
    signal factor                                    : signed(17 downto 0);
    signal n_omega                                   : unsigned(3 downto 0);
    signal lambda_add_d, lambda_add_q                : signed(FLUX_W - 1 downto 0);
    signal u_comp_alpha, u_comp_beta                 : signed(PU_W - 1 downto 0);
    signal s_alpha, s_beta                           : signed(PU_W - 1 downto 0);
    signal v_leg                                     : signed(V_LEG_W - 1 downto 0);
    signal model_limited, merge_limited              : std_logic;
    signal delta_limited, compensation_limited       : std_logic;
  begin
    flux_mode <= settings.flux_mode;
    -- Regulators that only follow show neither flux nor loss
    regulated  <= run and not by_voltage;
    resumes    <= follows and not by_voltage;
    loss_shown <= voltage_known and not by_voltage;

    resistance : entity work.winding_resistance
      port map (clk => clk, rst => rst, in_valid => latch_valid,
                temp_winding => temp_winding, temp_valid => temp_valid,
                r_s => settings.r_s, tcr => settings.tcr, t_0 => settings.t_0, t_min => settings.t_min,
                t_max => settings.t_max, t_s => settings.t_s,
                out_valid => open, r => r, rho => rho, minus_rho => minus_rho, temp_lost => e.temp_lost);

    merged_flux : entity work.flux_park
      port map (clk => clk, rst => rst, in_valid => trig_soon,
                lambda_m_alpha => e.lambda_m_alpha, lambda_m_beta => e.lambda_m_beta, cos_theta => cos_theta,
                sin_theta => sin_theta,
                out_valid => open, lambda_m_d => lambda_m_d, lambda_m_q => lambda_m_q);

    leg_compensation : entity work.dead_time_compensation
      port map (clk => clk, rst => rst, in_valid => latch_valid,
                v_comp => e.v_comp, s_alpha => s_alpha, s_beta => s_beta,
                out_valid => open, u_comp_alpha => u_comp_alpha, u_comp_beta => u_comp_beta);

    compensation_dq : entity work.park
      port map (clk => clk, rst => rst, in_valid => trig_valid,
                i_alpha => u_comp_alpha, i_beta => u_comp_beta, cos_theta => cos_out, sin_theta => sin_out,
                out_soon => open, out_valid => comp_valid, i_d => e.u_comp_d, i_q => e.u_comp_q);

    direction_functions : entity work.park
      port map (clk => clk, rst => rst, in_valid => trig_valid,
                i_alpha => s_alpha, i_beta => s_beta, cos_theta => cos_out, sin_theta => sin_out,
                out_soon => open, out_valid => open, i_d => e.d_d, i_q => e.d_q);

    period_voltage : entity work.applied_voltage
      generic map (CARRIER_HALF => CARRIER_HALF)
      port map (clk => clk, rst => rst, in_valid => dc_soon,
                compare_a => o.compare_a, compare_b => o.compare_b, compare_c => o.compare_c, u_dc => o.u_dc,
                u_dc_at_rail => o.u_dc_at_rail, run => run,
                out_valid => period_valid, u_applied_alpha => e.u_applied_alpha, u_applied_beta => e.u_applied_beta,
                voltage_known => voltage_known);

    motor_voltage : entity work.clean_voltage
      port map (clk => clk, rst => rst, in_valid => period_valid,
                u_applied_alpha => e.u_applied_alpha, u_applied_beta => e.u_applied_beta, s_alpha => s_alpha,
                s_beta => s_beta, v_leg => v_leg,
                out_valid => open, u_clean_alpha => u_clean_alpha, u_clean_beta => u_clean_beta);

    ripple_of_hexagon : if OVERMODULATION = 1 generate
      ripple : entity work.voltage_ripple
        port map (clk => clk, rst => rst, in_valid => period_valid,
                  u_applied_alpha => e.u_applied_alpha, u_applied_beta => e.u_applied_beta,
                  voltage_known => voltage_known, u_alpha => o.u_alpha, u_beta => o.u_beta, cos_theta => cos_theta,
                  sin_theta => sin_theta, run => run,
                  t_s => settings.t_s,
                  out_valid => open, rip_alpha => rip_alpha, rip_beta => rip_beta);
    else generate
      rip_alpha <= (others => '0');
      rip_beta  <= (others => '0');
    end generate ripple_of_hexagon;

    by_direction : if POSITION_LOOP = 1 generate
      towards : entity work.direction_current
        port map (clk => clk, rst => rst, in_valid => trig_valid,
                  i_d_ref => i_d_limited, i_q_ref => o.i_q_ref, i_alpha => i_alpha, i_beta => i_beta,
                  cos_theta => cos_theta, sin_theta => sin_theta, sat_d => o.sat_d, sat_q => o.sat_q, run => run,
                  position_mode => settings.position_mode,
                  out_valid => towards_valid, towards_alpha => towards_alpha, towards_beta => towards_beta);
    else generate
      towards_valid <= comp_valid;
      towards_alpha <= i_alpha;
      towards_beta  <= i_beta;
    end generate by_direction;

    directions : entity work.current_directions
      port map (clk => clk, rst => rst, in_valid => towards_valid,
                i_alpha => towards_alpha, i_beta => towards_beta, omega_me => o.omega_me,
                k_ahead => settings.k_ahead, k_sign => settings.k_sign,
                out_valid => open, s_alpha => s_alpha, s_beta => s_beta);

    magnetic_model : entity work.current_model
      port map (clk => clk, rst => rst, in_valid => models_valid,
                model_d => model_d, model_q => model_q, lambda_add_d => lambda_add_d, lambda_add_q => lambda_add_q,
                out_valid => model_valid, lambda_c_d => e.lambda_c_d, lambda_c_q => e.lambda_c_q,
                model_limited => model_limited);

    model_flux : entity work.flux_inverse_park
      port map (clk => clk, rst => rst, in_valid => model_valid,
                lambda_c_d => e.lambda_c_d, lambda_c_q => e.lambda_c_q, cos_theta => cos_theta, sin_theta => sin_theta,
                out_valid => model_ab_valid, lambda_c_alpha => lambda_c_alpha, lambda_c_beta => lambda_c_beta);

    merge : entity work.flux_merge
      port map (clk => clk, rst => rst, in_valid => model_ab_valid,
                i_alpha => i_alpha, i_beta => i_beta, lambda_c_alpha => lambda_c_alpha, lambda_c_beta => lambda_c_beta,
                u_applied_alpha => u_clean_alpha, u_applied_beta => u_clean_beta, voltage_known => voltage_known,
                run => run, rho => rho,
                omega_0 => settings.omega_0, xi => settings.xi, t_s => settings.t_s,
                out_valid => merge_valid, lambda_m_alpha => e.lambda_m_alpha, lambda_m_beta => e.lambda_m_beta,
                merge_known => e.merge_known, merge_limited => merge_limited);

    speed_inverse : entity work.speed_reciprocal
      port map (clk => clk, rst => rst, in_valid => omega_valid,
                omega_me => o.omega_me,
                omega_min => settings.omega_min, k_ramp => settings.k_ramp,
                out_valid => factor_valid, factor => factor, n_omega => n_omega);

    flux_error : entity work.delta_lambda
      port map (clk => clk, rst => rst, in_valid => factor_valid,
                u_int_d => o.u_int_d, u_int_q => o.u_int_q, i_d => o.i_d, i_q => o.i_q, sat_d => o.sat_d,
                sat_q => o.sat_q, current_at_rail => o.current_at_rail, voltage_known => voltage_known, run => regulated,
                factor => factor, n_omega => n_omega, r => r,
                out_valid => delta_valid, delta_lambda_d => e.delta_lambda_d, delta_lambda_q => e.delta_lambda_q,
                delta_held => e.delta_held, delta_limited => delta_limited);

    compensation : entity work.flux_compensation
      port map (clk => clk, rst => rst, in_valid => delta_valid,
                delta_lambda_d => e.delta_lambda_d, delta_lambda_q => e.delta_lambda_q, delta_held => e.delta_held,
                before_d => e.lambda_pi_d, before_q => e.lambda_pi_q, resumes => resumes,
                flux_mode => flux_mode, flux_kp => settings.flux_kp, flux_ki => settings.flux_ki,
                delta_max => settings.delta_max,
                out_valid => open, lambda_pi_d => e.lambda_pi_d, lambda_pi_q => e.lambda_pi_q,
                lambda_add_d => lambda_add_d, lambda_add_q => lambda_add_q,
                compensation_limited => compensation_limited);

    torque_estimate : entity work.torque
      port map (clk => clk, rst => rst, in_valid => lambda_valid,
                lambda_d => o.lambda_d, lambda_q => o.lambda_q, i_d => o.i_d, i_q => o.i_q,
                out_valid => open, torque => e.torque);

    monitor : entity work.flux_monitor
      port map (clk => clk, rst => rst, in_valid => merge_valid,
                current_at_rail => o.current_at_rail, u_dc_at_rail => o.u_dc_at_rail, u_dc_low => o.u_dc_low,
                model_limited => model_limited, merge_limited => merge_limited, delta_limited => delta_limited,
                compensation_limited => compensation_limited, estimate_limited => estimate_limited,
                clear_faults => clear_faults,
                out_valid => values_valid, flux_faults => e.flux_faults);

    inverter_loss : entity work.v_dead_adaline
      port map (clk => clk, rst => rst, in_valid => dq_voltage_valid,
                u_pi_d => u_pi_d, d_d => e.d_d, i_d => o.i_d, i_q => o.i_q, sat_d => o.sat_d, sat_q => o.sat_q,
                current_at_rail => o.current_at_rail, voltage_known => loss_shown, run => run,
                k_lp => settings.k_lp, eta_v => settings.eta_v, gamma => settings.gamma, zeta => settings.zeta,
                v_thr => settings.v_thr, v_comp_max => settings.v_comp_max, i_learn => settings.i_learn,
                compensate => settings.compensate, v_start => settings.v_start,
                out_valid => open, v_dead => e.v_dead, v_comp => e.v_comp, v_leg => v_leg,
                v_comp_limited => e.v_comp_limited);

    magnet_flux : entity work.psi_adaline
      port map (clk => clk, rst => rst, in_valid => dq_voltage_valid,
                u_q => o.u_q, d_q => e.d_q, v_leg => v_leg, i_d => o.i_d, i_q => o.i_q, r => r,
                omega_chord => o.omega_chord, sat_d => o.sat_d, sat_q => o.sat_q, current_at_rail => o.current_at_rail,
                voltage_known => voltage_known, run => run,
                l_d => settings.l_d, eta_psi => settings.eta_psi, omega_psi_min => settings.omega_psi_min,
                out_valid => open, psi_m => e.psi_m, psi_held => e.psi_held);

    residual_of_motor : if RESIDUAL = 1 generate
      residual : entity work.motor_residual
        port map (clk => clk, rst => rst, in_valid => models_valid,
                  model_d => model_d, model_q => model_q, cos_theta => cos_theta, sin_theta => sin_theta, i_a => o.i_a,
                  i_b => o.i_b, i_c => o.i_c, i_alpha => i_alpha, i_beta => i_beta, i_d => o.i_d, i_q => o.i_q,
                  omega_me => o.omega_me, u_applied_alpha => e.u_applied_alpha,
                  u_applied_beta => e.u_applied_beta, s_alpha => s_alpha, s_beta => s_beta, rho => rho,
                  sat_d => o.sat_d, sat_q => o.sat_q, voltage_known => voltage_known, current_at_rail => o.current_at_rail, run => run,
                  t_s => settings.t_s, residual_leg => settings.residual_leg, residual_min => settings.residual_min, residual_w => settings.residual_w,
                  residual_i => settings.residual_i, residual_light => settings.residual_light,
                  residual_slow => settings.residual_slow, residual_sum_max => settings.residual_sum_max,
                  residual_sum_i => settings.residual_sum_i, residual_samples => settings.residual_samples,
                  out_valid => open, residual_d => e.residual_d, residual_q => e.residual_q,
                  residual_mean_d => e.residual_mean_d, residual_mean_q => e.residual_mean_q,
                  residual_sixth_d => e.residual_sixth_d, residual_sixth_q => e.residual_sixth_q,
                  residual_power => e.residual_power, residual_sum => e.residual_sum,
                  motor_differs => e.motor_differs);
    else generate
      e.residual_d <= NOTHING_ESTIMATED.residual_d;
      e.residual_q <= NOTHING_ESTIMATED.residual_q;
      e.residual_mean_d <= NOTHING_ESTIMATED.residual_mean_d;
      e.residual_mean_q <= NOTHING_ESTIMATED.residual_mean_q;
      e.residual_sixth_d <= NOTHING_ESTIMATED.residual_sixth_d;
      e.residual_sixth_q <= NOTHING_ESTIMATED.residual_sixth_q;
      e.residual_power <= NOTHING_ESTIMATED.residual_power;
      e.residual_sum <= NOTHING_ESTIMATED.residual_sum;
      e.motor_differs <= NOTHING_ESTIMATED.motor_differs;
    end generate residual_of_motor;

  else generate
    flux_mode    <= to_unsigned(FLUX_MODELS_CURRENT_MODEL, 2);
    lambda_m_d   <= (others => '0');
    lambda_m_q   <= (others => '0');
    minus_rho    <= (others => '0');
    rip_alpha    <= (others => '0');
    rip_beta     <= (others => '0');
    values_valid <= compare_ready;
    e            <= NOTHING_ESTIMATED;
  end generate estimation;

  -- Protection and gates

  safety : entity work.protection
    generic map (POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, sample_valid => sample_valid, current_valid => current_valid,
              dc_valid => dc_valid, omega_valid => omega_valid, i_q_valid => i_q_valid,
              voltage_valid => dq_voltage_valid,
              i_a => o.i_a, i_b => o.i_b, i_c => o.i_c, current_at_rail => o.current_at_rail, u_dc => o.u_dc,
              u_dc_at_rail => o.u_dc_at_rail, code_theta => code_theta, theta_me => o.theta_me, omega_me => o.omega_me,
              omega_ref => omega_asked, speed_mode => regulates, i_q_ref => o.i_q_ref, speed_limited => o.speed_limited,
              regen_limited => o.regen_limited, u_d => o.u_d, u_q => o.u_q, u_comp_d => e.u_comp_d, u_comp_q => e.u_comp_q, i_d => o.i_d, i_q => o.i_q,
              model_d => model_d, model_q => model_q,
              run => run, trip => trip, enable => enable, clear_trip => clear_trip, host_write => host_write,
              period => period, settings => settings, sample_busy => guard_busy, early_samples => early_samples,
              sample_faults => o.sample_faults, sample_trip => o.sample_trip, motion_faults => o.motion_faults,
              open_load => o.open_load, encoder_lost => o.encoder_lost, current_offset => o.current_offset, brake_asked => o.brake_asked,
              fault_flags => fault_flags, first_fault => first_fault, gate_trip => gate_trip, gate_clear => gate_clear,
              brake => brake);

  charge : entity work.bootstrap_charge
    port map (clk => clk, rst => rst,
              gates_on => gates_on, period => period,
              charge_samples => settings.charge_samples,
              charging => charging, charged => charged);

  compare_a <= o.compare_a and not charging;
  compare_b <= o.compare_b and not charging;
  compare_c <= o.compare_c and not charging;
  running   <= gates_on and charged;

  gates : entity work.gate_generation
    generic map (CARRIER_HALF => CARRIER_HALF)
    port map (clk => clk, rst => rst,
              compare_a => compare_a, compare_b => compare_b, compare_c => compare_c, enable => enable,
              trip => gate_trip, clear_trip => gate_clear,
              dead_time => settings.dead_time, min_pulse => settings.min_pulse, double_update => settings.double_update,
              gate_high => gate_high, gate_low => gate_low, sample => period, running => gates_on,
              tripped => tripped, setting_refused => setting_refused, min_pulse_used => min_pulse_used,
              double_used => double_used, carrier => carrier);

  o.code_a     <= resize(code_a, o.code_a'length);
  o.code_b     <= resize(code_b, o.code_b'length);
  o.code_c     <= resize(code_c, o.code_c'length);
  o.code_u_dc  <= resize(code_u_dc, o.code_u_dc'length);
  o.code_theta <= resize(code_theta, o.code_theta'length);

  sample_trigger <= period;
  sample_busy    <= guard_busy;
  duty_valid     <= duty_ready;
  compare_valid  <= compare_ready;
  observed       <= o;
  estimated      <= e;

end architecture rtl;
