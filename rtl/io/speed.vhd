-- Purpose: speed from two consecutive position codes, then a first-order filter.
--   raw(k)      = k_speed * wrap(code(k) - code(k-1))
--   omega_me(k) = omega_me(k-1) + k_filter*(raw(k) - omega_me(k-1))
-- Formats: difference S(-1,18) of a turn, k_speed U(12,12), k_filter U(1,16), state S(1,28), output PU.
-- Latency: 7.  Interval: 4 (the state is read from stage 4 on and written at stage 7).
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
  signal sum_raw_3  : signed(TURN_W + 24 downto 0);
  signal err_4      : signed(PU_W downto 0);
  signal prod_err_5 : signed(PU_W + 18 downto 0);
  signal sum_6      : signed(PU_W + 18 downto 0);
  signal omega_6    : signed(INTEGRAL_W - 1 downto 0);
  signal omega_pu   : signed(PU_W - 1 downto 0);

  -- -code is not code and a carry.
  function aligned (code : unsigned; minus : std_logic) return unsigned is
    constant TURN : unsigned(code'length - 1 downto 0) := (code xor (code'range => minus)) + unsigned'('0' & minus);
  begin
    return shift_left(resize(TURN, TURN_W), TURN_W - code'length);
  end function;
begin
  valid(0) <= in_valid;
  mech_0   <= aligned(code_theta, reverse);
  omega_6  <= saturate(shift_right(sum_6, SPEED_DROP_STATE), INTEGRAL_W);

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

      -- Stage 3: half an LSB of raw to round with
      if valid(2) = '1' then
        sum_raw_3 <= prod_raw_2 + half(SPEED_DROP_RAW, prod_raw_2'length);
      end if;

      -- Stage 4: err = raw - omega_me, raw narrowed
      if valid(3) = '1' then
        err_4 <= resize(saturate(shift_right(sum_raw_3, SPEED_DROP_RAW), PU_W), PU_W + 1) - omega_pu;
      end if;

      -- Stage 5: prod_err = err * k_filter
      if valid(4) = '1' then
        prod_err_5 <= err_4 * signed('0' & k_filter);
      end if;

      -- Stage 6: omega + prod_err, with half an LSB to round with
      if valid(5) = '1' then
        sum_6 <= prod_err_5 + (omega & half(SPEED_DROP_STATE, SPEED_DROP_STATE));
      end if;

      -- Stage 7: omega, omega_me = the sum, narrowed
      if valid(6) = '1' then
        omega    <= omega_6;
        omega_pu <= round_sat(shift_right(sum_6, SPEED_DROP_STATE), PU_TO_INTEGRAL, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        seen                <= '0';
        omega               <= (others => '0');
        omega_pu            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);
  omega_me  <= omega_pu;

end architecture rtl;
