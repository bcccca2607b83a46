-- Purpose: the whole drive: raw samples in, gate signals out.  This top only instantiates.
--
--   raw sample -> conditioning -> transforms -> control -> modulation -> gates
--
-- Each block starts when its last input is valid and runs in parallel with the blocks that do not depend on it.  Which
-- input is the last is known, because latencies are constants (a test compares them with the measured ones).
-- Formats: per unit, see golden_model/formats.py; registers as `fluxproof registers drive.toml` prints them.
-- Latency: sample_valid to duty_valid FLUXPROOF_SAMPLE_TO_DUTY clocks; samples at least
-- FLUXPROOF_SAMPLE_INTERVAL apart.
-- Registers change only between samples, at the latest at the edge at which a sample enters (a setting then applies to
-- this sample, a reference to the next); dead_time and min_pulse at any time, they take effect at the valley;
-- watchdog and fault_ignore at any time.
-- Protection: a sample that comes too early is rejected; a faulty sample, a missing one and trip switch the gates off.
-- Rounding: see the blocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity fluxproof is
  generic (
    ADC_BITS      : positive range 12 to 16   := 16;
    POSITION_BITS : positive range 8 to 18    := 16;
    CARRIER_HALF  : positive range 8 to 32767 := 10000  -- half a PWM period in clocks
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;  -- synchronous, active high
    sample_valid    : in  std_logic;  -- 1: the raw sample below is valid
    adc_a           : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, phase a
    adc_b           : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, phase b
    adc_c           : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, phase c
    adc_u_dc        : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, bus voltage
    position_code   : in  unsigned(POSITION_BITS - 1 downto 0);  -- position code, one mechanical turn
    omega_ref_in    : in  signed(PU_W - 1 downto 0);  -- speed reference
    i_d_ref_in      : in  signed(PU_W - 1 downto 0);  -- current reference, d axis
    i_q_ext_in      : in  signed(PU_W - 1 downto 0);  -- current reference of torque mode, q axis
    speed_mode_in   : in  std_logic;  -- 1: speed control, 0: torque control
    temp_winding_in : in signed(15 downto 0);  -- winding temperature, degrees Celsius
    temp_valid_in   : in std_logic;  -- 1: temp_winding is valid
    clear_faults_in : in  std_logic;  -- 1: clear the flags of flux_faults whose cause is gone
    enable          : in  std_logic;  -- 1: gates may switch
    trip            : in  std_logic;  -- 1: gates off, latched
    clear_trip      : in  std_logic;  -- 1: clear the latched trip
    offset_a        : in  unsigned(CODE_W - 1 downto 0);  -- code at zero current, phase a, left-aligned
    offset_b        : in  unsigned(CODE_W - 1 downto 0);  -- code at zero current, phase b, left-aligned
    offset_c        : in  unsigned(CODE_W - 1 downto 0);  -- code at zero current, phase c, left-aligned
    gain_a          : in  signed(PU_W - 1 downto 0);  -- current per code, phase a
    gain_b          : in  signed(PU_W - 1 downto 0);  -- current per code, phase b
    gain_c          : in  signed(PU_W - 1 downto 0);  -- current per code, phase c
    reverse         : in  std_logic;  -- 1: code counts opposite to the phase order
    pole_pairs      : in  unsigned(5 downto 0);  -- pole pairs
    theta_offset    : in  unsigned(TURN_W - 1 downto 0);  -- electrical angle at code zero
    k_speed         : in  unsigned(23 downto 0);  -- speed per turn and sample
    k_filter        : in  unsigned(16 downto 0);  -- filter weight of the new sample, 1 = no filter
    u_dc_offset     : in  unsigned(CODE_W - 1 downto 0);  -- code at zero bus voltage, left-aligned
    u_dc_gain       : in  signed(PU_W - 1 downto 0);  -- bus voltage per code
    k_u_max         : in  unsigned(16 downto 0);  -- radius of the voltage circle / bus voltage
    speed_kp        : in  unsigned(KP_W - 1 downto 0);  -- proportional gain
    speed_ki        : in  unsigned(KI_W - 1 downto 0);  -- integral gain times sample time
    i_max           : in  signed(PU_W - 1 downto 0);  -- limit of the current reference
    kp_d            : in  unsigned(KP_W - 1 downto 0);  -- proportional gain, d axis
    ki_d            : in  unsigned(KI_W - 1 downto 0);  -- integral gain times sample time, d axis
    kp_q            : in  unsigned(KP_W - 1 downto 0);  -- proportional gain, q axis
    ki_q            : in  unsigned(KI_W - 1 downto 0);  -- integral gain times sample time, q axis
    l_d             : in  unsigned(INDUCTANCE_W - 1 downto 0);  -- inductance, d axis
    l_q             : in  unsigned(INDUCTANCE_W - 1 downto 0);  -- inductance, q axis
    lambda_mg       : in  signed(PU_W - 1 downto 0);  -- magnet flux linkage
    r_s             : in  unsigned(RESISTANCE_W - 1 downto 0);  -- winding resistance
    t_s             : in  unsigned(SAMPLE_TIME_W - 1 downto 0);  -- sample time, per unit
    omega_0         : in  unsigned(15 downto 0);  -- crossover of the two models, times the sample time
    xi              : in  unsigned(15 downto 0);  -- damping of the merge
    omega_min       : in  unsigned(DUTY_W - 1 downto 0);  -- no compensation up to this speed
    k_ramp          : in  unsigned(15 downto 0);  -- compensation fades in over 1/k_ramp above omega_min
    flux_kp         : in  unsigned(16 downto 0);  -- proportional gain of the compensation
    flux_ki         : in  unsigned(16 downto 0);  -- integral gain of the compensation times the sample time
    delta_max       : in  unsigned(15 downto 0);  -- limit of the compensation
    flux_mode       : in  unsigned(1 downto 0);  -- 0: eq. (6), 1: eq. (11), 2: eq. (16), 3: eq. (17)
    k_chord         : in  unsigned(16 downto 0);  -- (sample time)**2 / 24, per unit
    tcr             : in unsigned(23 downto 0);  -- change of r_s per kelvin
    t_0             : in signed(15 downto 0);  -- temperature of r_s
    t_min           : in signed(15 downto 0);  -- lowest valid temperature
    t_max           : in signed(15 downto 0);  -- highest valid temperature
    k_lp            : in unsigned(19 downto 0);  -- weight of a new sample in the low-pass of Fig. 3
    eta_v           : in unsigned(20 downto 0);  -- step of the V_dead Adaline, 18*eta
    gamma           : in unsigned(16 downto 0);  -- proportional part of the compensation
    zeta            : in unsigned(16 downto 0);  -- gain of the minimisation per sample
    v_thr           : in unsigned(SAMPLE_TIME_W - 1 downto 0);  -- no minimisation below this |v_dead|
    v_comp_max      : in unsigned(SAMPLE_TIME_W - 1 downto 0);  -- largest leg voltage that is compensated
    i_learn         : in unsigned(PU_W - 2 downto 0);  -- the V_dead Adaline is held below this |i_d| + |i_q|
    compensate      : in std_logic;  -- 1: compensate dead time and drops
    eta_psi         : in unsigned(16 downto 0);  -- step of the psi_m Adaline, 2*eta per unit
    omega_psi_min   : in unsigned(DUTY_W - 1 downto 0);  -- psi_m is held below this speed
    k_ahead         : in unsigned(DUTY_W - 1 downto 0);  -- angle of 2.5 sample times in radians, per unit of speed
    k_sign          : in unsigned(23 downto 0);  -- 1 / (current above which a direction is +-1)
    k_delay         : in  unsigned(16 downto 0);  -- angle of the delay in turns, per unit of speed
    min_pulse       : in  unsigned(11 downto 0);  -- shortest pulse of a leg, clocks
    dead_time       : in  unsigned(11 downto 0);  -- both gates of a leg off, clocks
    watchdog        : in  unsigned(19 downto 0);  -- longest time without a sample, clocks
    i_trip          : in  unsigned(LIMIT_W - 1 downto 0);  -- phase current that trips
    sum_trip        : in  unsigned(LIMIT_W - 1 downto 0);  -- sum of the phase currents that trips
    rail_samples    : in  unsigned(3 downto 0);  -- consecutive samples at the rail that trip
    u_dc_min        : in  unsigned(LIMIT_W - 1 downto 0);  -- bus voltage below which it trips
    u_dc_max        : in  unsigned(LIMIT_W - 1 downto 0);  -- bus voltage that trips
    jump_max        : in  unsigned(11 downto 0);  -- deviation from the extrapolated position that trips, turns
    fault_ignore    : in  unsigned(6 downto 0);  -- bit x: fault x is reported and does not trip
    gate_high       : out unsigned(2 downto 0);  -- upper gates, bit 0 is leg a
    gate_low        : out unsigned(2 downto 0);  -- lower gates, bit 0 is leg a
    sample_trigger  : out std_logic;  -- middle of the zero vector: take a sample
    running         : out std_logic;  -- gates are switching
    tripped         : out std_logic;  -- 1: a trip is latched
    sample_busy     : out std_logic;  -- a sample is in flight: registers must not change
    fault_flags     : out unsigned(8 downto 0);  -- faults since the last clear_trip, see fault_latch
    first_fault     : out unsigned(7 downto 0);  -- faults that tripped first
    early_samples   : out unsigned(7 downto 0);  -- samples rejected because they came too early
    setting_refused : out std_logic;  -- 1: dead_time and min_pulse contradict each other, refused
    min_pulse_used  : out unsigned(11 downto 0);  -- minimum pulse in force
    carrier         : out unsigned(15 downto 0);  -- carrier, for observation
    duty_valid      : out std_logic;  -- 1: the duties of the sample are valid
    compare_valid   : out std_logic;  -- 1: the compare values are valid
    values_valid    : out std_logic;  -- 1: all of the sample's values below are valid
    i_a             : out signed(PU_W - 1 downto 0);  -- current, phase a
    i_b             : out signed(PU_W - 1 downto 0);  -- current, phase b
    i_c             : out signed(PU_W - 1 downto 0);  -- current, phase c
    current_at_rail : out unsigned(2 downto 0);  -- bit x: ADC code of phase x at either end
    u_dc            : out unsigned(DUTY_W - 1 downto 0);  -- bus voltage
    u_max           : out unsigned(U_MAX_W - 1 downto 0);  -- radius of the voltage circle
    u_dc_at_rail    : out std_logic;  -- code at either end
    u_dc_low        : out std_logic;  -- bus below 1/32 per unit
    theta_me        : out unsigned(TURN_W - 1 downto 0);  -- electrical angle
    omega_me        : out signed(PU_W - 1 downto 0);  -- electrical speed
    i_d             : out signed(PU_W - 1 downto 0);  -- current, d axis
    i_q             : out signed(PU_W - 1 downto 0);  -- current, q axis
    i_q_ref         : out signed(PU_W - 1 downto 0);  -- current reference, q axis
    speed_limited   : out std_logic;  -- 1: output at its limit
    lambda_d        : out signed(PU_W - 1 downto 0);  -- flux linkage, d axis
    lambda_q        : out signed(PU_W - 1 downto 0);  -- flux linkage, q axis
    omega_chord     : out signed(PU_W - 1 downto 0);  -- electrical speed along the chord of a sample
    u_dec_d         : out signed(PU_W - 1 downto 0);  -- rotational voltage, d axis
    u_dec_q         : out signed(PU_W - 1 downto 0);  -- rotational voltage, q axis
    u_comp_d        : out signed(PU_W - 1 downto 0);  -- compensation voltage, d axis
    u_comp_q        : out signed(PU_W - 1 downto 0);  -- compensation voltage, q axis
    u_int_d         : out signed(INTEGRAL_W - 1 downto 0);  -- its integral part, d axis
    u_int_q         : out signed(INTEGRAL_W - 1 downto 0);  -- its integral part, q axis
    u_d             : out signed(PU_W - 1 downto 0);  -- voltage, d axis
    u_q             : out signed(PU_W - 1 downto 0);  -- voltage, q axis
    sat_d           : out signed(1 downto 0);  -- active limit, d axis: 1 upper, -1 lower, 0 none
    sat_q           : out signed(1 downto 0);  -- active limit, q axis: 1 upper, -1 lower, 0 none
    u_alpha         : out signed(PU_W - 1 downto 0);  -- voltage, alpha
    u_beta          : out signed(PU_W - 1 downto 0);  -- voltage, beta
    duty_a          : out unsigned(DUTY_W - 1 downto 0);  -- duty, leg a
    duty_b          : out unsigned(DUTY_W - 1 downto 0);  -- duty, leg b
    duty_c          : out unsigned(DUTY_W - 1 downto 0);  -- duty, leg c
    u_applied_alpha : out signed(FLUX_W - 1 downto 0);  -- voltage of the coming period, alpha
    u_applied_beta  : out signed(FLUX_W - 1 downto 0);  -- voltage of the coming period, beta
    lambda_c_d      : out signed(FLUX_W - 1 downto 0);  -- flux linkage of the current model, d axis
    lambda_c_q      : out signed(FLUX_W - 1 downto 0);  -- flux linkage of the current model, q axis
    lambda_m_alpha  : out signed(FLUX_W - 1 downto 0);  -- merged flux before the sample's resistive drop, alpha
    lambda_m_beta   : out signed(FLUX_W - 1 downto 0);  -- merged flux before the sample's resistive drop, beta
    merge_known     : out std_logic;  -- 1: the merged flux is valid at the next sample
    delta_lambda_d  : out signed(FLUX_W - 1 downto 0);  -- flux linkage missing in the estimate, d axis
    delta_lambda_q  : out signed(FLUX_W - 1 downto 0);  -- flux linkage missing in the estimate, q axis
    delta_held      : out std_logic;  -- 1: held, as the integrals contain other voltages
    lambda_pi_d     : out signed(FLUX_W - 1 downto 0);  -- compensation, d axis
    lambda_pi_q     : out signed(FLUX_W - 1 downto 0);  -- compensation, q axis
    torque          : out signed(PU_W - 1 downto 0);  -- estimated torque
    flux_faults     : out unsigned(6 downto 0);  -- conditions that disturbed the flux estimate, see flux_monitor
    d_d             : out signed(PU_W - 1 downto 0);  -- direction function D_d / 3
    d_q             : out signed(PU_W - 1 downto 0);  -- direction function D_q / 3
    v_dead          : out signed(V_LEG_W - 1 downto 0);  -- leg voltage loss that is not compensated
    v_comp          : out signed(V_LEG_W - 1 downto 0);  -- leg voltage that is compensated
    v_comp_limited  : out std_logic;  -- the compensation reached its limit
    psi_m           : out signed(PU_W - 1 downto 0);  -- flux linkage of the magnets
    psi_held        : out std_logic;  -- 1: psi_m is held
    temp_lost       : out std_logic;  -- 1: no valid temperature, r = r_s
    sample_faults   : out unsigned(5 downto 0);  -- faults of this sample, see sample_checks
    sample_trip     : out std_logic;  -- 1: at least one of them trips
    compare_a       : out unsigned(15 downto 0);  -- compare value, leg a
    compare_b       : out unsigned(15 downto 0);  -- compare value, leg b
    compare_c       : out unsigned(15 downto 0)  -- compare value, leg c
  );
