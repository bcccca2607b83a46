-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: speed of an incremental encoder from the time between its edges, at every speed by the same equation.
--   omega_me = k_edge * (counts between two edges) / (clocks between these edges)
-- The edges are the last one of this sample and the last one of the latest sample that had an edge, so there is no
-- change-over.  Without an edge |omega_me| is at most k_edge / (clocks since the last edge).
-- An edge after a reversal is the edge passed before, so it moves the shaft by no count.
-- whole_lines = 1: over whole lines of four counts, by line_timer, which uneven counts do not disturb; the first line
-- has no speed.
-- Formats: k_edge U(20,12), counts MOVED_W bits and clocks TIME_W bits, both saturating, output PU.  A time beyond
-- TIME_W bits is standstill.  Latency: 1 (every clock is a sample); sample to omega_valid LIMIT_AT + 2 clocks, one bit
-- of the product or of the quotient a clock; a sample before that is ignored and its edges belong to the next.
-- Rounding: the size to nearest, halves away from zero; it saturates at 2 per unit.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity edge_timer is
  generic (
    TIME_W  : positive range 4 to 24 := EDGE_TIMER_TIME_W;  -- at most MOVED_W + 11
    MOVED_W : positive range 3 to 16 := EDGE_TIMER_MOVED_W
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    step_up     : in  std_logic;
    step_down   : in  std_logic;
    sample      : in  std_logic;
    reverse     : in  std_logic;
    k_edge      : in  unsigned(31 downto 0);
    whole_lines : in  std_logic;
    omega_me    : out signed(PU_W - 1 downto 0);
    omega_valid : out std_logic
  );
end entity edge_timer;

