-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the position of a board from its pins: the front end of one kind of encoder, and what the core needs of it.
-- ENCODER: 0 external code, 1 A/B/Z, 2 Hall, 3 A/B/Z started by Hall, 4 SSI, 5 BiSS-C, 6 EnDat.
-- sample_trigger latches code and count, or starts a frame; position_done: code and speed are there.  The speed is that
-- between edges, else omega_set.  encoder_restart: the count has moved to the first index or to a start since the
-- trigger before.  ENCODER 3: the count starts from the Hall sensors when they are valid and the settings are good,
-- once, and again after clear_encoder.
-- angle_unknown: A/B/Z before the index is believed, unless started.  hall_wrong: where the angle is that of Hall sensors,
-- an illegal code or a change by more than one sector.
-- encoder_flags: 0 referenced, 1 moving, 2 index_lost, 3 index_wrong, 4 setting_refused, 5 hall_valid,
-- 6 position_valid, 7 position_lost, 8 alarm, 9 warning, 10 forward.
-- Formats: those of the blocks.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity position_front is
  generic (
    ENCODER       : natural range 0 to 6   := 1;
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    pin_a           : in  std_logic;  -- asynchronous, as all pins but position_in
    pin_b           : in  std_logic;
    pin_z           : in  std_logic;
    hall_a          : in  std_logic;
    hall_b          : in  std_logic;
    hall_c          : in  std_logic;
    serial_data     : in  std_logic;
    position_in     : in  unsigned(POSITION_BITS - 1 downto 0);
    sample_trigger  : in  std_logic;
    codes_valid     : in  std_logic;
    clear_encoder   : in  std_logic;
    omega_set       : in  signed(PU_W - 1 downto 0);
    reverse         : in  std_logic;
    filter_clocks   : in  unsigned(9 downto 0);
    index_phase     : in  unsigned(1 downto 0);
    counts          : in  unsigned(18 downto 0);
    code_step       : in  unsigned(16 downto 0);
    code_rest       : in  unsigned(17 downto 0);
    correct_max     : in  unsigned(11 downto 0);
    index_once      : in  std_logic;
    k_edge          : in  unsigned(31 downto 0);
    whole_lines     : in  std_logic;
    hall_reverse    : in  std_logic;
    hall_offset     : in  unsigned(TURN_W - 1 downto 0);
    start_first     : in  unsigned(17 downto 0);
    sector_counts   : in  unsigned(19 downto 0);
    half_period     : in  unsigned(9 downto 0);
    encoder_bits    : in  unsigned(5 downto 0);
    turn_bits       : in  unsigned(5 downto 0);
    gray            : in  std_logic;
    parity_on       : in  std_logic;
    crc_on          : in  std_logic;
    start_max       : in  unsigned(15 downto 0);
    mode_command    : in  unsigned(5 downto 0);
    two_errors      : in  std_logic;
    position_delay  : in  unsigned(17 downto 0);
    bridge_max      : in  unsigned(7 downto 0);
    encoder_code    : out unsigned(POSITION_BITS - 1 downto 0);
    encoder_restart : out std_logic;
    omega_now       : out signed(PU_W - 1 downto 0);
    position_done   : out std_logic;
    encoder_count   : out unsigned(17 downto 0);
    encoder_flags   : out unsigned(10 downto 0);
    index_count     : out unsigned(17 downto 0);
    illegal_count   : out unsigned(11 downto 0);
    lost_counts     : out unsigned(11 downto 0);
    bridged_count   : out unsigned(11 downto 0);
    index_wrong     : out std_logic;
    position_lost   : out std_logic;
    angle_unknown   : out std_logic;
    hall_wrong      : out std_logic;
    serial_clock    : out std_logic;
    serial_out      : out std_logic;
    serial_drive    : out std_logic
  );
end entity position_front;

architecture rtl of position_front is
  constant ABZ  : boolean := ENCODER = 1 or ENCODER = 3;
  constant HALL : boolean := ENCODER = 2 or ENCODER = 3;

  signal count, start_count                          : unsigned(17 downto 0);
  signal referenced, moving, index_lost, refused     : std_logic;
  signal forward, hall_done, hall_valid, start_valid : std_logic;
  signal position_valid, alarm, warning, skipped     : std_logic;
  signal hall_code, code_held                        : unsigned(POSITION_BITS - 1 downto 0);
  signal hall_omega, omega_held                      : signed(PU_W - 1 downto 0);
  signal hall_illegals                               : unsigned(11 downto 0);
  signal start, started                              : std_logic;  -- of the count
  signal moved, on_the_way                           : std_logic;  -- the count, since the last trigger
  signal triggered                                   : std_logic;