end entity fluxproof;

architecture rtl of fluxproof is
  signal latch_valid          : std_logic;
  signal code_a               : unsigned(ADC_BITS - 1 downto 0);
  signal code_b               : unsigned(ADC_BITS - 1 downto 0);
  signal code_c               : unsigned(ADC_BITS - 1 downto 0);
  signal code_u_dc            : unsigned(ADC_BITS - 1 downto 0);
  signal code_theta           : unsigned(POSITION_BITS - 1 downto 0);
  signal omega_ref            : signed(PU_W - 1 downto 0);
  signal i_d_ref              : signed(PU_W - 1 downto 0);
  signal i_q_ext              : signed(PU_W - 1 downto 0);
  signal speed_mode           : std_logic;
  signal run                  : std_logic;
  signal current_soon         : std_logic;
  signal theta_valid          : std_logic;
  signal omega_valid          : std_logic;
  signal u_dc_valid           : std_logic;
  signal reciprocal_valid     : std_logic;
  signal inverse              : unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
  signal inverse_beta         : unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
  signal alpha_beta_soon      : std_logic;
  signal i_alpha              : signed(PU_W - 1 downto 0);
  signal i_beta               : signed(PU_W - 1 downto 0);
  signal trig_soon            : std_logic;
  signal trig_valid           : std_logic;
  signal cos_theta            : signed(PU_W - 1 downto 0);
  signal sin_theta            : signed(PU_W - 1 downto 0);
  signal dq_soon              : std_logic;
  signal pi_valid             : std_logic;
  signal u_pi_d               : signed(PU_W - 1 downto 0);
  signal u_pi_q               : signed(PU_W - 1 downto 0);
  signal lambda_valid         : std_logic;
  signal decoupling_valid     : std_logic;
  signal dq_voltage_soon      : std_logic;
  signal dq_voltage_valid     : std_logic;
  signal theta_out            : unsigned(TURN_W - 1 downto 0);
  signal cos_out              : signed(PU_W - 1 downto 0);
  signal sin_out              : signed(PU_W - 1 downto 0);
  signal ab_voltage_valid     : std_logic;
  signal duty_ready           : std_logic;
  signal compare_ready        : std_logic;
  signal r                    : unsigned(RESISTANCE_W - 1 downto 0);
  signal minus_rho            : signed(MINUS_RHO_W - 1 downto 0);
  signal lambda_m_d           : signed(FLUX_W - 1 downto 0);
  signal lambda_m_q           : signed(FLUX_W - 1 downto 0);
  signal estimate_limited     : std_logic;
  signal voltage_known        : std_logic;
  signal model_limited        : std_logic;
  signal lambda_c_alpha       : signed(FLUX_W - 1 downto 0);
  signal lambda_c_beta        : signed(FLUX_W - 1 downto 0);
  signal merge_limited        : std_logic;
  signal factor               : signed(17 downto 0);
  signal n_omega              : unsigned(3 downto 0);
  signal delta_limited        : std_logic;
  signal lambda_add_d         : signed(FLUX_W - 1 downto 0);
  signal lambda_add_q         : signed(FLUX_W - 1 downto 0);
  signal compensation_limited : std_logic;
  signal models_valid         : std_logic;
  signal model_d              : signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
  signal model_q              : signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
  signal merged_d             : signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
  signal merged_q             : signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
  signal merged               : std_logic;
  signal ended                : std_logic;
  signal raised_d             : signed(FLUX_MODELS_RAISED_W - 1 downto 0);
  signal raised_q             : signed(FLUX_MODELS_RAISED_W - 1 downto 0);
  signal model_valid          : std_logic;
  signal model_ab_valid       : std_logic;
  signal factor_valid         : std_logic;
  signal delta_valid          : std_logic;
  signal merge_valid          : std_logic;
  signal clear_faults         : std_logic;
  signal u_comp_alpha         : signed(PU_W - 1 downto 0);
  signal u_comp_beta          : signed(PU_W - 1 downto 0);
  signal u_clean_alpha        : signed(FLUX_W - 1 downto 0);
  signal u_clean_beta         : signed(FLUX_W - 1 downto 0);
  signal v_leg                : signed(V_LEG_W - 1 downto 0);
  signal temp_winding         : signed(15 downto 0);
  signal temp_valid           : std_logic;
  signal s_alpha              : signed(PU_W - 1 downto 0);
  signal s_beta               : signed(PU_W - 1 downto 0);
  signal comp_soon            : std_logic;
  signal comp_valid           : std_logic;
  signal period_valid         : std_logic;
  signal guard_busy           : std_logic;
  signal sample_entered       : std_logic;
  signal sample_early         : std_logic;
  signal sample_late          : std_logic;
  signal fault_stop           : std_logic;
  signal gate_trip            : std_logic;
  signal gate_clear           : std_logic;
