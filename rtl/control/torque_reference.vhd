-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: from torque to current references at the least current, above base speed too, by a table of the motor.
--   torque_now moves to torque_ref by torque_step in a sample at most;  zero with run = 0
--   r = share*u_max*k_flux/|omega_me|;  top = TOP(r);  t = torque_gain*|torque_now|/top;  i_d, i_q = table(r, t)
--   torque_max = (2 - torque_gain)*top
--   share       += k_voltage*((u_share*u_max)**2 - u_d**2 - u_q**2)    within share_min..1;  1 with run = 0
--   torque_gain += k_torque*(torque_now - torque)*torque_now           within 1/2..3/2, where |omega_me| >= omega_learn
--                                                                      and |u|**2 <= 3/4*(u_share*u_max)**2
-- Two multipliers and one divider, two bits of the quotient a clock, are used one after the other.  Each of two block
-- RAMs holds a current of the table; table_word writes one word at every clock in which its bit 30 is set.
-- EXAMPLE = 1 fills the table at power-up, for the bench.
-- Formats: share U(0,28), torque_gain U(1,28), quotients U(0,16), table words PU.
-- Latency: 42.  Interval: 43; u_d, u_q and torque are read 20 clocks after the others.
-- Rounding: floored; increments of share and torque_gain half up; errors and torque_max saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity torque_reference is
  generic (
    EXAMPLE : natural range 0 to 1 := 0
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    torque_ref  : in  signed(PU_W - 1 downto 0);
    omega_me    : in  signed(PU_W - 1 downto 0);
    u_max       : in  unsigned(U_MAX_W - 1 downto 0);
    run         : in  std_logic;
    u_d         : in  signed(PU_W - 1 downto 0);
    u_q         : in  signed(PU_W - 1 downto 0);
    torque      : in  signed(PU_W - 1 downto 0);
    k_flux      : in  unsigned(KP_W - 1 downto 0);
    u_share     : in  unsigned(15 downto 0);
    k_voltage   : in  unsigned(KI_W - 1 downto 0);
    share_min   : in  unsigned(15 downto 0);
    k_torque    : in  unsigned(KI_W - 1 downto 0);
    omega_learn : in  signed(PU_W - 1 downto 0);
    torque_step : in  signed(PU_W - 1 downto 0);
    table_word  : in  unsigned(30 downto 0);
    out_valid   : out std_logic;
    i_d_table   : out signed(PU_W - 1 downto 0);
    i_q_table   : out signed(PU_W - 1 downto 0);
    torque_max  : out signed(PU_W - 1 downto 0)
  );
end entity torque_reference;

