-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: decides whether a request to the registers is allowed, and when a write takes effect.
--
--   allowed = the address has a register, it is writable, all strobes are set, low <= data <= high
--   store   = write and allowed and (the register takes effect at once or no sample is in flight)
--                   and (the gates are off or the register is no still setting)
--
-- A write that must wait for the end of a sample waits at most REGISTER_PATIENCE clocks: if samples follow each other
-- without a gap, it ends in SLVERR instead of blocking the bus.  A read, a refusal and a write that takes effect at
-- once never wait for a sample; but AXI4-Lite answers in order, so they wait behind a waiting write.
-- Answers: OKAY; to a write DECERR if no register has the address, SLVERR if it is not stored.  A read of
-- such an address is answered by OKAY and zero, so that a dump of the window ends no process by a bus error.
-- One comparator serves every register: its limits come from tables in register_map_pkg.
-- Formats: data as signed 32 bits; no register reaches 2**31.  Latency: 5 clocks without waiting; store is valid in the
-- clock before the edge at which the register changes.  arming comes a clock earlier: a register's enable needs only
-- arming, registered, and sample_busy, so that no long path leads to it.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;
use work.register_map_pkg.all;

entity register_access is
  generic (
    WORD_BITS  : positive range 5 to REGISTER_WORD_W  := REGISTER_WORD_W;  -- registers in the first 2**WORD_BITS words
    LIMIT_BITS : positive range 2 to REGISTER_LIMIT_W := REGISTER_LIMIT_W  -- their ranges fit so many bits
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    request     : in  std_logic;  -- held until answer, then low for a clock; its payload stays two clocks longer
    write       : in  std_logic;
    address     : in  unsigned(REGISTER_ADDRESS_W - 1 downto 0);
    data        : in  std_logic_vector(31 downto 0);
    strobe      : in  std_logic_vector(3 downto 0);
    sample_busy : in  std_logic;  -- a sample is in flight: no value it uses may change at this edge
    running     : in  std_logic;  -- the gates switch: no still setting changes two edges later
    arming      : out std_logic;  -- 1: store is possible in the next clock
    store       : out std_logic;  -- 1: the register is loaded at this edge
    answer      : out std_logic;
    response    : out std_logic_vector(1 downto 0);
    found       : out std_logic  -- a register has this address; valid three clocks after the request
  );
end entity register_access;

architecture rtl of register_access is
  constant OKAY   : std_logic_vector(1 downto 0) := "00";
  constant SLVERR : std_logic_vector(1 downto 0) := "10";
  constant DECERR : std_logic_vector(1 downto 0) := "11";

  signal word   : unsigned(WORD_BITS - 1 downto 0);
  signal number : signed(LIMIT_BITS - 1 downto 0);

  type accesses_t is array (0 to 2**(WORD_BITS - 4) - 1) of unsigned(2 downto 0);
  type ranges_t is array (0 to 2**(WORD_BITS - 4) - 1) of unsigned(REGISTER_RANGE_W - 1 downto 0);

  signal begun      : std_logic;
  signal valid      : std_logic_vector(1 to 4);
  signal accesses_1 : accesses_t;
  signal ranges_1   : ranges_t;
  signal inside_1   : std_logic;
  signal fits_1     : std_logic;
  signal access_2   : unsigned(2 downto 0);
  signal range_2    : unsigned(REGISTER_RANGE_W - 1 downto 0);
  signal writable_3 : std_logic;
  signal between_3  : std_logic;
  signal still_3    : std_logic;
  signal low_3      : signed(LIMIT_BITS - 1 downto 0);
  signal high_3     : signed(LIMIT_BITS - 1 downto 0);
  signal over_4     : std_logic;
  signal under_4    : std_logic;
  signal allowed_4  : std_logic;
  signal judged_5   : std_logic;
  signal armed_5    : std_logic;
  signal patient_5  : std_logic;
  signal waits_5    : std_logic;
  signal granted_5  : std_logic;
  signal barred     : std_logic;
  signal barred_5   : std_logic;
  signal waited     : natural range 0 to REGISTER_PATIENCE + 1;
  signal may_stay   : std_logic;
  signal in_time    : std_logic;

  -- a < b, only the sign of the difference: nothing precedes or follows the carry chain
  function below (a, b : signed(LIMIT_BITS - 1 downto 0)) return std_logic is
    variable difference : signed(LIMIT_BITS downto 0);
  begin
    difference := resize(a, LIMIT_BITS + 1) - resize(b, LIMIT_BITS + 1);
    return difference(LIMIT_BITS);
  end function;
