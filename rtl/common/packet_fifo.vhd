-- Purpose: a queue of words in block RAM for an AXI4-Stream: takes a word a clock, gives one when the sink is ready.
-- room says whether a whole packet of PACKET words fits: who asks before the first word never has to wait nor to
-- break off.  A word that finds the queue full is ignored.  out_data and out_last stay until out_ready.
-- Formats: as they come.  The RAM holds 2**DEPTH_BITS words, the output register one more.
-- Latency: a word is shown two clocks after it came where the queue was empty.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity packet_fifo is
  generic (
    WIDTH      : positive range 1 to 71 := 32;
    DEPTH_BITS : positive range 3 to 16 := 9;
    PACKET     : positive               := 24
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    in_data   : in  unsigned(WIDTH - 1 downto 0);
    in_last   : in  std_logic;
    out_ready : in  std_logic;
    out_valid : out std_logic;
    out_data  : out unsigned(WIDTH - 1 downto 0);
    out_last  : out std_logic;
    room      : out std_logic
  );
end entity packet_fifo;

architecture rtl of packet_fifo is
  constant DEPTH : positive := 2 ** DEPTH_BITS;

  type ram_t is array (0 to DEPTH - 1) of unsigned(WIDTH downto 0);

  signal ram : ram_t;

  -- State
  signal used     : unsigned(DEPTH_BITS downto 0);  -- words in the RAM
  signal write_at : unsigned(DEPTH_BITS - 1 downto 0);
  signal read_at  : unsigned(DEPTH_BITS - 1 downto 0);
  signal shown    : std_logic;
  signal word     : unsigned(WIDTH downto 0);

  signal take  : std_logic;
  signal fetch : std_logic;
begin
  take  <= in_valid and not used(DEPTH_BITS);
  fetch <= '1' when used /= 0 and (shown = '0' or out_ready = '1') else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      -- The RAM's write port and, with its output register, its read port; never the same word in the same clock
      if take = '1' then
        ram(to_integer(write_at)) <= in_last & in_data;
        write_at                  <= write_at + 1;
      end if;
      if fetch = '1' then
        word    <= ram(to_integer(read_at));
        read_at <= read_at + 1;
      end if;

      shown <= fetch or (shown and not out_ready);
      if take = '1' and fetch = '0' then
        used <= used + 1;
      elsif take = '0' and fetch = '1' then
        used <= used - 1;
      end if;

      if rst = '1' then
        used     <= (others => '0');
        write_at <= (others => '0');
        read_at  <= (others => '0');
        shown    <= '0';
      end if;
    end if;
  end process;

  out_valid <= shown;
  out_data  <= word(WIDTH - 1 downto 0);
  out_last  <= word(WIDTH);
  room      <= '1' when used <= DEPTH - PACKET else '0';

end architecture rtl;