architecture rtl of edge_timer is
  constant QUOTIENT_W : positive := EDGE_TIMER_QUOTIENT_W;
  constant WORK_W     : positive := MOVED_W + 32 + 1;  -- twice the product
  constant SPAN_W     : positive := TIME_W + LINE_TIMER_SPAN_MORE;

  -- Clocks of the engine: the product, a check for overflow, the quotient, its limit, the result
  constant DIVIDE_AT : positive := MOVED_W + 1;
  constant LIMIT_AT  : positive := DIVIDE_AT + QUOTIENT_W + 1;

  constant TIME_MAX  : unsigned(TIME_W - 1 downto 0) := (others => '1');
  constant MOVED_MAX : signed(MOVED_W downto 0)      := '0' & (MOVED_W - 1 downto 0 => '1');
  constant OMEGA_MAX : unsigned(QUOTIENT_W downto 0) := to_unsigned(2 ** (PU_W - 1) - 1, QUOTIENT_W + 1);

  type state_t is record
    seen    : std_logic;
    forward : std_logic;                     -- direction of the last edge
    elapsed : unsigned(TIME_W - 1 downto 0); -- clocks since the edge that the next speed starts from
    since   : unsigned(TIME_W - 1 downto 0); -- clocks since the last edge
    edges   : std_logic;                     -- 1: this sample has an edge
    span    : unsigned(TIME_W - 1 downto 0); -- clocks between the two edges
    moved   : signed(MOVED_W downto 0);      -- counts between the two edges
    omega   : signed(PU_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  -- Engine
  signal clock    : unsigned(5 downto 0);  -- 0: idle
  signal measured : std_logic;
  signal negative : std_logic;
  signal factor   : unsigned(MOVED_W - 1 downto 0);
  signal divisor  : unsigned(SPAN_W - 1 downto 0);
  signal product  : unsigned(WORK_W - 1 downto 0);  -- then remainder and bits still to be divided
  signal quotient : unsigned(QUOTIENT_W - 1 downto 0);
  signal past     : std_logic;  -- 1: the quotient is above its range

  signal edge : std_logic;
  signal take : std_logic;
  signal base : unsigned(TIME_W - 1 downto 0);
  signal top  : unsigned(SPAN_W downto 0);    -- remainder and the next bit
  signal left : signed(SPAN_W + 1 downto 0);  -- the same less the divisor
  signal size : unsigned(QUOTIENT_W downto 0);

  -- Over whole lines: counts up to the next multiple of four
  signal still      : std_logic;
  signal counts     : unsigned(MOVED_W - 1 downto 0);
  signal whole      : unsigned(MOVED_W - 1 downto 0);
  signal line_span  : unsigned(SPAN_W - 1 downto 0);
  signal line_known : std_logic;
  signal next_span  : unsigned(SPAN_W - 1 downto 0);
  signal next_known : std_logic;

  -- One clock more, up to the longest time
  function later (clocks : unsigned) return unsigned is
  begin
    if clocks = TIME_MAX then
      return clocks;
    end if;
    return clocks + 1;
  end function;
begin
  assert TIME_W <= MOVED_W + 11
    report "edge_timer: TIME_W must be at most MOVED_W + 11, the remainder has no more bits"
    severity failure;

  edge <= step_up or step_down;
  take <= sample when clock = 0 else '0';
  base <= state.since when (take and state.edges) = '1' else state.elapsed;
  top  <= product(SPAN_W + QUOTIENT_W - 1 downto QUOTIENT_W - 1);
  left <= signed('0' & top) - signed(resize(divisor, SPAN_W + 2));
  size <= shift_right(resize(quotient, QUOTIENT_W + 1) + 1, 1);

  still  <= '1' when state.since = TIME_MAX else '0';
  counts <= resize(magnitude(state.moved), MOVED_W);
  whole  <= counts(MOVED_W - 1 downto 2) & "00" when counts(1 downto 0) = 0 or (and counts(MOVED_W - 1 downto 2)) = '1' else
            (counts(MOVED_W - 1 downto 2) + 1) & "00";

  lines : entity work.line_timer
    generic map (TIME_W => TIME_W)
    port map (clk => clk, rst => rst, step_up => step_up, step_down => step_down, take => take, still => still,
              line_span => line_span, line_known => line_known, next_span => next_span, next_known => next_known);

  process (clk)
    variable moved : signed(MOVED_W downto 0);
  begin
    if rising_edge(clk) then
      -- The window between two samples; an edge at the sample's clock belongs to the next
      moved := state.moved;
      if take = '1' then
        moved := (others => '0');
      end if;
      if (edge and state.seen and (step_up xnor state.forward)) = '1' then
        if step_up = '1' and (state.moved /= MOVED_MAX or take = '1') then
          moved := moved + 1;
        elsif step_up = '0' and (state.moved /= -MOVED_MAX or take = '1') then
          moved := moved - 1;
        end if;
      end if;
      state.moved   <= moved;
      state.elapsed <= later(base);
      state.since   <= later(state.since);
      state.edges   <= edge or (state.edges and not take);
      state.seen    <= state.seen or edge;
      if edge = '1' then
        state.forward <= step_up;
        state.since   <= to_unsigned(1, TIME_W);
        state.span    <= base;
      end if;

      omega_valid <= '0';
      if take = '1' then
        clock    <= to_unsigned(1, 6);
        measured <= state.edges;
        negative <= state.moved(MOVED_W) xor reverse;
        factor   <= to_unsigned(1, MOVED_W);
        divisor  <= resize(state.since, SPAN_W);
        if (state.edges and whole_lines) = '1' then
          factor  <= whole and line_known;
          divisor <= line_span;
        elsif state.edges = '1' then
          factor  <= counts;
          divisor <= resize(state.span, SPAN_W);
        elsif (whole_lines and next_known) = '1' then
          factor  <= to_unsigned(4, MOVED_W);
          divisor <= next_span;
        end if;
        if (state.edges = '1' and state.span = TIME_MAX) or (state.edges = '0' and state.since = TIME_MAX) then
          factor <= (others => '0');
        end if;
        product  <= (others => '0');
        quotient <= (others => '0');
      elsif clock /= 0 then
        clock <= clock + 1;
        if clock < DIVIDE_AT then
          factor  <= shift_left(factor, 1);
          product <= shift_left(product, 1);
          if factor(MOVED_W - 1) = '1' then
            product <= shift_left(product, 1) + k_edge;
          end if;
        elsif clock = DIVIDE_AT then
          past    <= '0';
          product <= shift_left(product, 1 + EDGE_TIMER_UP);
          if product(WORK_W - 1 downto QUOTIENT_W - 1 - EDGE_TIMER_UP) >= divisor then
            past    <= '1';
            product <= (others => '0');
          end if;
        elsif clock < LIMIT_AT then
          quotient <= quotient(QUOTIENT_W - 2 downto 0) & not left(SPAN_W + 1);
          product  <= resize(top & product(QUOTIENT_W - 2 downto 0) & '0', WORK_W);
          if left(SPAN_W + 1) = '0' then
            product <= resize(unsigned(left(SPAN_W downto 0)) & product(QUOTIENT_W - 2 downto 0) & '0', WORK_W);
          end if;
        elsif clock = LIMIT_AT then
          quotient <= size(QUOTIENT_W - 1 downto 0);
          if past = '1' or size > OMEGA_MAX then
            quotient <= OMEGA_MAX(QUOTIENT_W - 1 downto 0);
          end if;
        else
          clock <= (others => '0');
          if measured = '1' then
            state.omega <= signed(quotient(PU_W - 1 downto 0));
            if negative = '1' then
              state.omega <= -signed(quotient(PU_W - 1 downto 0));
            end if;
          else
            state.omega <= within(state.omega, quotient(PU_W - 2 downto 0), 0);
          end if;
          omega_valid <= '1';
        end if;
      end if;

      if rst = '1' then
        state.seen    <= '0';
        state.forward <= '0';
        state.elapsed <= TIME_MAX;
        state.since   <= TIME_MAX;
        state.edges   <= '0';
        state.span    <= (others => '0');
        state.moved   <= (others => '0');
        state.omega   <= (others => '0');
        clock         <= (others => '0');
        omega_valid   <= '0';
      end if;
    end if;
  end process;

  omega_me <= state.omega;

end architecture rtl;
