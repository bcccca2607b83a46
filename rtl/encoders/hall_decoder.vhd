-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: three Hall sensors to the coarse electrical angle, to steps of a sixth turn and to the start of an encoder.
-- Forward, (a, b, c) = 101, 100, 110, 010, 011, 001 are the sectors 0 to 5; hall_reverse = 1 counts them the other way
-- round.  theta_hall = (sector + 1/2)/6 + hall_offset.  000 and 111 are illegal: they are counted, the last sector is
-- kept and hall_valid is 0.  A change by more than one sector is no step and is counted as skipped.
--   start_count = start_first + round(sector * sector_counts)
-- Formats: angles TURN, sector_counts U(16,4).  Latency: 1 (every clock is a sample), start_count 3.
-- Rounding: the middle of the sector to nearest, the count half up; angle and count wrap, the counters saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity hall_decoder is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    hall_a        : in  std_logic;
    hall_b        : in  std_logic;
    hall_c        : in  std_logic;
    settled       : in  std_logic;
    clear_faults  : in  std_logic;
    hall_reverse  : in  std_logic;
    hall_offset   : in  unsigned(TURN_W - 1 downto 0);
    start_first   : in  unsigned(17 downto 0);
    sector_counts : in  unsigned(19 downto 0);
    theta_hall    : out unsigned(TURN_W - 1 downto 0);
    sector        : out unsigned(2 downto 0);
    hall_valid    : out std_logic;
    step_up       : out std_logic;
    step_down     : out std_logic;
    start_count   : out unsigned(17 downto 0);
    start_valid   : out std_logic;
    illegal_count : out unsigned(11 downto 0);
    skipped_count : out unsigned(11 downto 0);
    skipped       : out std_logic
  );
end entity hall_decoder;

architecture rtl of hall_decoder is
  type sectors_t is array (0 to 7) of unsigned(2 downto 0);

  constant SECTORS : sectors_t := ("000", "001", "011", "010", "101", "000", "100", "000");  -- of the code c, b, a

  type state_t is record
    sector        : unsigned(2 downto 0);
    seen          : std_logic;
    valid         : std_logic;
    skipped       : std_logic;
    illegal       : std_logic;  -- 1: the code before was illegal, which counts once
    illegal_count : unsigned(11 downto 0);
    skipped_count : unsigned(11 downto 0);
  end record state_t;

  signal state : state_t;

  signal product_1 : unsigned(22 downto 0);
  signal valid_1   : std_logic;

  signal code     : unsigned(2 downto 0);
  signal legal    : std_logic;
  signal illegal  : std_logic;
  signal now      : unsigned(2 downto 0);
  signal sector_0 : unsigned(2 downto 0);
  signal change   : signed(3 downto 0);
  signal up       : std_logic;
  signal down     : std_logic;
  signal skip     : std_logic;

  -- One more event, from 0 if cleared; saturates
  function counted (count : unsigned; event : std_logic; clear : std_logic) return unsigned is
    variable result : unsigned(11 downto 0) := count;
  begin
    if clear = '1' then
      result := (others => '0');
    end if;
    if event = '1' and result /= 4095 then
      result := result + 1;
    end if;
    return result;
  end function;
begin
  code     <= hall_c & hall_b & hall_a;
  legal    <= '0' when code = 0 or code = 7 else settled;
  illegal  <= settled and not legal;
  now      <= 5 - SECTORS(to_integer(code)) when hall_reverse = '1' else SECTORS(to_integer(code));
  sector_0 <= now when legal = '1' else state.sector;
  change   <= signed('0' & sector_0) - signed('0' & state.sector) when state.seen = '1' else "0000";
  up       <= '1' when change = 1 or change = -5 else '0';
  down     <= '1' when change = -1 or change = 5 else '0';
  skip     <= '0' when change = 0 else not (up or down);

  process (clk)
  begin
    if rising_edge(clk) then
      state.sector        <= sector_0;
      state.seen          <= state.seen or legal;
      state.valid         <= legal;
      state.illegal       <= illegal;
      state.skipped       <= skip;
      state.illegal_count <= counted(state.illegal_count, illegal and not state.illegal, clear_faults);
      state.skipped_count <= counted(state.skipped_count, skip, clear_faults);
      step_up             <= up;
      step_down           <= down;
      theta_hall          <= HALL_DECODER_MIDDLE(to_integer(sector_0)) + hall_offset;

      -- Stage 1: sector * sector_counts.  Stage 2: start_count, rounded
      product_1   <= state.sector * sector_counts;
      valid_1     <= state.valid;
      start_count <= start_first + resize(shift_right(product_1 + 8, 4), 18);
      start_valid <= valid_1;

      if rst = '1' then
        state.sector        <= (others => '0');
        state.seen          <= '0';
        state.valid         <= '0';
        state.illegal       <= '0';
        state.skipped       <= '0';
        state.illegal_count <= (others => '0');
        state.skipped_count <= (others => '0');
        step_up             <= '0';
        step_down           <= '0';
        theta_hall          <= (others => '0');
        product_1           <= (others => '0');
        valid_1             <= '0';
        start_count         <= (others => '0');
        start_valid         <= '0';
      end if;
    end if;
  end process;

  sector        <= state.sector;
  hall_valid    <= state.valid;
  illegal_count <= state.illegal_count;
  skipped_count <= state.skipped_count;
  skipped       <= state.skipped;

end architecture rtl;