architecture rtl of torque_reference is
  constant LATENCY : positive := TORQUE_REFERENCE_LATENCY;
  constant GAIN_W  : positive := 29;
  constant SHARE_W : positive := 28;
  constant DROP    : positive := TORQUE_REFERENCE_DROP_STEP;
  constant STEP_W  : positive := KI_W + 1 + PU_W - DROP;

  constant ONE  : unsigned(GAIN_W - 1 downto 0)  := (GAIN_W - 1 => '1', others => '0');
  constant GAIN_MIN : unsigned(GAIN_W - 1 downto 0) := shift_right(ONE, 1);
  constant GAIN_MAX : unsigned(GAIN_W - 1 downto 0) := ONE + GAIN_MIN;
  constant FULL : unsigned(SHARE_W - 1 downto 0) := (others => '1');

  subtype word_t is signed(PU_W - 1 downto 0);
  subtype wide_t is signed(PU_W downto 0);  -- a difference of two words
  subtype size_t is unsigned(PU_W - 1 downto 0);  -- a magnitude
  type ram_t is array (0 to TORQUE_REFERENCE_ROWS * TORQUE_REFERENCE_WORDS - 1) of word_t;

  function power_up (d_axis : boolean) return ram_t is
    variable result : ram_t := (others => (others => '0'));
  begin
    if EXAMPLE = 1 then
      for k in result'range loop
        result(k) := TORQUE_REFERENCE_EXAMPLE_D(k) when d_axis else TORQUE_REFERENCE_EXAMPLE_Q(k);
      end loop;
    end if;
    return result;
  end function;

  -- low + the floored product of a difference and a fraction
  function between (low : word_t; product : signed) return word_t is
  begin
    return resize(low + shift_right(product, TORQUE_REFERENCE_COLUMN_BITS), PU_W);
  end function;

  type state_t is record
    share       : unsigned(SHARE_W - 1 downto 0);
    torque_gain : unsigned(GAIN_W - 1 downto 0);
    torque_now  : word_t;
  end record state_t;

  signal state : state_t;
  signal ram_d : ram_t := power_up(true);
  signal ram_q : ram_t := power_up(false);

  signal valid           : std_logic_vector(0 to LATENCY);
  signal reading         : std_logic;
  signal address         : unsigned(10 downto 0);
  signal word_d, word_q  : word_t;
  signal first_d, base_d : word_t;
  signal first_q, base_q : word_t;
  signal low_d, high_d   : word_t;
  signal low_q, high_q   : word_t;

  signal x_a, x_b : signed(KI_W downto 0);
  signal y_a, y_b : signed(PU_W - 1 downto 0);
  signal p_a, p_b : signed(KI_W + PU_W downto 0);

  signal gain           : word_t;
  signal speed          : size_t;
  signal fast           : std_logic;
  signal asked, divisor : size_t;
  signal rest           : size_t;
  signal whole          : std_logic;  -- the quotient is 1 or more
  signal quotient       : unsigned(15 downto 0);
  signal dividing       : std_logic;
  signal divided_1      : unsigned(PU_W downto 0);  -- bit of the quotient, rest
  signal divided_2      : unsigned(PU_W downto 0);
  signal ratio          : unsigned(15 downto 0);
  signal row_at         : unsigned(21 downto 0);
  signal column_at      : unsigned(20 downto 0);
  signal row            : unsigned(5 downto 0);
  signal column         : unsigned(4 downto 0);
  signal down, along    : unsigned(TORQUE_REFERENCE_COLUMN_BITS - 1 downto 0);
  signal top            : word_t;
  signal most           : word_t;
  signal sum            : signed(36 downto 0);
  signal left, pull     : word_t;
  signal calm           : std_logic;  -- the voltage is well within the circle
  signal spare          : word_t;  -- a quarter of (u_share*u_max)**2
  signal share_moved    : signed(STEP_W downto 0);
  signal gain_moved     : signed(STEP_W downto 0);
  signal least          : unsigned(SHARE_W - 1 downto 0);
  signal next_d, next_q : word_t;

  -- a < b, as the borrow of a subtraction
  function less (a : unsigned; b : unsigned) return std_logic is
    constant WIDTH   : positive := maximum(a'length, b'length) + 1;
    constant DIFFERS : unsigned(WIDTH - 1 downto 0) := resize(a, WIDTH) - resize(b, WIDTH);
  begin
    return DIFFERS(WIDTH - 1);
  end function;

  -- One step of the division: bit of the quotient, and the new rest below it.
  function divided (remainder : size_t; by : size_t) return unsigned is
    constant TRIAL : unsigned(PU_W + 1 downto 0) := ('0' & remainder & '0') - ("00" & by);
  begin
    if TRIAL(PU_W + 1) = '1' then
      return '0' & remainder(PU_W - 2 downto 0) & '0';
    end if;
    return '1' & TRIAL(PU_W - 1 downto 0);
  end function;
