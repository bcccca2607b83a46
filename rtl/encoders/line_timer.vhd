-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: time over whole lines of an incremental encoder, by a time stamp for each of the four edges of a line.
--   line_span = clocks from the last edge of this kind before the window to the last edge of the window
--   next_span = clocks since the edge one line before the one that comes next, in the direction of the last one
-- Between two edges of one kind the errors of the disc (phase of A and B, length of their levels) cancel.
-- A window begins with take; an edge at that clock belongs to the new one.  An edge after a reversal is the edge passed
-- before; a reversal, and a rest of the longest time (still), make the stamps of the other edges unknown.
-- Formats: stamps and spans TIME_W + SPAN_MORE bits, they wrap.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity line_timer is
  generic (
    TIME_W : positive range 4 to 24 := EDGE_TIMER_TIME_W
  );
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    step_up    : in  std_logic;
    step_down  : in  std_logic;
    take       : in  std_logic;
    still      : in  std_logic;
    line_span  : out unsigned(TIME_W + LINE_TIMER_SPAN_MORE - 1 downto 0);
    line_known : out std_logic;
    next_span  : out unsigned(TIME_W + LINE_TIMER_SPAN_MORE - 1 downto 0);
    next_known : out std_logic
  );
end entity line_timer;

architecture rtl of line_timer is
  subtype stamp_t is unsigned(TIME_W + LINE_TIMER_SPAN_MORE - 1 downto 0);

  type stamps_t is array (0 to 3) of stamp_t;

  type state_t is record
    now        : stamp_t;
    seen       : std_logic;
    forward    : std_logic;  -- direction of the last edge
    kind       : unsigned(1 downto 0);  -- of the last edge
    known      : std_logic_vector(3 downto 0);  -- the last edge of each kind is of this run in one direction
    fresh      : std_logic_vector(3 downto 0);  -- no edge of each kind in this window yet
    base_known : std_logic_vector(3 downto 0);
    next_stamp : stamp_t;
  end record state_t;

  signal state : state_t;
  signal last  : stamps_t;  -- time stamps of the last edge of each kind
  signal base  : stamps_t;  -- of the last one before the window

  signal edge      : std_logic;
  signal turned    : std_logic;
  signal kind      : unsigned(1 downto 0);
  signal following : unsigned(1 downto 0);
  signal first     : std_logic;
begin
  edge      <= step_up or step_down;
  turned    <= edge and state.seen and (step_up xor state.forward);
  following <= kind + 1 when step_up = '1' else kind - 1;
  first     <= state.fresh(to_integer(kind)) or take;

  kind <= state.kind when (edge and state.seen and not turned) = '0' else
          state.kind + 1 when step_up = '1' else
          state.kind - 1;

  process (clk)
    variable known      : std_logic_vector(3 downto 0);
    variable base_known : std_logic_vector(3 downto 0);
    variable at         : natural range 0 to 3;
  begin
    if rising_edge(clk) then
      at         := to_integer(kind);
      known      := state.known and not (still or turned);
      base_known := state.base_known and not (still or turned);
      state.now  <= state.now + 1;
      state.seen <= state.seen or edge;
      state.kind <= kind;
      if take = '1' then
        state.fresh <= (others => '1');
      end if;
      if edge = '1' then
        state.forward <= step_up;

        -- The stamp before the window is that of the last edge of this kind when the window's first one comes
        line_span <= state.now - base(at);
        if first = '1' then
          base(at)       <= last(at);
          base_known(at) := known(at);
          line_span      <= state.now - last(at);
        end if;
        line_known <= base_known(at);

        last(at)         <= state.now;
        known(at)        := '1';
        state.fresh(at)  <= '0';
        state.next_stamp <= last(to_integer(following));
        next_known       <= known(to_integer(following));
      end if;
      state.known      <= known;
      state.base_known <= base_known;

      if rst = '1' then
        state.now        <= (others => '0');
        state.seen       <= '0';
        state.forward    <= '0';
        state.kind       <= (others => '0');
        state.known      <= (others => '0');
        state.fresh      <= (others => '0');
        state.base_known <= (others => '0');
        line_known       <= '0';
        next_known       <= '0';
      end if;
    end if;
  end process;

  next_span <= state.now - state.next_stamp;

end architecture rtl;
