-- Purpose: an AXI4-Stream packet for every sample: inputs of the core, its results, and the sample number.
-- The words of a packet (telemetry_words) are read from the core's live values, delayed by one clock: one word per
-- clock, from TELEMETRY_WORDS_START clocks after the sample on, when the values are valid and before the next sample
-- replaces them.  They enter a queue (packet_fifo) that the sink empties at its rate.
-- The controller never waits: if the packet of a sample does not fit into the queue, it is dropped; dropped counts it,
-- up to 65535.  The sample numbers count from 0 after a reset, modulo 2**32.  enable is checked before the first word:
-- a packet that has begun is completed.  A sample less than FLUXPROOF_SAMPLE_INTERVAL clocks after the last one is
-- ignored and not counted.
-- Formats: unchanged, see telemetry_words.  The queue holds 2**DEPTH_BITS words.
-- Latency: the first word is valid TELEMETRY_WORDS_START + 5 clocks after sample_valid.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity telemetry is
  generic (
    ADC_BITS      : positive range 12 to 16 := 16;
    POSITION_BITS : positive range 8 to 18  := 16;
    DEPTH_BITS    : positive range 5 to 16  := 9
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;  -- synchronous, active high
    enable          : in  std_logic;  -- 1: send packets
    sample_valid    : in  std_logic;  -- 1: the raw sample below is valid
    m_axis_tready   : in  std_logic;  -- 1: the sink accepts the word
    adc_a           : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, phase a
    adc_b           : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, phase b
    adc_c           : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, phase c
    adc_u_dc        : in  unsigned(ADC_BITS - 1 downto 0);  -- ADC code, bus voltage
    position_code   : in  unsigned(POSITION_BITS - 1 downto 0);  -- position code, one mechanical turn
    omega_ref_in    : in  signed(PU_W - 1 downto 0);  -- speed reference
    i_d_ref_in      : in  signed(PU_W - 1 downto 0);  -- current reference, d axis
    i_q_ext_in      : in  signed(PU_W - 1 downto 0);  -- current reference of torque mode, q axis
    speed_mode_in   : in  std_logic;  -- 1: speed control, 0: torque control
    temp_winding_in : in  signed(15 downto 0);  -- winding temperature, degrees Celsius
    temp_valid_in   : in  std_logic;  -- 1: temp_winding is valid
    clear_faults_in : in  std_logic;  -- 1: clear the flags whose cause is gone
    running         : in  std_logic;  -- 1: the gates are switching
    current_at_rail : in  unsigned(2 downto 0);  -- bit x: ADC code of phase x at either end
    u_dc            : in  unsigned(DUTY_W - 1 downto 0);  -- bus voltage
    theta_me        : in  unsigned(TURN_W - 1 downto 0);  -- electrical angle
    omega_me        : in  signed(PU_W - 1 downto 0);  -- electrical speed
    i_d             : in  signed(PU_W - 1 downto 0);  -- current, d axis
    i_q             : in  signed(PU_W - 1 downto 0);  -- current, q axis
    i_q_ref         : in  signed(PU_W - 1 downto 0);  -- current reference, q axis
    lambda_d        : in  signed(PU_W - 1 downto 0);  -- flux linkage, d axis
    lambda_q        : in  signed(PU_W - 1 downto 0);  -- flux linkage, q axis
    u_d             : in  signed(PU_W - 1 downto 0);  -- voltage, d axis
    u_q             : in  signed(PU_W - 1 downto 0);  -- voltage, q axis
    sat_d           : in  signed(1 downto 0);  -- active limit, d axis: 1 upper, -1 lower, 0 none
    sat_q           : in  signed(1 downto 0);  -- active limit, q axis: 1 upper, -1 lower, 0 none
    flux_faults     : in  unsigned(6 downto 0);  -- conditions that have disturbed the flux estimate, see flux_monitor
    v_dead          : in  signed(V_LEG_W - 1 downto 0);  -- leg voltage loss that is not compensated
    v_comp          : in  signed(V_LEG_W - 1 downto 0);  -- leg voltage that is compensated
    psi_m           : in  signed(PU_W - 1 downto 0);  -- flux linkage of the magnets
    psi_held        : in  std_logic;  -- 1: psi_m is held
    temp_lost       : in  std_logic;  -- 1: no valid temperature, r = r_s
    compare_a       : in  unsigned(15 downto 0);  -- compare value, leg a
    compare_b       : in  unsigned(15 downto 0);  -- compare value, leg b
    compare_c       : in  unsigned(15 downto 0);  -- compare value, leg c
    m_axis_tdata    : out unsigned(31 downto 0);  -- a word of the packet
    m_axis_tvalid   : out std_logic;  -- 1: the word is valid
    m_axis_tlast    : out std_logic;  -- 1: last word of the packet
    dropped         : out unsigned(15 downto 0)  -- samples without a packet because the queue was full
  );
