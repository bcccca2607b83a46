-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the count at each index of an incremental encoder: the first one refers it, later ones mend lost counts.
--   off = count + pending at the index, the shorter way round; it should be 0
-- Until referenced an index is a candidate; the next one within correct_max of it, the shaft having been farther away
-- meanwhile, is the same place passed twice: it corrects the count at once (fast) and sets referenced.  With
-- index_once = 1 the first index does.  Before it, start moves the count to start_count in the same way.
-- At a later index an off up to correct_max is counted in lost_counts (saturates),
-- flagged by index_lost and corrected by one count a sample.  A larger one is flagged by index_wrong and not corrected;
-- clearing it makes the next index a candidate.  restart forgets the reference.
-- An index or a start while one is in work, five clocks, is ignored.
-- Formats: counts.  Latency: 1 (every clock is a sample), index to correct 4.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;

entity index_check is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    index        : in  std_logic;
    count        : in  unsigned(17 downto 0);
    pending      : in  signed(19 downto 0);
    start        : in  std_logic;
    start_count  : in  unsigned(17 downto 0);
    restart      : in  std_logic;
    clear_faults : in  std_logic;
    counts       : in  unsigned(18 downto 0);
    correct_max  : in  unsigned(11 downto 0);
    index_once   : in  std_logic;
    correct      : out std_logic;
    correction   : out signed(19 downto 0);
    fast         : out std_logic;
    referenced   : out std_logic;
    index_count  : out unsigned(17 downto 0);
    lost_counts  : out unsigned(11 downto 0);
    index_lost   : out std_logic;
    index_wrong  : out std_logic
  );
end entity index_check;

architecture rtl of index_check is
  type state_t is record
    referenced  : std_logic;
    seen        : std_logic;              -- 1: there is a candidate
    away        : std_logic;              -- 1: the shaft was farther from it than correct_max
    candidate   : unsigned(17 downto 0);  -- its count
    index_count : unsigned(17 downto 0);
    lost_counts : unsigned(11 downto 0);
    index_lost  : std_logic;
    index_wrong : std_logic;
  end record state_t;

  signal state : state_t;

  signal valid    : std_logic_vector(0 to 4);
  signal starting : std_logic;  -- it is a start, not an index
  signal target   : unsigned(17 downto 0);  -- what the count should be: 0 at the index
  signal found_2  : signed(20 downto 0);  -- count as if the correction were complete
  signal off_3    : signed(21 downto 0);  -- the same, less what it should be

  signal apart_3  : signed(21 downto 0);  -- found, less the candidate
  signal size     : unsigned(20 downto 0);

  signal near  : std_logic;
  signal tried : std_logic;
  signal later : std_logic;
  signal first : std_logic;
  signal off   : std_logic;
  signal mend  : std_logic;
  signal wrong : std_logic;
begin
  valid(0) <= (index or (start and not state.referenced)) and not (or valid(1 to 4));

  -- Stage 3: start, first index, count that is off, or none of them
  size  <= unsigned(apart_3(20 downto 0)) xor (20 downto 0 => apart_3(21));
  near  <= '1' when size <= correct_max or ('0' & size) + correct_max >= counts else '0';
  tried <= valid(3) and not starting and not state.referenced;
  first <= tried and (index_once or (state.seen and state.away and near));
  later <= valid(3) and not starting and state.referenced;
  off   <= '0' when off_3 = 0 else later;
  mend  <= off and not beyond(off_3, correct_max, 0);
  wrong <= off and not mend;

  process (clk)
    variable counted : unsigned(12 downto 0);
    variable sum     : unsigned(13 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to 4) <= valid(0 to 3);

      -- Stage 0: an index, which came with a step that the count has at stage 1, or a start
      if valid(0) = '1' then
        starting <= not index;
        target   <= start_count and (17 downto 0 => not index);
      end if;

      -- Stage 1: found
      found_2 <= signed(resize(count, 21)) + pending;
      if (valid(1) and not starting) = '1' then
        state.index_count <= count;
      end if;

      -- Stage 2: off and apart
      apart_3 <= resize(found_2, 22) - signed(resize(state.candidate, 22));
      off_3 <= resize(found_2, 22) - signed(resize(target, 22));
      if starting = '0' and found_2 & '0' > signed(resize(counts, 22)) then
        off_3 <= resize(found_2, 22) - signed(resize(counts, 22));
      end if;

      -- Stage 3: the correction
      correct          <= (valid(3) and starting) or first or mend;
      fast             <= (valid(3) and starting) or first;
      correction       <= saturate(-off_3, 20);
      state.referenced <= first or (state.referenced and not (state.index_wrong and clear_faults));

      -- The candidate; apart follows it by a clock
      state.seen <= (tried or state.seen) and not first and not (state.index_wrong and clear_faults);
      state.away <= (state.away or not near) and not first and not (valid(3) or valid(4))
                    and not (state.index_wrong and clear_faults);
      if tried = '1' then
        state.candidate <= state.index_count;
      end if;

      -- |off| in 12 bits, which a mended off fits: inverted if negative, the bit below adds the one that is missing
      counted := resize(state.lost_counts, 13);
      if clear_faults = '1' then
        counted := (others => '0');
      end if;
      if mend = '1' then
        sum     := (counted & '1') + ((unsigned(off_3(11 downto 0)) xor (11 downto 0 => off_3(21))) & off_3(21));
        counted := sum(13 downto 1);
      end if;
      state.lost_counts <= counted(11 downto 0) or (11 downto 0 => counted(12));
      state.index_lost  <= mend or (state.index_lost and not clear_faults);
      state.index_wrong <= wrong or (state.index_wrong and not clear_faults);

      if (rst or restart) = '1' then
        valid(1 to 4)    <= (others => '0');
        correct          <= '0';
        state.referenced <= '0';
        state.seen       <= '0';
        state.away       <= '0';
      end if;
      if rst = '1' then
        starting          <= '0';
        target            <= (others => '0');
        found_2           <= (others => '0');
        off_3             <= (others => '0');
        correction        <= (others => '0');
        fast              <= '0';
        apart_3           <= (others => '0');
        state.candidate   <= (others => '0');
        state.index_count <= (others => '0');
        state.lost_counts <= (others => '0');
        state.index_lost  <= '0';
        state.index_wrong <= '0';
      end if;
    end if;
  end process;

  referenced  <= state.referenced;
  index_count <= state.index_count;
  lost_counts <= state.lost_counts;
  index_lost  <= state.index_lost;
  index_wrong <= state.index_wrong;

end architecture rtl;
