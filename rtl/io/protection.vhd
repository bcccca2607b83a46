-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: everything that turns the gates off: guard of the samples, checks, watch of the host, memory of the faults,
-- and the brake chopper beside them.  This entity only instantiates.
--
--   strobe -> guard -> checks of the sample, of the motion, of the load, of the sensors' zero, of the EMF -> fault latch
--   -> gate_trip
--
-- A faulty sample trips without waiting for the fault latch; without enable the gates are off and nothing is latched.
-- brake is off while samples are missing: without a reading of the bus nothing may heat the resistor.
-- Formats and rounding: see the blocks.  Latency: two clocks from a fault to the gates, one from trip.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity protection is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    sample_valid    : in  std_logic;  -- strobes: of the raw sample, and of the values below
    current_valid   : in  std_logic;
    dc_valid        : in  std_logic;
    omega_valid     : in  std_logic;
    i_q_valid       : in  std_logic;
    voltage_valid   : in  std_logic;
    i_a             : in  signed(PU_W - 1 downto 0);
    i_b             : in  signed(PU_W - 1 downto 0);
    i_c             : in  signed(PU_W - 1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);
    u_dc            : in  unsigned(DUTY_W - 1 downto 0);
    u_dc_at_rail    : in  std_logic;
    code_theta      : in  unsigned(POSITION_BITS - 1 downto 0);
    theta_me        : in  unsigned(TURN_W - 1 downto 0);
    omega_me        : in  signed(PU_W - 1 downto 0);
    omega_ref       : in  signed(PU_W - 1 downto 0);
    speed_mode      : in  std_logic;
    i_q_ref         : in  signed(PU_W - 1 downto 0);
    speed_limited   : in  std_logic;
    regen_limited   : in  std_logic;
    u_d             : in  signed(PU_W - 1 downto 0);
    u_q             : in  signed(PU_W - 1 downto 0);
    u_comp_d        : in  signed(PU_W - 1 downto 0);
    u_comp_q        : in  signed(PU_W - 1 downto 0);
    i_d             : in  signed(PU_W - 1 downto 0);
    i_q             : in  signed(PU_W - 1 downto 0);
    model_d         : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    model_q         : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    run             : in  std_logic;
    trip            : in  std_logic;
    enable          : in  std_logic;
    clear_trip      : in  std_logic;
    host_write      : in  std_logic;
    period          : in  std_logic;
    settings        : in  settings_t;
    sample_busy     : out std_logic;
    early_samples   : out unsigned(7 downto 0);
    sample_faults   : out unsigned(5 downto 0);
    sample_trip     : out std_logic;
    motion_faults   : out unsigned(2 downto 0);
    open_load       : out std_logic;
    encoder_lost    : out std_logic;
    current_offset  : out std_logic;
    brake_asked     : out std_logic;
    fault_flags     : out unsigned(15 downto 0);
    first_fault     : out unsigned(15 downto 0);
    gate_trip       : out std_logic;
    gate_clear      : out std_logic;
    brake           : out std_logic
  );
end entity protection;

architecture rtl of protection is
  signal sample_early, sample_late, host_lost : std_logic;
  signal motion_valid, fault_stop             : std_logic;
begin

  guard : entity work.sample_guard
    generic map (INTERVAL => FLUXPROOF_SAMPLE_INTERVAL)
    port map (clk => clk, rst => rst,
              sample_valid => sample_valid, clear_trip => clear_trip,
              watchdog => settings.watchdog,
              sample_busy => sample_busy, sample_early => sample_early, sample_late => sample_late,
              early_samples => early_samples);

  checks : entity work.sample_checks
    generic map (POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, in_valid => current_valid,
              i_a => i_a, i_b => i_b, i_c => i_c, current_at_rail => current_at_rail, u_dc => u_dc,
              u_dc_at_rail => u_dc_at_rail, code_theta => code_theta,
              i_trip => settings.i_trip, sum_trip => settings.sum_trip, rail_samples => settings.rail_samples,
              u_dc_min => settings.u_dc_min, u_dc_max => settings.u_dc_max, jump_max => settings.jump_max,
              fault_ignore => settings.fault_ignore, position_restart => settings.position_restart,
              out_valid => open, sample_faults => sample_faults, sample_trip => sample_trip);

  zero_check : entity work.offset_check
    port map (clk => clk, rst => rst, in_valid => omega_valid,
              i_a => i_a, i_b => i_b, i_c => i_c, omega_me => omega_me, run => run,
              omega_stall => settings.omega_stall, offset_max => settings.offset_max,
              out_valid => open, current_offset => current_offset);

  motion : entity work.motion_checks
    port map (clk => clk, rst => rst, in_valid => i_q_valid,
              omega_me => omega_me, omega_ref => omega_ref, speed_mode => speed_mode, speed_limited => speed_limited,
              regen_limited => regen_limited, run => run,
              omega_trip => settings.omega_trip, omega_away => settings.omega_away,
              runaway_samples => settings.runaway_samples, way_stall => settings.way_stall,
              stall_samples => settings.stall_samples,
              out_valid => motion_valid, motion_faults => motion_faults);

  load : entity work.load_check
    port map (clk => clk, rst => rst, in_valid => motion_valid,
              i_a => i_a, i_b => i_b, i_c => i_c, i_q_ref => i_q_ref, theta_me => theta_me, run => run,
              motion_faults => motion_faults,
              i_open => settings.i_open,
              out_valid => open, open_load => open_load);

  emf : entity work.emf_check
    port map (clk => clk, rst => rst, in_valid => voltage_valid,
              u_d => u_d, u_q => u_q, u_comp_d => u_comp_d, u_comp_q => u_comp_q, i_d => i_d, i_q => i_q,
              model_d => model_d, model_q => model_q, omega_me => omega_me, run => run,
              r_s => settings.r_s, emf_min => settings.emf_min, emf_l => settings.emf_l, emf_i => settings.emf_i, emf_w => settings.emf_w,
              emf_samples => settings.emf_samples,
              out_valid => open, encoder_lost => encoder_lost);

  chopper : entity work.brake_chopper
    port map (clk => clk, rst => rst, in_valid => dc_valid,
              u_dc => u_dc,
              brake_on => settings.brake_on, brake_off => settings.brake_off,
              out_valid => open, brake_asked => brake_asked);

  host : entity work.host_watch
    port map (clk => clk, rst => rst,
              host_write => host_write, period => period,
              heartbeat => settings.heartbeat,
              host_lost => host_lost);

  fault_memory : entity work.fault_latch
    port map (clk => clk, rst => rst,
              trip => trip, sample_faults => sample_faults, sample_late => sample_late, sample_early => sample_early,
              motion_faults => motion_faults, open_load => open_load, current_offset => current_offset,
              host_lost => host_lost, encoder_lost => encoder_lost, enable => enable, clear_trip => clear_trip,
              fault_ignore => settings.fault_ignore,
              fault_flags => fault_flags, first_fault => first_fault, fault_stop => fault_stop,
              gate_clear => gate_clear);

  gate_trip <= trip or fault_stop or (sample_trip and enable);

  process (clk)
  begin
    if rising_edge(clk) then
      brake <= brake_asked and not sample_late;

      if rst = '1' then
        brake <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