end entity telemetry;

architecture rtl of telemetry is
  constant COUNT   : positive := TELEMETRY_WORDS_COUNT;
  constant INDEX_W : positive := TELEMETRY_WORDS_INDEX_W;
  constant AGE_W   : positive := TELEMETRY_AGE_W;

  constant AGE_END : unsigned(AGE_W - 1 downto 0) := to_unsigned(FLUXPROOF_SAMPLE_INTERVAL, AGE_W);
  constant NONE    : unsigned(31 downto 0)        := (others => '1');  -- so that the first sample is number 0

  -- The raw sample and the references, latched as in the core
  signal code_a       : unsigned(ADC_BITS - 1 downto 0);
  signal code_b       : unsigned(ADC_BITS - 1 downto 0);
  signal code_c       : unsigned(ADC_BITS - 1 downto 0);
  signal code_u_dc    : unsigned(ADC_BITS - 1 downto 0);
  signal code_theta   : unsigned(POSITION_BITS - 1 downto 0);
  signal omega_ref    : signed(PU_W - 1 downto 0);
  signal i_d_ref      : signed(PU_W - 1 downto 0);
  signal i_q_ext      : signed(PU_W - 1 downto 0);
  signal speed_mode   : std_logic;
  signal temp_winding : signed(15 downto 0);
  signal temp_valid   : std_logic;
  signal clear_faults : std_logic;
  signal run          : std_logic;

  -- The core's outputs, delayed by one clock
  signal current_at_rail_1 : unsigned(2 downto 0);
  signal u_dc_1            : unsigned(DUTY_W - 1 downto 0);
  signal theta_me_1        : unsigned(TURN_W - 1 downto 0);
  signal omega_me_1        : signed(PU_W - 1 downto 0);
  signal i_d_1             : signed(PU_W - 1 downto 0);
  signal i_q_1             : signed(PU_W - 1 downto 0);
  signal i_q_ref_1         : signed(PU_W - 1 downto 0);
  signal lambda_d_1        : signed(PU_W - 1 downto 0);
  signal lambda_q_1        : signed(PU_W - 1 downto 0);
  signal u_d_1             : signed(PU_W - 1 downto 0);
  signal u_q_1             : signed(PU_W - 1 downto 0);
  signal sat_d_1           : signed(1 downto 0);
  signal sat_q_1           : signed(1 downto 0);
  signal flux_faults_1     : unsigned(6 downto 0);
  signal v_dead_1          : signed(V_LEG_W - 1 downto 0);
  signal v_comp_1          : signed(V_LEG_W - 1 downto 0);
  signal psi_m_1           : signed(PU_W - 1 downto 0);
  signal psi_held_1        : std_logic;
  signal temp_lost_1       : std_logic;
  signal compare_a_1       : unsigned(15 downto 0);
  signal compare_b_1       : unsigned(15 downto 0);
  signal compare_c_1       : unsigned(15 downto 0);

  -- State
  signal age     : unsigned(AGE_W - 1 downto 0);  -- clocks since the sample, up to FLUXPROOF_SAMPLE_INTERVAL
  signal free    : std_logic;  -- 1: age = FLUXPROOF_SAMPLE_INTERVAL
  signal ready   : std_logic;  -- age = TELEMETRY_WORDS_START - 1
  signal full    : std_logic;  -- drops = 65535, a clock late: drops counts at most once per sample
  signal counter : unsigned(31 downto 0);  -- number of the sample
  signal active  : std_logic;
  signal index   : unsigned(INDEX_W - 1 downto 0);
  signal drops   : unsigned(15 downto 0);

  signal taken   : std_logic;
  signal start   : std_logic;
  signal final   : std_logic;
  signal room    : std_logic;
  signal valid_1 : std_logic;
  signal last_1  : std_logic;
  signal valid_2 : std_logic;
  signal word_2  : unsigned(31 downto 0);
  signal last_2  : std_logic;
