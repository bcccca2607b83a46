-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: whether the motor is connected: current in all three phases while the regulator asks for some.
--   asked = run = 1 and |i_q_ref| >= 2*i_open
--   turning:  two phases carry |i_x| >= i_open within a turn, the third never does, in two turns in sequence
--   standing: a stall (motion_checks), and no phase carries i_open
-- A turn begins anew where nothing is asked for, and ends when theta_me has been in all four quadrants: at least half an
-- electrical turn, in which the current of a connected phase passes its peak.
-- Formats: i_open U(1,8).
-- Latency: 3.  Interval: 3.  Rounding: currents are cut (floor) to the limit's format, |x| is the one's complement where
-- x is negative: up to 1/256 late.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity load_check is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    i_a           : in  signed(PU_W - 1 downto 0);
    i_b           : in  signed(PU_W - 1 downto 0);
    i_c           : in  signed(PU_W - 1 downto 0);
    i_q_ref       : in  signed(PU_W - 1 downto 0);
    theta_me      : in  unsigned(TURN_W - 1 downto 0);
    run           : in  std_logic;
    motion_faults : in  unsigned(2 downto 0);
    i_open        : in  unsigned(LIMIT_W - 1 downto 0);
    out_valid     : out std_logic;
    open_load     : out std_logic
  );
end entity load_check;

architecture rtl of load_check is
  constant LATENCY : positive := LOAD_CHECK_LATENCY;
  constant DROP    : natural  := PU_W - 1 - LIMIT_W;

  type state_t is record
    carried : unsigned(2 downto 0);
    visited : unsigned(3 downto 0);
    suspect : std_logic;
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal now_1     : unsigned(2 downto 0);
  signal asked_1   : std_logic;
  signal carried_2 : unsigned(2 downto 0);
  signal visited_2 : unsigned(3 downto 0);
  signal turned_2  : std_logic;
  signal missing_2 : std_logic;

  -- '1' if |x| >= limit, |x| being the one's complement where x is negative
  function reaches (x : signed; limit : unsigned) return std_logic is
    variable size : signed(x'length - 1 downto 0);
  begin
    size := x xor x(x'high);
    if unsigned(size) >= limit then
      return '1';
    end if;
    return '0';
  end function;
begin
  valid(0)  <= in_valid;
  turned_2  <= and visited_2;
  missing_2 <= '1' when carried_2 = "011" or carried_2 = "101" or carried_2 = "110" else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: comparisons with i_open
      if valid(0) = '1' then
        now_1   <= reaches(i_c(PU_W - 1 downto DROP), i_open) & reaches(i_b(PU_W - 1 downto DROP), i_open) &
                   reaches(i_a(PU_W - 1 downto DROP), i_open);
        asked_1 <= run and reaches(i_q_ref(PU_W - 1 downto DROP + 1), i_open);
      end if;

      -- Stage 2: carried = phases with current in this turn;  visited = quadrants of theta_me
      if valid(1) = '1' then
        carried_2 <= state.carried or now_1;
        visited_2 <= state.visited or shift_left(to_unsigned(1, 4), to_integer(theta_me(TURN_W - 1 downto TURN_W - 2)));
      end if;

      -- Stage 3: the verdict; a turn that is complete begins anew
      if valid(2) = '1' then
        open_load     <= asked_1 and ((turned_2 and missing_2 and state.suspect) or
                                      (motion_faults(2) and not (or now_1)));
        state.carried <= carried_2;
        state.visited <= visited_2;
        if turned_2 = '1' then
          state.carried <= (others => '0');
          state.visited <= (others => '0');
          state.suspect <= missing_2;
        end if;
        if asked_1 = '0' then
          state <= (suspect => '0', others => (others => '0'));
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (suspect => '0', others => (others => '0'));
        open_load           <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
