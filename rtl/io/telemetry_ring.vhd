-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the last rows of the telemetry in block RAM: they stay when a trip, a fault, a threshold or a write stops it.
-- A row is a telemetry packet, ROW_WORDS words one after the other, with two clocks or more before the next.
--   ring_arm = 1:  forget the rows, record from the next whole row on; the oldest row makes room for the newest
--   a trigger:     the row that is entering, or else the next one, and ring_after more are recorded; then the ring ends
-- A trigger is a trip or a fault that ring_faults names and that appears, a word of the row above ring_high or below
-- ring_low, or ring_stop.  The first one counts; ring_cause says which.  Only whole rows enter, and after the end none:
-- software reads them while the drive goes on, a word at ring_address after the other.
--   oldest row:    address ring_next if ring_full, else 0
-- RING_ROWS = 0 leaves the ring out: every output is constant.
-- Formats: words as they come; the threshold compares the low LEVEL_W bits of a word, signed, which hold every field
-- that has a word for itself.  Rounding: none.  Latency: ring_data follows ring_address by one clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity telemetry_ring is
  generic (
    RING_ROWS : natural range 0 to 2730 := 0;
    ROW_WORDS : positive range 2 to 31  := 24
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;  -- synchronous, active high
    row_valid      : in  std_logic;  -- 1: a word of a row
    row_word       : in  unsigned(31 downto 0);
    tripped        : in  std_logic;
    fault_flags    : in  unsigned(15 downto 0);
    ring_arm       : in  std_logic;  -- 1: forget the ring's rows and record
    ring_stop      : in  std_logic;  -- 1: a trigger of the ring, as a trip is
    ring_faults    : in  unsigned(16 downto 0);  -- bit x: fault x ends the ring; bit 16: a trip
    ring_word      : in  unsigned(4 downto 0);  -- word of the packet that ends the ring beyond its limits; 0: none
    ring_high      : in  signed(TELEMETRY_RING_LEVEL_W - 1 downto 0);
    ring_low       : in  signed(TELEMETRY_RING_LEVEL_W - 1 downto 0);
    ring_after     : in  unsigned(11 downto 0);  -- rows to record after the row of the trigger
    ring_address   : in  unsigned(15 downto 0);  -- address of ring_data, in words
    ring_recording : out std_logic;
    ring_ended     : out std_logic;  -- 1: the rows stay
    ring_full      : out std_logic;  -- 1: every row of the ring is written
    ring_cause     : out unsigned(3 downto 0);  -- trip, fault, threshold, write
    ring_next      : out unsigned(15 downto 0);  -- address after the newest row
    ring_data      : out unsigned(31 downto 0);  -- the word at ring_address
    ring_depth     : out unsigned(11 downto 0)  -- rows of the ring as built
  );
end entity telemetry_ring;

architecture rtl of telemetry_ring is
  constant LEVEL_W : positive := TELEMETRY_RING_LEVEL_W;

  function address_bits return positive is
    variable bits : positive := 1;
  begin
    while 2 ** bits < RING_ROWS * ROW_WORDS loop
      bits := bits + 1;
    end loop;
    return bits;
  end function;

  constant ADDRESS_W : positive                         := address_bits;
  constant BUILT     : boolean                          := RING_ROWS > 0;
  constant LAST      : unsigned(ADDRESS_W - 1 downto 0) :=
    to_unsigned((RING_ROWS * ROW_WORDS + 2 ** ADDRESS_W - 1) mod 2 ** ADDRESS_W, ADDRESS_W);

  type ram_t is array (0 to 2 ** ADDRESS_W - 1) of unsigned(31 downto 0);

  signal ram : ram_t;

  -- yosys: nobody reads a word in the clock that writes it once the ring has ended, so no bypass logic is needed
  attribute no_rw_check : boolean;
  attribute no_rw_check of ram : signal is true;

  -- State
  signal index    : unsigned(4 downto 0);  -- word of the row that enters
  signal waiting  : std_logic;  -- armed, not between two rows yet
  signal live     : std_logic;
  signal hit      : std_logic;  -- a trigger came
  signal ended    : std_logic;
  signal wrapped  : std_logic;
  signal full     : std_logic;  -- wrapped, a clock later, when every word can be read
  signal write_at : unsigned(ADDRESS_W - 1 downto 0);
  signal left     : unsigned(11 downto 0);  -- rows to record beside the one that is entering
  signal cause    : unsigned(3 downto 0);
  signal inside   : std_logic;  -- a row has begun and not ended
  signal out_of_rst : std_logic;

  signal final    : std_logic;
  signal level    : signed(LEVEL_W - 1 downto 0);
  signal now      : unsigned(3 downto 0);
  signal valid_1  : std_logic;
  signal word_1   : unsigned(31 downto 0);
  signal final_1  : std_logic;
  signal beyond_1 : std_logic;
  signal stop_1   : std_logic;
  signal trip_1   : std_logic;
  signal trip_2   : std_logic;
  signal fault_1  : std_logic;
  signal fault_2  : std_logic;
  signal end_2    : std_logic;
  signal data     : unsigned(31 downto 0);
