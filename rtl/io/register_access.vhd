-- Purpose: decides what a request to the registers may do, and when.
--
--   allowed = a register stands at the address, may be written, all strobes are set, low <= data <= high
--   store   = write and allowed and (the register counts at once or no sample is in flight)
--
-- A write that must wait for the end of a sample waits, at most REGISTER_PATIENCE clocks: samples that leave no
-- gap at all end in SLVERR instead of a bus that hangs.  A read, a refusal and a write that counts at once never wait
-- for a sample, though AXI4-Lite answers in order: behind a write that waits they come after it.
-- Answers: OKAY; DECERR where no register stands at the address; SLVERR for a write that is not allowed or came late.
-- One comparator serves every register: its ends come from tables in register_map_pkg.
-- Formats: data as signed 32 bits; no register holds 2**31 or more.  Latency: 4 clocks without waiting; store is in
-- the clock before the edge at which the register changes.  armed comes a clock before store can: behind a register it
-- and sample_busy are all that a register needs to know, so that no long path tells it.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;
use work.register_map_pkg.all;

entity register_access is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    request     : in  std_logic;  -- held until answer
    write       : in  std_logic;
    address     : in  unsigned(REGISTER_ADDRESS_W - 1 downto 0);
    data        : in  std_logic_vector(31 downto 0);
    strobe      : in  std_logic_vector(3 downto 0);
    sample_busy : in  std_logic;  -- a sample enters or is in flight: nothing it uses may change at this edge
    armed       : out std_logic;  -- from the next clock on the register takes the data, once it may
    store       : out std_logic;  -- the register takes the data at this edge
    answer      : out std_logic;
    response    : out std_logic_vector(1 downto 0)
  );
end entity register_access;

architecture rtl of register_access is
  constant OKAY   : std_logic_vector(1 downto 0) := "00";
  constant SLVERR : std_logic_vector(1 downto 0) := "10";
  constant DECERR : std_logic_vector(1 downto 0) := "11";

  signal word      : unsigned(REGISTER_WORD_W - 1 downto 0);
  signal valid_1   : std_logic;
  signal access_1  : unsigned(1 downto 0);
  signal low_1     : signed(REGISTER_LIMIT_W - 1 downto 0);
  signal high_1    : signed(REGISTER_LIMIT_W - 1 downto 0);
  signal valid_2   : std_logic;
  signal found_2   : std_logic;
  signal allowed_2 : std_logic;
  signal at_once_2 : std_logic;
  signal valid_3   : std_logic;
  signal allowed_3 : std_logic;
  signal at_once_3 : std_logic;
  signal found_3   : std_logic;
  signal waited    : natural range 0 to REGISTER_PATIENCE;
  signal granted   : std_logic;
  signal late      : std_logic;
  signal done      : std_logic;
begin
  word <= address(REGISTER_WORD_W + 1 downto 2);

  granted <= allowed_3 and (at_once_3 or not sample_busy);
  late    <= '1' when waited = REGISTER_PATIENCE else '0';
  done    <= valid_3 and (granted or late or not (write and allowed_3));

  process (clk)
  begin
    if rising_edge(clk) then
      valid_1 <= request and not done;
      valid_2 <= valid_1 and not done;
      valid_3 <= valid_2 and not done;

      -- Stage 1: what the tables say about the word
      access_1 <= register_access_of(word);
      low_1    <= register_low_of(word);
      high_1   <= register_high_of(word);

      -- Stage 2: found = register at the address; allowed = writable and a whole word and low <= data <= high
      found_2   <= '0';
      allowed_2 <= '0';
      at_once_2 <= '0';
      if access_1 /= REGISTER_NONE and address(1 downto 0) = 0 and shift_right(address, REGISTER_WORD_W + 2) = 0 then
        found_2 <= '1';
        if access_1 /= REGISTER_READ_ONLY and strobe = "1111" and signed(data) >= low_1 and signed(data) <= high_1 then
          allowed_2 <= '1';
        end if;
      end if;
      if access_1 = REGISTER_AT_ONCE then
        at_once_2 <= '1';
      end if;

      -- Stage 3: the register is told, see armed
      found_3   <= found_2;
      allowed_3 <= allowed_2;
      at_once_3 <= at_once_2;

      -- Clocks that a write has waited for the end of a sample
      waited <= 0;
      if valid_3 = '1' and done = '0' then
        waited <= waited + 1;
      end if;

      if rst = '1' then
        valid_1 <= '0';
        valid_2 <= '0';
        valid_3 <= '0';
        waited  <= 0;
      end if;
    end if;
  end process;

  armed    <= valid_2 and write and allowed_2 and not done;
  store    <= valid_3 and write and granted;
  answer   <= done;
  response <= DECERR when found_3 = '0' else
              SLVERR when write = '1' and granted = '0' else
              OKAY;

end architecture rtl;