begin
  start      <= start_valid and not refused and not started;
  on_the_way <= moved or moving;

  encoder_flags <= forward & warning & alarm & position_lost & position_valid & hall_valid & refused & index_wrong
                   & index_lost & moving & referenced;

  incremental : if ABZ generate

    front : entity work.incremental_encoder
      generic map (POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, pin_a => pin_a, pin_b => pin_b, pin_z => pin_z, sample => sample_trigger,
                start => start, start_count => start_count, clear_faults => clear_encoder,
                filter_clocks => filter_clocks, index_phase => index_phase, counts => counts, code_step => code_step,
                code_rest => code_rest, correct_max => correct_max, index_once => index_once, reverse => reverse,
                k_edge => k_edge, whole_lines => whole_lines,
                code_theta => encoder_code, omega_me => omega_now, omega_valid => position_done, count => count,
                forward => forward, referenced => referenced, moving => moving, index_count => index_count,
                illegal_count => illegal_count, lost_counts => lost_counts, index_lost => index_lost,
                index_wrong => index_wrong, setting_refused => refused);

  else generate
    index_count <= (others => '0');
    lost_counts <= (others => '0');
    count       <= (others => '0');

    (index_wrong, index_lost, referenced, moving, refused, forward) <= std_logic_vector'("000000");
  end generate incremental;

  sectors : if HALL generate

    front : entity work.hall_front
      generic map (POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, hall_a => hall_a, hall_b => hall_b, hall_c => hall_c,
                sample_trigger => sample_trigger, clear_encoder => clear_encoder, filter_clocks => filter_clocks,
                hall_reverse => hall_reverse, hall_offset => hall_offset, start_first => start_first,
                sector_counts => sector_counts, reverse => reverse, k_edge => k_edge, code_theta => hall_code,
                omega_me => hall_omega, omega_valid => hall_done, hall_valid => hall_valid, start_count => start_count,
                start_valid => start_valid, illegal_count => hall_illegals, skipped_count => open, skipped => skipped);

  else generate
    start_count <= (others => '0');
    start_valid <= '0';
    hall_valid  <= '0';
    skipped     <= '0';
  end generate sectors;

  hall_alone : if ENCODER = 2 generate
    encoder_code  <= hall_code;
    omega_now     <= hall_omega;
    position_done <= hall_done;
    illegal_count <= hall_illegals;
  end generate hall_alone;

  absolute : if ENCODER >= 4 generate

    front : entity work.serial_encoder
      generic map (ENCODER => ENCODER, POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, serial_data => serial_data, sample_trigger => sample_trigger,
                codes_valid => codes_valid, clear_encoder => clear_encoder, half_period => half_period,
                encoder_bits => encoder_bits, turn_bits => turn_bits, gray => gray, parity_on => parity_on,
                crc_on => crc_on, start_max => start_max, mode_command => mode_command, two_errors => two_errors,
                position_delay => position_delay, bridge_max => bridge_max, serial_clock => serial_clock,
                data_out => serial_out, data_drive => serial_drive, code_theta => encoder_code,
                code_valid => position_done, position_valid => position_valid, position_lost => position_lost,
                bridged_count => bridged_count, alarm => alarm, warning => warning);

  else generate
    bridged_count <= (others => '0');

    (serial_clock, serial_out, serial_drive)        <= std_logic_vector'("100");
    (position_lost, position_valid, alarm, warning) <= std_logic_vector'("0000");
  end generate absolute;

  no_edges : if not ABZ and not HALL generate
    illegal_count <= (others => '0');
    omega_now     <= omega_held;
  end generate no_edges;

  elsewhere : if ENCODER = 0 generate
    position_done <= triggered;
    encoder_code  <= code_held;
  end generate elsewhere;

  process (clk)
  begin
    if rising_edge(clk) then
      -- A trigger latches the code from elsewhere, the count and whether it was on its way
      omega_held <= omega_set;
      triggered  <= sample_trigger;
      moved      <= on_the_way;
      started    <= (started or start) and not refused and not clear_encoder;
      if sample_trigger = '1' then
        code_held       <= position_in;
        encoder_count   <= count;
        encoder_restart <= on_the_way;
        moved           <= '0';
      end if;

      -- Whether the angle can be trusted
      angle_unknown <= not (referenced or started) when ABZ else '0';
      hall_wrong    <= (skipped or not hall_valid) and not referenced when HALL else '0';

      if rst = '1' then
        omega_held      <= (others => '0');
        triggered       <= '0';
        code_held       <= (others => '0');
        encoder_count   <= (others => '0');
        encoder_restart <= '0';
        moved           <= '0';
        started         <= '0';
        angle_unknown   <= '0';
        hall_wrong      <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