begin
  taken <= sample_valid and free;
  start <= enable and ready;
  final <= '1' when index = COUNT - 1 else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      -- A register for the core's outputs, which come from distant parts of the chip
      current_at_rail_1 <= current_at_rail;
      u_dc_1            <= u_dc;
      theta_me_1        <= theta_me;
      omega_me_1        <= omega_me;
      i_d_1             <= i_d;
      i_q_1             <= i_q;
      i_q_ref_1         <= i_q_ref;
      lambda_d_1        <= lambda_d;
      lambda_q_1        <= lambda_q;
      u_d_1             <= u_d;
      u_q_1             <= u_q;
      sat_d_1           <= sat_d;
      sat_q_1           <= sat_q;
      flux_faults_1     <= flux_faults;
      v_dead_1          <= v_dead;
      v_comp_1          <= v_comp;
      psi_m_1           <= psi_m;
      psi_held_1        <= psi_held;
      temp_lost_1       <= temp_lost;
      compare_a_1       <= compare_a;
      compare_b_1       <= compare_b;
      compare_c_1       <= compare_c;

      -- Age and number of the sample
      if taken = '1' then
        age     <= to_unsigned(1, AGE_W);
        free    <= '0';
        counter <= counter + 1;
      elsif free = '0' then
        age  <= age + 1;
        free <= '1' when age = AGE_END - 1 else '0';
      end if;
      ready <= '1' when age = TELEMETRY_WORDS_START - 2 else '0';

      -- The packet begins only if all of it fits into the queue
      if active = '1' then
        index  <= index + 1;
        active <= not final;
      end if;
      if start = '1' and room = '1' then
        active <= '1';
        index  <= (others => '0');
      end if;
      if start = '1' and room = '0' and full = '0' then
        drops <= drops + 1;
      end if;
      full <= '1' when drops = 65535 else '0';

      -- Stages 1 and 2: the flag of the last word, delayed like the word
      valid_1 <= active;
      if active = '1' then
        last_1 <= final;
      end if;
      if valid_1 = '1' then
        last_2 <= last_1;
      end if;

      if rst = '1' then
        age     <= AGE_END;
        free    <= '1';
        ready   <= '0';
        full    <= '0';
        counter <= NONE;
        active  <= '0';
        valid_1 <= '0';
        drops   <= (others => '0');
      end if;
    end if;
  end process;

  latch : entity work.sample_latch
    generic map (
      ADC_BITS      => ADC_BITS,
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => taken,
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
      out_valid       => open,
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

  words : entity work.telemetry_words
    generic map (
      ADC_BITS      => ADC_BITS,
      POSITION_BITS => POSITION_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      in_valid        => active,
      index           => index,
      counter         => counter,
      adc_a           => code_a,
      adc_b           => code_b,
      adc_c           => code_c,
      adc_u_dc        => code_u_dc,
      position_code   => code_theta,
      omega_ref       => omega_ref,
      i_d_ref         => i_d_ref,
      i_q_ext         => i_q_ext,
      theta_me        => theta_me_1,
      omega_me        => omega_me_1,
      u_dc            => u_dc_1,
      i_d             => i_d_1,
      i_q             => i_q_1,
      i_q_ref         => i_q_ref_1,
      lambda_d        => lambda_d_1,
      lambda_q        => lambda_q_1,
      u_d             => u_d_1,
      u_q             => u_q_1,
      compare_a       => compare_a_1,
      compare_b       => compare_b_1,
      compare_c       => compare_c_1,
      temp_winding    => temp_winding,
      psi_m           => psi_m_1,
      run             => run,
      speed_mode      => speed_mode,
      temp_valid      => temp_valid,
      clear_faults    => clear_faults,
      current_at_rail => current_at_rail_1,
      temp_lost       => temp_lost_1,
      sat_d           => sat_d_1,
      sat_q           => sat_q_1,
      psi_held        => psi_held_1,
      flux_faults     => flux_faults_1,
      v_dead          => v_dead_1,
      v_comp          => v_comp_1,
      out_valid       => valid_2,
      word            => word_2
    );

  queue : entity work.packet_fifo
    generic map (
      WIDTH      => 32,
      DEPTH_BITS => DEPTH_BITS,
      PACKET     => COUNT
    )
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => valid_2,
      in_data   => word_2,
      in_last   => last_2,
      out_ready => m_axis_tready,
      out_valid => m_axis_tvalid,
      out_data  => m_axis_tdata,
      out_last  => m_axis_tlast,
      room      => room
    );

  dropped <= drops;

end architecture rtl;
