-- Purpose: speed from two consecutive position codes, then a first-order filter.
--   raw(k)      = k_speed * wrap(code(k) - code(k-1))
--   omega_me(k) = omega_me(k-1) + k_filter*(raw(k) - omega_me(k-1))
-- Formats: difference S(-1,18) of a turn, k_speed U(12,12), k_filter U(1,16), state S(1,28), output PU.
-- Latency: 7.  Interval: 3 (the state is read at stage 4 and written at stage 6).
-- Rounding: half up; raw saturates at 2 per unit, the state moves between values in range.
-- The first sample after reset has no predecessor: its difference is zero.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    in_valid   : in  std_logic;
    code_theta : in  unsigned(POSITION_BITS - 1 downto 0);
    reverse    : in  std_logic;
    k_speed    : in  unsigned(23 downto 0);
    k_filter   : in  unsigned(16 downto 0);
    out_valid  : out std_logic;
    omega_me   : out signed(PU_W - 1 downto 0)
  );
end entity speed;

architecture rtl of speed is
  constant LATENCY : positive := SPEED_LATENCY;

  signal valid      : std_logic_vector(0 to LATENCY);
  signal mech_0     : unsigned(TURN_W - 1 downto 0);
  signal code_last  : unsigned(TURN_W - 1 downto 0);
  signal seen       : std_logic;
  signal omega      : signed(INTEGRAL_W - 1 downto 0);
  signal delta_1    : signed(TURN_W - 1 downto 0);
  signal prod_raw_2 : signed(TURN_W + 24 downto 0);
  signal raw_3      : signed(PU_W - 1 downto 0);
  signal err_4      : signed(PU_W downto 0);
  signal prod_err_5 : signed(PU_W + 18 downto 0);

  function aligned (code : unsigned; minus : std_logic) return unsigned is
    variable turn : unsigned(TURN_W - 1 downto 0);
  begin
    turn := shift_left(resize(code, TURN_W), TURN_W - code'length);
    if minus = '1' then
      turn := 0 - turn;
    end if;
    return turn;
  end function;
begin
  valid(0) <= in_valid;
  mech_0   <= aligned(code_theta, reverse);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: delta = code - last code, the shorter way round
      if valid(0) = '1' then
        delta_1   <= (others => '0');
        code_last <= mech_0;
        seen      <= '1';
        if seen = '1' then
          delta_1 <= signed(mech_0 - code_last);
        end if;
      end if;

      -- Stage 2: prod_raw = delta * k_speed
      if valid(1) = '1' then
        prod_raw_2 <= delta_1 * signed('0' & k_speed);
      end if;

      -- Stage 3: raw = prod_raw, narrowed
      if valid(2) = '1' then
        raw_3 <= round_sat(prod_raw_2, SPEED_DROP_RAW, PU_W);
      end if;

      -- Stage 4: err = raw - omega_me
      if valid(3) = '1' then
        err_4 <= resize(raw_3, PU_W + 1) - round_sat(omega, PU_TO_INTEGRAL, PU_W);
      end if;

      -- Stage 5: prod_err = err * k_filter
      if valid(4) = '1' then
        prod_err_5 <= err_4 * signed('0' & k_filter);
      end if;

      -- Stage 6: omega = omega + prod_err
      if valid(5) = '1' then
        omega <= saturate(omega + round_half_up(prod_err_5, SPEED_DROP_STATE), INTEGRAL_W);
      end if;

      -- Stage 7: omega_me = omega, narrowed
      if valid(6) = '1' then
        omega_me <= round_sat(omega, PU_TO_INTEGRAL, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        seen                <= '0';
        omega               <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