begin
  word   <= address(WORD_BITS + 1 downto 2);
  number <= signed(data(LIMIT_BITS - 1 downto 0));

  allowed_4 <= valid(4) and writable_3 and not (over_4 or under_4);
  waits_5   <= patient_5 and sample_busy and in_time;
  granted_5 <= armed_5 and in_time and not (between_3 and sample_busy) and not barred_5;

  -- A still setting is refused where the gates switched in the clock in which it was judged or in one of its waiting
  barred <= (still_3 and running) or (barred_5 and patient_5);

  process (clk)
  begin
    if rising_edge(clk) then
      -- The results of a stage stay valid as long as the request; valid marks the clock from which they are
      begun         <= request;
      valid(1)      <= request and not begun;
      valid(2 to 4) <= valid(1 to 3);
      judged_5      <= valid(4) or waits_5;

      -- Stage 1: the table entry of each group of 16 words;  inside = the address is aligned and within the map;
      -- fits = all strobes set, and data within the width of the limits
      for k in ranges_t'range loop
        accesses_1(k) <= register_access_of(resize(to_unsigned(k, WORD_BITS - 4) & word(3 downto 0), REGISTER_WORD_W));
        ranges_1(k)   <= register_range_of(resize(to_unsigned(k, WORD_BITS - 4) & word(3 downto 0), REGISTER_WORD_W));
      end loop;
      inside_1 <= '0';
      if address(1 downto 0) = 0 and shift_right(address, WORD_BITS + 2) = 0 then
        inside_1 <= '1';
      end if;
      fits_1 <= '0';
      if strobe = "1111" and resize(number, 32) = signed(data) then
        fits_1 <= '1';
      end if;

      -- Stage 2: selection of the group
      access_2 <= accesses_1(to_integer(word(WORD_BITS - 1 downto 4)));
      range_2  <= ranges_1(to_integer(word(WORD_BITS - 1 downto 4)));

      -- Stage 3: found = a register at the address; writable = software may write it, and the data fit
      found      <= '0';
      writable_3 <= '0';
      between_3  <= '0';
      still_3    <= '0';
      if access_2 /= REGISTER_NONE then
        found <= inside_1;
      end if;
      if access_2 = REGISTER_BETWEEN or access_2 = REGISTER_AT_ONCE or access_2 = REGISTER_STILL then
        writable_3 <= inside_1 and fits_1 and write;
      end if;
      if access_2 = REGISTER_BETWEEN or access_2 = REGISTER_STILL then
        between_3 <= '1';
      end if;
      if access_2 = REGISTER_STILL then
        still_3 <= '1';
      end if;
      low_3  <= resize(register_low_of(range_2), LIMIT_BITS);
      high_3 <= resize(register_high_of(range_2), LIMIT_BITS);

      -- Stage 4: allowed = writable and low <= data <= high
      under_4 <= below(number, low_3);
      over_4  <= below(high_3, number);

      -- Stage 5: armed = allowed and not stored yet; patient if a sample may delay it
      armed_5   <= allowed_4 or waits_5;
      patient_5 <= (allowed_4 and between_3) or waits_5;
      barred_5  <= barred;

      -- Clocks that a write has waited for the end of a sample
      waited <= 0;
      if patient_5 = '1' then
        waited <= waited + 1;
      end if;
      may_stay <= '0' when waited = REGISTER_PATIENCE - 2 else '1';
      in_time  <= may_stay;

      if rst = '1' then
        begun     <= '0';
        valid     <= (others => '0');
        judged_5  <= '0';
        armed_5   <= '0';
        patient_5 <= '0';
        barred_5  <= '0';
        waited    <= 0;
        may_stay  <= '1';
        in_time   <= '1';
      end if;
    end if;
  end process;

  -- arming does not depend on sample_busy, which arrives late.  It therefore stays 1 for one clock after the store, in
  -- which the register is loaded with the same data or not at all; it is 0 in the clock that refuses the write
  arming   <= (allowed_4 or (patient_5 and may_stay and in_time)) and not barred;
  store    <= granted_5;
  answer   <= judged_5 and not waits_5;
  response <= OKAY when write = '0' else
              DECERR when found = '0' else
              SLVERR when granted_5 = '0' else
              OKAY;

end architecture rtl;
