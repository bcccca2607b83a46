-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: an AXI4-Stream packet for every sample: inputs of the core, its results, and the sample number.
-- The words of a packet (telemetry_words) are read from the core's live values, delayed by one clock: one word per
-- clock, from TELEMETRY_WORDS_START clocks after the sample on, when the values are valid and before the next sample
-- replaces them.  They enter a queue (packet_fifo) that the sink empties at its rate.
-- The controller never waits: if the packet of a sample does not fit into the queue, it is dropped; dropped counts it,
-- up to 2**DROPPED_W - 1.  The sample numbers count from 0 after a reset, modulo 2**NUMBER_W.  enable is checked before
-- the first word: a packet that has begun is completed.  A sample less than FLUXPROOF_SAMPLE_INTERVAL clocks after the
-- last one is ignored and not counted.  The words also leave before the queue, for telemetry_ring, with which a packet is
-- made where the queue takes none.
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
    DEPTH_BITS    : positive range 5 to 16  := 9;
    NUMBER_W      : positive range 2 to 32  := 32;  -- bits of the sample's number; fewer for a bench that fills it
    DROPPED_W     : positive range 2 to 16  := 16
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;  -- synchronous, active high
    enable         : in  std_logic;  -- 1: send packets
    sample_valid   : in  std_logic;  -- 1: the raw sample below is valid
    m_axis_tready  : in  std_logic;  -- 1: the sink accepts the word
    ring_recording : in  std_logic;  -- 1: the ring takes the packet, whatever the queue does
    sample         : in  sample_t;  -- codes of converters and encoder, references
    running        : in  std_logic;  -- 1: the gates are switching
    observed       : in  observed_t;  -- values of the sample
    estimated      : in  estimated_t;  -- values of the estimators
    m_axis_tdata   : out unsigned(31 downto 0);  -- a word of the packet
    m_axis_tvalid  : out std_logic;  -- 1: the word is valid
    m_axis_tlast   : out std_logic;  -- 1: last word of the packet
    dropped        : out unsigned(15 downto 0);  -- samples without a packet because the queue was full
    row_valid      : out std_logic;  -- 1: a word of a packet before the queue
    row_word       : out unsigned(31 downto 0)  -- the word
  );
end entity telemetry;

architecture rtl of telemetry is
  constant COUNT   : positive := TELEMETRY_WORDS_COUNT;
  constant INDEX_W : positive := TELEMETRY_WORDS_INDEX_W;
  constant AGE_W   : positive := TELEMETRY_AGE_W;

  constant AGE_END  : unsigned(AGE_W - 1 downto 0)     := to_unsigned(FLUXPROOF_SAMPLE_INTERVAL, AGE_W);
  constant NONE     : unsigned(NUMBER_W - 1 downto 0)  := (others => '1');  -- so that the first sample is number 0
  constant DROP_END : unsigned(DROPPED_W - 1 downto 0) := (others => '1');

  -- What enters with the sample, latched as in the core
  signal latched : sample_t;
  signal run     : std_logic;

  -- The core's outputs, delayed by one clock
  signal observed_1  : observed_t;
  signal estimated_1 : estimated_t;

  -- State
  signal age     : unsigned(AGE_W - 1 downto 0);  -- clocks since the sample, up to FLUXPROOF_SAMPLE_INTERVAL
  signal free    : std_logic;  -- 1: age = FLUXPROOF_SAMPLE_INTERVAL
  signal ready   : std_logic;  -- age = TELEMETRY_WORDS_START - 1
  signal full    : std_logic;  -- drops = DROP_END, a clock late: drops counts at most once per sample
  signal counter : unsigned(NUMBER_W - 1 downto 0);  -- number of the sample
  signal active  : std_logic;
  signal index   : unsigned(INDEX_W - 1 downto 0);
  signal drops   : unsigned(DROPPED_W - 1 downto 0);

  signal taken   : std_logic;
  signal start   : std_logic;
  signal final   : std_logic;
  signal room    : std_logic;
  signal valid_1 : std_logic;
  signal last_1  : std_logic;
  signal valid_2 : std_logic;
  signal word_2  : unsigned(31 downto 0);
  signal last_2  : std_logic;
  signal queued  : std_logic;  -- the queue takes the packet
  signal valid_q : std_logic;
begin
  taken <= sample_valid and free;
  start <= enable and ready;
  final <= '1' when index = COUNT - 1 else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      -- A register for the core's outputs, which come from distant parts of the chip
      observed_1  <= observed;
      estimated_1 <= estimated;

      -- Age and number of the sample
      if taken = '1' then
        latched <= sample;
        run     <= running;
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
      if ready = '1' then
        queued <= enable and room;
      end if;
      if (start and room) = '1' or (ready and ring_recording) = '1' then
        active <= '1';
        index  <= (others => '0');
      end if;
      if start = '1' and room = '0' and full = '0' then
        drops <= drops + 1;
      end if;
      full <= '1' when drops = DROP_END else '0';

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
        queued  <= '0';
        valid_1 <= '0';
        drops   <= (others => '0');
      end if;
    end if;
  end process;

  words : entity work.telemetry_words
    generic map (ADC_BITS => ADC_BITS, POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, in_valid => active, index => index,
              counter => resize(counter, 32),
              adc_a => latched.adc_a(ADC_BITS - 1 downto 0), adc_b => latched.adc_b(ADC_BITS - 1 downto 0),
              adc_c => latched.adc_c(ADC_BITS - 1 downto 0), adc_u_dc => latched.adc_u_dc(ADC_BITS - 1 downto 0),
              position_code => latched.position_code(POSITION_BITS - 1 downto 0), omega_ref => latched.omega_ref,
              i_d_ref => latched.i_d_ref, i_q_ext => latched.i_q_ext, theta_me => observed_1.theta_me,
              omega_me => observed_1.omega_me, u_dc => observed_1.u_dc, i_d => observed_1.i_d, i_q => observed_1.i_q,
              i_q_ref => observed_1.i_q_ref, lambda_d => observed_1.lambda_d, lambda_q => observed_1.lambda_q,
              u_d => observed_1.u_d, u_q => observed_1.u_q, compare_a => observed_1.compare_a,
              compare_b => observed_1.compare_b, compare_c => observed_1.compare_c,
              temp_winding => latched.temp_winding, psi_m => estimated_1.psi_m, run => run,
              speed_mode => latched.speed_mode, temp_valid => latched.temp_valid, clear_faults => latched.clear_faults,
              current_at_rail => observed_1.current_at_rail, temp_lost => estimated_1.temp_lost,
              sat_d => observed_1.sat_d, sat_q => observed_1.sat_q, psi_held => estimated_1.psi_held,
              flux_faults => estimated_1.flux_faults,
              speed_was_given => observed_1.speed_was_given, position_restarted => observed_1.position_restarted,
              v_dead => estimated_1.v_dead, v_comp => estimated_1.v_comp,
              out_valid => valid_2, word => word_2);

  queue : entity work.packet_fifo
    generic map (WIDTH => 32, DEPTH_BITS => DEPTH_BITS, PACKET => COUNT)
    port map (clk => clk, rst => rst, in_valid => valid_q, in_data => word_2, in_last => last_2,
              out_ready => m_axis_tready,
              out_valid => m_axis_tvalid, out_data => m_axis_tdata, out_last => m_axis_tlast, room => room);

  valid_q   <= valid_2 and queued;
  dropped   <= resize(drops, 16);
  row_valid <= valid_2;
  row_word  <= word_2;

end architecture rtl;