begin
  final <= '1' when index = ROW_WORDS - 1 else '0';
  level <= signed(row_word(LEVEL_W - 1 downto 0));
  now   <= stop_1 & (valid_1 and beyond_1) & (fault_1 and not fault_2) & (trip_1 and not trip_2);

  process (clk)
  begin
    if rising_edge(clk) then
      -- Stage 1: the word, whether it is the row's last, whether it is beyond the limits; causes that appear
      valid_1 <= row_valid;
      word_1  <= row_word;
      final_1 <= final;
      beyond_1 <= '0';
      if ring_word /= 0 and ring_word = index and (level > ring_high or level < ring_low) then
        beyond_1 <= '1';
      end if;
      if row_valid = '1' then
        index <= (others => '0') when final = '1' else index + 1;
      end if;
      stop_1  <= ring_stop;
      trip_1  <= tripped and ring_faults(16);
      trip_2  <= trip_1;
      fault_1 <= or (fault_flags and ring_faults(15 downto 0));
      fault_2 <= fault_1;
      if valid_1 = '1' then
        inside <= not final_1;
      end if;
      end_2 <= valid_1 and final_1;

      -- Stage 2: the word to the RAM
      if live = '1' and valid_1 = '1' then
        ram(to_integer(write_at)) <= word_1;
        write_at                  <= write_at + 1;
        if write_at = LAST then
          write_at <= (others => '0');
          wrapped  <= '1';
        end if;
      end if;
      full <= wrapped;
      data <= ram(to_integer(ring_address(ADDRESS_W - 1 downto 0)));

      -- The first trigger, and the end of the last row
      if live = '1' and hit = '0' and now /= 0 then
        hit   <= '1';
        left  <= ring_after;
        cause <= now;
      end if;
      if live = '1' and hit = '1' and end_2 = '1' then
        left <= left - 1;
        if left = 0 then
          live  <= '0';
          ended <= '1';
        end if;
      end if;

      -- Recording begins between two rows
      if (waiting and not inside and not valid_1) = '1' then
        waiting <= '0';
        live    <= '1';
      end if;
      if ring_arm = '1' then
        waiting  <= '1';
        live     <= '0';
        hit      <= '0';
        ended    <= '0';
        wrapped  <= '0';
        full     <= '0';
        write_at <= (others => '0');
        cause    <= (others => '0');
      end if;

      out_of_rst <= '1';
      if rst = '1' then
        index      <= (others => '0');
        waiting    <= '0';
        live       <= '0';
        hit        <= '0';
        ended      <= '0';
        wrapped    <= '0';
        full       <= '0';
        write_at   <= (others => '0');
        cause      <= (others => '0');
        inside     <= '0';
        valid_1    <= '0';
        stop_1     <= '0';
        trip_1     <= '0';
        trip_2     <= '0';
        fault_1    <= '0';
        fault_2    <= '0';
        end_2      <= '0';
        out_of_rst <= '0';
      end if;
    end if;
  end process;

  ring_recording <= (waiting or live) when BUILT else '0';
  ring_ended     <= ended when BUILT else '0';
  ring_full      <= full when BUILT else '0';
  ring_cause     <= cause when BUILT else (others => '0');
  ring_next      <= resize(write_at, 16) when BUILT else (others => '0');
  ring_data      <= data when BUILT else (others => '0');
  ring_depth     <= to_unsigned(RING_ROWS, 12) when BUILT and out_of_rst = '1' else (others => '0');

end architecture rtl;