begin
  valid(0) <= in_valid;
  gain     <= signed('0' & state.torque_gain(GAIN_W - 1 downto GAIN_W - PU_W + 1));

  divided_1 <= divided(rest, divisor);
  divided_2 <= divided(divided_1(PU_W - 1 downto 0), divisor);

  ratio     <= (others => '1') when whole = '1' else quotient;
  row_at    <= shift_left(resize(ratio, 22), 6) - ratio;  -- ratio*(ROWS - 1)
  column_at <= shift_left(resize(ratio, 21), 5) - shift_left(resize(ratio, 21), 1);  -- ratio*(COLUMNS - 1)
  least     <= shift_left(resize(share_min, SHARE_W), SHARE_W - 16);
  reading   <= or valid(14 to 33);

  -- The table: two block RAMs, written by software, read word by word
  process (clk)
  begin
    if rising_edge(clk) then
      if table_word(30 downto 29) = "10" then
        ram_d(to_integer(table_word(28 downto 18))) <= signed(table_word(PU_W - 1 downto 0));
      end if;
      if table_word(30 downto 29) = "11" then
        ram_q(to_integer(table_word(28 downto 18))) <= signed(table_word(PU_W - 1 downto 0));
      end if;
      if reading = '1' then
        word_d <= ram_d(to_integer(address));
        word_q <= ram_q(to_integer(address));
      end if;
    end if;
  end process;

  process (clk)
    variable reach : signed(PU_W - 1 downto 0);
    variable limit : signed(KI_W + PU_W downto 0);
    variable change : wide_t;
    variable error : signed(PU_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      p_a <= x_a * y_a;
      p_b <= x_b * y_b;

      -- Stage 1: torque_now;  share*u_max;  stage 2: torque_gain*|torque_now|
      change := resize(torque_ref, PU_W + 1) - state.torque_now;
      if valid(0) = '1' then
        x_a   <= resize(signed('0' & state.share(SHARE_W - 1 downto SHARE_W - 16)), x_a'length);
        y_a   <= signed(resize(u_max, PU_W));
        speed <= resize(magnitude(omega_me), PU_W);

        state.torque_now <= resize(state.torque_now + within(change, unsigned(torque_step), 0), PU_W);
        if run = '0' then
          state.torque_now <= (others => '0');
        end if;
      end if;
      if valid(1) = '1' then
        x_b <= abs(resize(state.torque_now, x_b'length));
        y_b <= gain;
      end if;
      if valid(3) = '1' then
        asked <= unsigned(p_b(16 + PU_W - 1 downto 16));
      end if;

      -- Stage 3: share*u_max*k_flux
      reach := resize(shift_right(p_a, 32 - TORQUE_REFERENCE_REACH_BITS), PU_W);
      if valid(2) = '1' then
        x_a  <= signed('0' & k_flux);
        y_a  <= reach;
        fast <= not less(speed, unsigned(omega_learn));
      end if;

      -- Stage 5: the flux limit's dividend and divisor;  stages 6 to 13: division
      limit := shift_right(p_a, TORQUE_REFERENCE_DROP_REACH);
      if valid(4) = '1' then
        whole    <= not less(unsigned(limit(KI_W downto 0)), speed);
        rest     <= unsigned(limit(PU_W - 1 downto 0));
        divisor  <= speed;
        dividing <= '1';
      end if;
      if dividing = '1' then
        rest     <= divided_2(PU_W - 1 downto 0);
        quotient <= quotient(13 downto 0) & divided_1(PU_W) & divided_2(PU_W);
      end if;
      if valid(12) = '1' or valid(27) = '1' then
        dividing <= '0';
      end if;

      -- Stage 14: the row and the part of the way to the next;  stages 15, 16: TOP of both
      if valid(13) = '1' then
        row     <= row_at(21 downto 16);
        down    <= row_at(15 downto 16 - down'length);
        address <= row_at(21 downto 16) & "11111";
      end if;
      if valid(14) = '1' then
        address <= (row + 1) & "11111";
      end if;
      if valid(15) = '1' or valid(30) = '1' or valid(32) = '1' then
        first_d <= word_d;
        first_q <= word_q;
      end if;

      -- Stages 17 to 19: top, between both
      if valid(16) = '1' then
        x_a <= resize(wide_t(resize(word_d, PU_W + 1) - first_d), x_a'length);
        y_a <= signed(resize(down, PU_W));
      end if;
      if valid(18) = '1' then
        top <= (others => '0');
        if between(first_d, p_a) >= 0 then
          top <= between(first_d, p_a);
        end if;
      end if;

      -- Stage 20: dividend and divisor of t;  stages 21 to 28: division
      if valid(19) = '1' then
        whole    <= not less(asked, unsigned(top));
        rest     <= asked;
        divisor  <= unsigned(top);
        dividing <= '1';
      end if;

      -- Stages 21 to 23: torque_max = (2 - torque_gain)*top;  (u_share*u_max)
      if valid(20) = '1' then
        x_a <= resize(top, x_a'length);
        y_a <= signed(unsigned'("100000000000000000") - unsigned(gain));
        x_b <= signed(resize(u_share, x_b'length));
        y_b <= signed(resize(u_max, PU_W));
      end if;
      if valid(22) = '1' then
        most <= saturate(shift_right(p_a, 16), PU_W);
        x_b  <= resize(shift_right(p_b, 16), x_b'length);
        y_b  <= resize(shift_right(p_b, 16), PU_W);
      end if;

      -- Stages 24 to 28: left = (u_share*u_max)**2 - u_d**2 - u_q**2;  pull = (torque_now - torque)*torque_now
      error := saturate(resize(state.torque_now, PU_W + 1) - torque, PU_W);
      if valid(23) = '1' then
        x_b <= resize(u_d, x_b'length);
        y_b <= u_d;
      end if;
      if valid(24) = '1' then
        sum   <= resize(p_b, sum'length);
        spare <= resize(shift_right(p_b, TORQUE_REFERENCE_DROP_E + 2), PU_W);
        x_b   <= resize(u_q, x_b'length);
        y_b   <= u_q;
      end if;
      if valid(25) = '1' then
        sum <= resize(sum - p_b, sum'length);
        x_b <= resize(error, x_b'length);
        y_b <= state.torque_now;
      end if;
      if valid(26) = '1' then
        sum <= resize(sum - p_b, sum'length);
      end if;
      if valid(27) = '1' then
        left <= saturate(shift_right(sum, TORQUE_REFERENCE_DROP_E), PU_W);
        pull <= saturate(shift_right(p_b, 16), PU_W);
      end if;
      if valid(28) = '1' then
        calm <= not left(PU_W - 1) and not less(unsigned(left), unsigned(spare));
      end if;

      -- Stages 29 to 32: share and torque_gain of the next sample;  stage 29: the column of t
      if valid(28) = '1' then
        x_a     <= signed('0' & k_torque);
        y_a     <= pull;
        x_b     <= signed('0' & k_voltage);
        y_b     <= left;
        along   <= column_at(15 downto 16 - along'length);
        column  <= column_at(20 downto 16);
        address <= row & column_at(20 downto 16);
      end if;
      if valid(30) = '1' then
        gain_moved  <= resize(signed('0' & state.torque_gain), STEP_W + 1) + round_half_up(p_a, DROP);
        share_moved <= resize(signed('0' & state.share), STEP_W + 1) + round_half_up(p_b, DROP);
      end if;
      if valid(31) = '1' then
        state.share <= unsigned(share_moved(SHARE_W - 1 downto 0));
        if share_moved(STEP_W) = '1' or less(unsigned(share_moved(STEP_W - 1 downto 0)), least) = '1' then
          state.share <= least;
        elsif share_moved(STEP_W - 1 downto SHARE_W) /= 0 then
          state.share <= FULL;
        end if;
        if run = '0' then
          state.share <= FULL;
        elsif whole = '0' and fast = '1' and calm = '1' then
          state.torque_gain <= unsigned(gain_moved(GAIN_W - 1 downto 0));
          if gain_moved(STEP_W) = '1' or gain_moved(STEP_W - 1 downto GAIN_W - 2) = 0 then
            state.torque_gain <= GAIN_MIN;
          elsif gain_moved(STEP_W - 1 downto GAIN_W) /= 0 or gain_moved(GAIN_W - 1 downto GAIN_W - 2) = "11" then
            state.torque_gain <= GAIN_MAX;
          end if;
        end if;
      end if;

      -- Stages 30 to 33: the four words around the point;  stages 32 to 36: between two columns, in both rows
      if valid(29) = '1' then
        address <= row & (column + 1);
      end if;
      if valid(30) = '1' then
        address <= (row + 1) & column;
      end if;
      if valid(31) = '1' then
        address <= (row + 1) & (column + 1);
      end if;
      if valid(31) = '1' or valid(33) = '1' then
        base_d <= first_d;
        base_q <= first_q;
        x_a    <= resize(wide_t(resize(word_d, PU_W + 1) - first_d), x_a'length);
        x_b    <= resize(wide_t(resize(word_q, PU_W + 1) - first_q), x_b'length);
        y_a    <= signed(resize(along, PU_W));
        y_b    <= signed(resize(along, PU_W));
      end if;
      if valid(33) = '1' then
        low_d <= between(base_d, p_a);
        low_q <= between(base_q, p_b);
      end if;
      if valid(35) = '1' then
        high_d <= between(base_d, p_a);
        high_q <= between(base_q, p_b);
      end if;

      -- Stages 37 to 39: between the rows;  stage 40: the sign of i_q;  stage 42: all outputs
      if valid(36) = '1' then
        x_a <= resize(wide_t(resize(high_d, PU_W + 1) - low_d), x_a'length);
        x_b <= resize(wide_t(resize(high_q, PU_W + 1) - low_q), x_b'length);
        y_a <= signed(resize(down, PU_W));
        y_b <= signed(resize(down, PU_W));
      end if;
      if valid(38) = '1' then
        next_d <= between(low_d, p_a);
        next_q <= between(low_q, p_b);
      end if;
      if valid(39) = '1' then
        if next_q < 0 then
          next_q <= (others => '0');
        elsif state.torque_now < 0 then
          next_q <= -next_q;
        end if;
      end if;
      if valid(LATENCY - 1) = '1' then
        i_d_table  <= next_d;
        i_q_table  <= next_q;
        torque_max <= most;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        dividing            <= '0';
        state.share         <= FULL;
        state.torque_gain   <= ONE;
        state.torque_now    <= (others => '0');
        i_d_table           <= (others => '0');
        i_q_table           <= (others => '0');
        torque_max          <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