begin

  guard : entity work.sample_guard
    generic map (
      INTERVAL => FLUXPROOF_SAMPLE_INTERVAL
    )
    port map (
      clk           => clk,
      rst           => rst,
      sample_valid  => sample_valid,
      clear_trip    => clear_trip,
      watchdog      => watchdog,
      sample_busy   => guard_busy,
      sample_early  => sample_early,
      sample_late   => sample_late,
      early_samples => early_samples
    );

  sample_entered <= sample_valid and not guard_busy;
  sample_busy    <= guard_busy;

  latch : entity work.sample_latch
    generic map (
      ADC_BITS      => ADC_BITS,
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => sample_entered,
      adc_a           => adc_a,
      adc_b           => adc_b,
      adc_c           => adc_c,
      adc_u_dc        => adc_u_dc,
      position_code   => position_code,
      omega_ref_in    => omega_ref_in,
      i_d_ref_in      => i_d_ref_in,
      i_q_ext_in      => i_q_ext_in,
      speed_mode_in   => speed_mode_in,
      temp_winding_in => temp_winding_in,
      temp_valid_in   => temp_valid_in,
      clear_faults_in => clear_faults_in,
      run_in          => running,
      out_valid       => latch_valid,
      code_a          => code_a,
      code_b          => code_b,
      code_c          => code_c,
      code_u_dc       => code_u_dc,
      code_theta      => code_theta,
      omega_ref       => omega_ref,
      i_d_ref         => i_d_ref,
      i_q_ext         => i_q_ext,
      speed_mode      => speed_mode,
      temp_winding    => temp_winding,
      temp_valid      => temp_valid,
      clear_faults    => clear_faults,
      run             => run
    );

  conditioning : entity work.current_conditioning
    generic map (
      ADC_BITS => ADC_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => latch_valid,
      code_a          => code_a,
      code_b          => code_b,
      code_c          => code_c,
      offset_a        => offset_a,
      offset_b        => offset_b,
      offset_c        => offset_c,
      gain_a          => gain_a,
      gain_b          => gain_b,
      gain_c          => gain_c,
      out_soon        => current_soon,
      out_valid       => open,
      i_a             => i_a,
      i_b             => i_b,
      i_c             => i_c,
      current_at_rail => current_at_rail
    );

  angle : entity work.position
    generic map (
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk          => clk,
      rst          => rst,
      in_valid     => latch_valid,
      code_theta   => code_theta,
      reverse      => reverse,
      pole_pairs   => pole_pairs,
      theta_offset => theta_offset,
      out_valid    => theta_valid,
      theta_me     => theta_me
    );

  speed_measurement : entity work.speed
    generic map (
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk        => clk,
      rst        => rst,
      in_valid   => latch_valid,
      code_theta => code_theta,
      reverse    => reverse,
      k_speed    => k_speed,
      k_filter   => k_filter,
      out_valid  => omega_valid,
      omega_me   => omega_me
    );

  bus_voltage : entity work.u_dc_conditioning
    generic map (
      ADC_BITS => ADC_BITS
    )
    port map (
      clk          => clk,
      rst          => rst,
      in_valid     => latch_valid,
      code_u_dc    => code_u_dc,
      u_dc_offset  => u_dc_offset,
      u_dc_gain    => u_dc_gain,
      k_u_max      => k_u_max,
      out_valid    => u_dc_valid,
      u_dc         => u_dc,
      u_max        => u_max,
      u_dc_at_rail => u_dc_at_rail
    );

  bus_reciprocal : entity work.u_dc_processing
    port map (
      clk          => clk,
      rst          => rst,
      in_valid     => u_dc_valid,
      u_dc         => u_dc,
      out_valid    => reciprocal_valid,
      inverse      => inverse,
      inverse_beta => inverse_beta,
      u_dc_low     => u_dc_low
    );

  stator_frame : entity work.clarke
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => current_soon,
      i_a       => i_a,
      i_b       => i_b,
      i_c       => i_c,
      out_soon  => alpha_beta_soon,
      out_valid => open,
      i_alpha   => i_alpha,
      i_beta    => i_beta
    );

  delay : entity work.svm_delay_compensation
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => omega_valid,
      theta_me  => theta_me,
      omega_me  => omega_me,
      k_delay   => k_delay,
      out_valid => open,
      theta_out => theta_out
    );

  trig : entity work.sincos
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => theta_valid,
      theta_me  => theta_me,
      theta_out => theta_out,
      out_soon  => trig_soon,
      out_valid => trig_valid,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      cos_out   => cos_out,
      sin_out   => sin_out
    );

  rotor_frame : entity work.park
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => alpha_beta_soon,
      i_alpha   => i_alpha,
      i_beta    => i_beta,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_soon  => dq_soon,
      out_valid => open,
      i_d       => i_d,
      i_q       => i_q
    );

  speed_regulator : entity work.speed_pi
    port map (
      clk           => clk,
      rst           => rst,
      in_valid      => omega_valid,
      omega_ref     => omega_ref,
      omega_me      => omega_me,
      i_q_ext       => i_q_ext,
      speed_mode    => speed_mode,
      run           => run,
      speed_kp      => speed_kp,
      speed_ki      => speed_ki,
      i_max         => i_max,
      out_valid     => open,
      i_q_ref       => i_q_ref,
      speed_limited => speed_limited
    );

  current_regulators : entity work.current_pi
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => dq_soon,
      i_d       => i_d,
      i_q       => i_q,
      i_d_ref   => i_d_ref,
      i_q_ref   => i_q_ref,
      sat_d     => sat_d,
      sat_q     => sat_q,
      run       => run,
      kp_d      => kp_d,
      ki_d      => ki_d,
      kp_q      => kp_q,
      ki_q      => ki_q,
      out_soon  => open,
      out_valid => pi_valid,
      u_pi_d    => u_pi_d,
      u_pi_q    => u_pi_q,
      u_int_d   => u_int_d,
      u_int_q   => u_int_q
    );

  resistance : entity work.winding_resistance
    port map (
      clk          => clk,
      rst          => rst,
      in_valid     => latch_valid,
      temp_winding => temp_winding,
      temp_valid   => temp_valid,
      r_s          => r_s,
      tcr          => tcr,
      t_0          => t_0,
      t_min        => t_min,
      t_max        => t_max,
      t_s          => t_s,
      out_valid    => open,
      r            => r,
      minus_rho    => minus_rho,
      temp_lost    => temp_lost
    );

  merged_flux : entity work.flux_park
    port map (
      clk            => clk,
      rst            => rst,
      in_valid       => trig_soon,
      lambda_m_alpha => lambda_m_alpha,
      lambda_m_beta  => lambda_m_beta,
      cos_theta      => cos_theta,
      sin_theta      => sin_theta,
      out_valid      => open,
      lambda_m_d     => lambda_m_d,
      lambda_m_q     => lambda_m_q
    );

  models : entity work.flux_models
    port map (
      clk         => clk,
      rst         => rst,
      in_valid    => dq_soon,
      i_d         => i_d,
      i_q         => i_q,
      lambda_m_d  => lambda_m_d,
      lambda_m_q  => lambda_m_q,
      lambda_pi_d => lambda_pi_d,
      lambda_pi_q => lambda_pi_q,
      merge_known => merge_known,
      run         => run,
      minus_rho   => minus_rho,
      flux_mode   => flux_mode,
      l_d         => l_d,
      l_q         => l_q,
      lambda_mg   => lambda_mg,
      out_valid   => models_valid,
      model_d     => model_d,
      model_q     => model_q,
      merged_d    => merged_d,
      merged_q    => merged_q,
      merged      => merged,
      ended       => ended,
      raised_d    => raised_d,
      raised_q    => raised_q
    );

  flux : entity work.flux_estimate
    port map (
      clk              => clk,
      rst              => rst,
      in_valid         => models_valid,
      model_d          => model_d,
      model_q          => model_q,
      merged_d         => merged_d,
      merged_q         => merged_q,
      merged           => merged,
      ended            => ended,
      out_valid        => lambda_valid,
      lambda_d         => lambda_d,
      lambda_q         => lambda_q,
      estimate_limited => estimate_limited
    );

  chord : entity work.chord_speed
    port map (
      clk         => clk,
      rst         => rst,
      in_valid    => omega_valid,
      omega_me    => omega_me,
      k_chord     => k_chord,
      out_valid   => open,
      omega_chord => omega_chord
    );

  cross_coupling : entity work.decoupling
    port map (
      clk         => clk,
      rst         => rst,
      in_valid    => lambda_valid,
      omega_chord => omega_chord,
      lambda_d    => lambda_d,
      lambda_q    => lambda_q,
      out_valid   => decoupling_valid,
      u_dec_d     => u_dec_d,
      u_dec_q     => u_dec_q
    );

  leg_compensation : entity work.dead_time_compensation
    port map (
      clk          => clk,
      rst          => rst,
      in_valid     => latch_valid,
      v_comp       => v_comp,
      s_alpha      => s_alpha,
      s_beta       => s_beta,
      out_valid    => open,
      u_comp_alpha => u_comp_alpha,
      u_comp_beta  => u_comp_beta
    );

  compensation_dq : entity work.park
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => trig_valid,
      i_alpha   => u_comp_alpha,
      i_beta    => u_comp_beta,
      cos_theta => cos_out,
      sin_theta => sin_out,
      out_soon  => comp_soon,
      out_valid => comp_valid,
      i_d       => u_comp_d,
      i_q       => u_comp_q
    );

  direction_functions : entity work.park
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => trig_valid,
      i_alpha   => s_alpha,
      i_beta    => s_beta,
      cos_theta => cos_out,
      sin_theta => sin_out,
      out_soon  => open,
      out_valid => open,
      i_d       => d_d,
      i_q       => d_q
    );

  circle : entity work.voltage_limit
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => comp_soon,
      u_pi_d    => u_pi_d,
      u_pi_q    => u_pi_q,
      u_dec_d   => u_dec_d,
      u_dec_q   => u_dec_q,
      u_comp_d  => u_comp_d,
      u_comp_q  => u_comp_q,
      u_max     => u_max,
      out_soon  => dq_voltage_soon,
      out_valid => dq_voltage_valid,
      u_d       => u_d,
      u_q       => u_q,
      sat_d     => sat_d,
      sat_q     => sat_q
    );

  stator_voltage : entity work.inverse_park
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => dq_voltage_soon,
      u_d       => u_d,
      u_q       => u_q,
      cos_theta => cos_out,
      sin_theta => sin_out,
      out_valid => ab_voltage_valid,
      u_alpha   => u_alpha,
      u_beta    => u_beta
    );

  modulator : entity work.svm
    port map (
      clk          => clk,
      rst          => rst,
      in_valid     => ab_voltage_valid,
      u_alpha      => u_alpha,
      u_beta       => u_beta,
      inverse      => inverse,
      inverse_beta => inverse_beta,
      out_valid    => duty_ready,
      duty_a       => duty_a,
      duty_b       => duty_b,
      duty_c       => duty_c
    );

  compare : entity work.pwm_compare
    generic map (
      CARRIER_HALF => CARRIER_HALF
    )
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => duty_ready,
      duty_a    => duty_a,
      duty_b    => duty_b,
      duty_c    => duty_c,
      min_pulse => min_pulse_used,
      out_valid => compare_ready,
      compare_a => compare_a,
      compare_b => compare_b,
      compare_c => compare_c
    );

  period_voltage : entity work.applied_voltage
    generic map (
      CARRIER_HALF => CARRIER_HALF
    )
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => u_dc_valid,
      compare_a       => compare_a,
      compare_b       => compare_b,
      compare_c       => compare_c,
      u_dc            => u_dc,
      u_dc_at_rail    => u_dc_at_rail,
      run             => run,
      out_valid       => period_valid,
      u_applied_alpha => u_applied_alpha,
      u_applied_beta  => u_applied_beta,
      voltage_known   => voltage_known
    );

  motor_voltage : entity work.clean_voltage
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => period_valid,
      u_applied_alpha => u_applied_alpha,
      u_applied_beta  => u_applied_beta,
      s_alpha         => s_alpha,
      s_beta          => s_beta,
      v_leg           => v_leg,
      out_valid       => open,
      u_clean_alpha   => u_clean_alpha,
      u_clean_beta    => u_clean_beta
    );

  magnetic_model : entity work.current_model
    port map (
      clk           => clk,
      rst           => rst,
      in_valid      => models_valid,
      model_d       => model_d,
      model_q       => model_q,
      raised_d      => raised_d,
      raised_q      => raised_q,
      lambda_add_d  => lambda_add_d,
      lambda_add_q  => lambda_add_q,
      out_valid     => model_valid,
      lambda_c_d    => lambda_c_d,
      lambda_c_q    => lambda_c_q,
      model_limited => model_limited
    );

  model_flux : entity work.flux_inverse_park
    port map (
      clk            => clk,
      rst            => rst,
      in_valid       => model_valid,
      lambda_c_d     => lambda_c_d,
      lambda_c_q     => lambda_c_q,
      cos_theta      => cos_theta,
      sin_theta      => sin_theta,
      out_valid      => model_ab_valid,
      lambda_c_alpha => lambda_c_alpha,
      lambda_c_beta  => lambda_c_beta
    );

  merge : entity work.flux_merge
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => model_ab_valid,
      i_alpha         => i_alpha,
      i_beta          => i_beta,
      lambda_c_alpha  => lambda_c_alpha,
      lambda_c_beta   => lambda_c_beta,
      u_applied_alpha => u_clean_alpha,
      u_applied_beta  => u_clean_beta,
      voltage_known   => voltage_known,
      run             => run,
      minus_rho       => minus_rho,
      omega_0         => omega_0,
      xi              => xi,
      t_s             => t_s,
      out_valid       => merge_valid,
      lambda_m_alpha  => lambda_m_alpha,
      lambda_m_beta   => lambda_m_beta,
      merge_known     => merge_known,
      merge_limited   => merge_limited
    );

  speed_inverse : entity work.speed_reciprocal
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => omega_valid,
      omega_me  => omega_me,
      omega_min => omega_min,
      k_ramp    => k_ramp,
      out_valid => factor_valid,
      factor    => factor,
      n_omega   => n_omega
    );

  flux_error : entity work.delta_lambda
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => factor_valid,
      u_int_d         => u_int_d,
      u_int_q         => u_int_q,
      i_d             => i_d,
      i_q             => i_q,
      sat_d           => sat_d,
      sat_q           => sat_q,
      current_at_rail => current_at_rail,
      voltage_known   => voltage_known,
      run             => run,
      factor          => factor,
      n_omega         => n_omega,
      r               => r,
      out_valid       => delta_valid,
      delta_lambda_d  => delta_lambda_d,
      delta_lambda_q  => delta_lambda_q,
      delta_held      => delta_held,
      delta_limited   => delta_limited
    );

  compensation : entity work.flux_compensation
    port map (
      clk                  => clk,
      rst                  => rst,
      in_valid             => delta_valid,
      delta_lambda_d       => delta_lambda_d,
      delta_lambda_q       => delta_lambda_q,
      delta_held           => delta_held,
      flux_mode            => flux_mode,
      flux_kp              => flux_kp,
      flux_ki              => flux_ki,
      delta_max            => delta_max,
      out_valid            => open,
      lambda_pi_d          => lambda_pi_d,
      lambda_pi_q          => lambda_pi_q,
      lambda_add_d         => lambda_add_d,
      lambda_add_q         => lambda_add_q,
      compensation_limited => compensation_limited
    );

  torque_estimate : entity work.torque
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => lambda_valid,
      lambda_d  => lambda_d,
      lambda_q  => lambda_q,
      i_d       => i_d,
      i_q       => i_q,
      out_valid => open,
      torque    => torque
    );

  inverter_loss : entity work.v_dead_adaline
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => dq_voltage_valid,
      u_pi_d          => u_pi_d,
      d_d             => d_d,
      i_d             => i_d,
      i_q             => i_q,
      sat_d           => sat_d,
      sat_q           => sat_q,
      current_at_rail => current_at_rail,
      voltage_known   => voltage_known,
      run             => run,
      k_lp            => k_lp,
      eta_v           => eta_v,
      gamma           => gamma,
      zeta            => zeta,
      v_thr           => v_thr,
      v_comp_max      => v_comp_max,
      i_learn         => i_learn,
      compensate      => compensate,
      out_valid       => open,
      v_dead          => v_dead,
      v_comp          => v_comp,
      v_leg           => v_leg,
      v_comp_limited  => v_comp_limited
    );

  magnet_flux : entity work.psi_adaline
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => dq_voltage_valid,
      u_q             => u_q,
      d_q             => d_q,
      v_leg           => v_leg,
      i_d             => i_d,
      i_q             => i_q,
      r               => r,
      omega_chord     => omega_chord,
      sat_d           => sat_d,
      sat_q           => sat_q,
      current_at_rail => current_at_rail,
      voltage_known   => voltage_known,
      run             => run,
      l_d             => l_d,
      eta_psi         => eta_psi,
      omega_psi_min   => omega_psi_min,
      out_valid       => open,
      psi_m           => psi_m,
      psi_held        => psi_held
    );

  directions : entity work.current_directions
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => comp_valid,
      i_alpha   => i_alpha,
      i_beta    => i_beta,
      omega_me  => omega_me,
      k_ahead   => k_ahead,
      k_sign    => k_sign,
      out_valid => open,
      s_alpha   => s_alpha,
      s_beta    => s_beta
    );

  monitor : entity work.flux_monitor
    port map (
      clk                  => clk,
      rst                  => rst,
      in_valid             => merge_valid,
      current_at_rail      => current_at_rail,
      u_dc_at_rail         => u_dc_at_rail,
      u_dc_low             => u_dc_low,
      model_limited        => model_limited,
      merge_limited        => merge_limited,
      delta_limited        => delta_limited,
      compensation_limited => compensation_limited,
      estimate_limited     => estimate_limited,
      clear_faults         => clear_faults,
      out_valid            => values_valid,
      flux_faults          => flux_faults
    );

  checks : entity work.sample_checks
    generic map (
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => u_dc_valid,
      i_a             => i_a,
      i_b             => i_b,
      i_c             => i_c,
      current_at_rail => current_at_rail,
      u_dc            => u_dc,
      u_dc_at_rail    => u_dc_at_rail,
      code_theta      => code_theta,
      i_trip          => i_trip,
      sum_trip        => sum_trip,
      rail_samples    => rail_samples,
      u_dc_min        => u_dc_min,
      u_dc_max        => u_dc_max,
      jump_max        => jump_max,
      fault_ignore    => fault_ignore,
      out_valid       => open,
      sample_faults   => sample_faults,
      sample_trip     => sample_trip
    );

  fault_memory : entity work.fault_latch
    port map (
      clk           => clk,
      rst           => rst,
      trip          => trip,
      sample_faults => sample_faults,
      sample_late   => sample_late,
      sample_early  => sample_early,
      enable        => enable,
      clear_trip    => clear_trip,
      fault_ignore  => fault_ignore,
      fault_flags   => fault_flags,
      first_fault   => first_fault,
      fault_stop    => fault_stop,
      gate_clear    => gate_clear
    );

  -- A faulty sample trips without waiting for the fault latch; without enable the gates are off and nothing is latched.
  gate_trip <= trip or fault_stop or (sample_trip and enable);

  gates : entity work.gate_generation
    generic map (
      CARRIER_HALF => CARRIER_HALF
    )
    port map (
      clk             => clk,
      rst             => rst,
      compare_a       => compare_a,
      compare_b       => compare_b,
      compare_c       => compare_c,
      enable          => enable,
      trip            => gate_trip,
      clear_trip      => gate_clear,
      dead_time       => dead_time,
      min_pulse       => min_pulse,
      gate_high       => gate_high,
      gate_low        => gate_low,
      sample          => sample_trigger,
      running         => running,
      tripped         => tripped,
      setting_refused => setting_refused,
      min_pulse_used  => min_pulse_used,
      carrier         => carrier
    );

  duty_valid    <= duty_ready;
  compare_valid <= compare_ready;

end architecture rtl;
