-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: position over several turns, and the position regulator over the speed loop.
--   shaft_position += wrap(code - last code), modulo 2**14 turns;  position_error = position_ref - shaft_position
--   e = 0 where at_rest and |position_error| <= position_band, else position_error
--   omega_asked = limit(position_kp*e + omega_ff, +-omega_most)
-- position_mode = 0: omega_asked is omega_ref.  The first sample is within its turn; one with position_restart does not
-- move the position.
-- Formats: shaft_position S(13,18) turns, wraps; position_error S(-1,18); omega_ff S(1,28), omega_asked PU.
-- Latency: 7.  Interval: 7.
-- Rounding: half up, of the proportional part and of the sum; position_error saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity position_control is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    code_theta       : in  unsigned(POSITION_BITS - 1 downto 0);
    position_ref     : in  signed(31 downto 0);
    omega_ff         : in  signed(INTEGRAL_W - 1 downto 0);
    at_rest          : in  std_logic;
    omega_ref        : in  signed(PU_W - 1 downto 0);
    speed_mode       : in  std_logic;
    reverse          : in  std_logic;
    position_restart : in  std_logic;
    position_mode    : in  std_logic;
    position_kp      : in  unsigned(KP_W - 1 downto 0);
    position_band    : in  unsigned(15 downto 0);
    omega_most       : in  signed(PU_W - 1 downto 0);
    out_valid        : out std_logic;
    shaft_position   : out signed(31 downto 0);
    position_error   : out signed(17 downto 0);
    omega_asked      : out signed(PU_W - 1 downto 0);
    regulates        : out std_logic
  );
end entity position_control;

architecture rtl of position_control is
  constant LATENCY : positive := POSITION_CONTROL_LATENCY;
  constant SUM_W   : positive := POSITION_CONTROL_SUM_W;

  type state_t is record
    code     : unsigned(TURN_W - 1 downto 0);
    seen     : std_logic;
    position : signed(31 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid   : std_logic_vector(0 to LATENCY);
  signal mech    : unsigned(TURN_W - 1 downto 0);
  signal delta_1 : signed(TURN_W - 1 downto 0);
  signal seen_1  : std_logic;
  signal away_3  : signed(31 downto 0);
  signal error_3 : signed(17 downto 0);
  signal e_3     : signed(17 downto 0);
  signal by_kp   : signed(KP_W downto 0);
  signal sum_6   : signed(SUM_W - 1 downto 0);
  signal asked_6 : signed(SUM_W - PU_TO_INTEGRAL + 1 downto 0);
begin
  valid(0) <= in_valid;
  by_kp    <= signed('0' & position_kp);
  mech     <= unsigned(negated(signed(shift_left(resize(code_theta, TURN_W), TURN_W - POSITION_BITS)), reverse));

  error_3 <= saturate(away_3, 18);
  e_3     <= (others => '0') when at_rest = '1' and beyond(error_3, position_band, 0) = '0' else error_3;

  -- Stages 4 to 6: sum = position_kp*e + omega_ff
  proportional_part : entity work.multiply_add
    generic map (DROP => POSITION_CONTROL_DROP_P)
    port map (clk => clk, a => by_kp, b => e_3, c => omega_ff, y => sum_6, limited => open);

  asked_6 <= round_half_up(resize(sum_6, SUM_W + 1), PU_TO_INTEGRAL);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: delta = wrap(code - last code);  stage 2: position
      if valid(0) = '1' then
        delta_1    <= signed(mech - state.code);
        state.code <= mech;
        seen_1     <= state.seen;
        state.seen <= '1';
      end if;
      if valid(1) = '1' then
        if seen_1 = '0' then
          state.position <= signed(resize(state.code, 32));
        elsif position_restart = '0' then
          state.position <= state.position + delta_1;
        end if;
      end if;

      -- Stage 3: position_ref - position, the shorter way;  stage 4: limited to half a turn
      away_3 <= position_ref - state.position;
      if valid(3) = '1' then
        position_error <= error_3;
      end if;

      -- Stage 7: omega_asked, limited, or the host's
      if valid(LATENCY - 1) = '1' then
        omega_asked <= resize(within(asked_6, unsigned(omega_most), 0), PU_W);
        regulates   <= '1';
        if position_mode = '0' then
          omega_asked <= omega_ref;
          regulates   <= speed_mode;
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.code          <= (others => '0');
        state.seen          <= '0';
        state.position      <= (others => '0');
      end if;
    end if;
  end process;

  out_valid      <= valid(LATENCY);
  shaft_position <= state.position;

end architecture rtl;
