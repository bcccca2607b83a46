-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the voltage that each leg of the inverter has in each state of its gates.
--   x = stiffness*i;  v_high = u_dc - clamp(x, -v_diode, v_switch);  v_low = -clamp(x, -v_switch, v_diode)
--   v_off = clamp(u_dc/2 - x, -v_diode, u_dc + v_diode)
-- Legs a, b, c one after the other through one multiplier and one set of limits.
-- Formats: u_dc, results S(1,22), drops U(0,22), stiffness U(9,8), i PU; x S(3,22).
-- Latency: 9.  Interval: 8.
-- Rounding: x half up, u_dc/2 floored.  Overflow: saturation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_legs is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_a       : in  signed(PU_W - 1 downto 0);
    i_b       : in  signed(PU_W - 1 downto 0);
    i_c       : in  signed(PU_W - 1 downto 0);
    u_dc      : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    stiffness : in  unsigned(16 downto 0);
    v_switch  : in  unsigned(21 downto 0);
    v_diode   : in  unsigned(21 downto 0);
    out_valid : out std_logic;
    high_a    : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    low_a     : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    off_a     : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    high_b    : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    low_b     : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    off_b     : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    high_c    : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    low_c     : out signed(MOTOR_VOLTAGE_W - 1 downto 0);
    off_c     : out signed(MOTOR_VOLTAGE_W - 1 downto 0)
  );
end entity motor_legs;

architecture rtl of motor_legs is
  constant LATENCY : positive           := MOTOR_LEGS_LATENCY;
  constant V_W     : positive           := MOTOR_VOLTAGE_W;
  constant X_W     : positive           := 26;
  constant NOTHING : signed(0 downto 0) := "0";

  signal valid       : std_logic_vector(0 to LATENCY);
  signal by_i        : signed(17 downto 0);
  signal diode_v     : signed(22 downto 0);
  signal i_0         : signed(PU_W - 1 downto 0);
  signal x_3         : signed(X_W - 1 downto 0);
  signal x_4         : signed(X_W - 1 downto 0);
  signal free_4      : signed(X_W downto 0);
  signal minus_5     : std_logic;
  signal with_high_5 : unsigned(21 downto 0);
  signal with_low_5  : unsigned(21 downto 0);
  signal off_5       : signed(V_W downto 0);
  signal high_6      : signed(V_W - 1 downto 0);
  signal low_6       : signed(V_W - 1 downto 0);
  signal off_6       : signed(V_W - 1 downto 0);

  -- The smaller of a size and a drop
  function least (size : unsigned; drop : unsigned) return unsigned is
  begin
    if size > drop then
      return drop;
    end if;
    return resize(size, drop'length);
  end function;
begin
  valid(0) <= in_valid;
  by_i     <= signed('0' & stiffness);
  diode_v  <= signed('0' & v_diode);

  -- The leg that enters: a, then b, then c
  i_0 <= i_b when valid(1) = '1' else i_c when valid(2) = '1' else i_a;

  -- Stages 1 to 3: x = stiffness*i
  slope : entity work.multiply_add
    generic map (DROP => MOTOR_LEGS_DROP_X)
    port map (clk => clk, a => by_i, b => i_0, c => NOTHING, y => x_3, limited => open);

  process (clk)
    variable with_high : signed(V_W downto 0);
    variable sum       : signed(V_W + 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 4: x;  free = u_dc/2 - x, the voltage of a leg that is off
      x_4    <= x_3;
      free_4 <= shift_right(resize(u_dc, X_W + 1), 1) - x_3;

      -- Stage 5: the size of x within the drops of the devices;  the voltage of a leg that is off within the rails
      minus_5 <= x_4(x_4'high);
      if x_4(x_4'high) = '1' then
        with_high_5 <= least(magnitude(x_4), v_diode);
        with_low_5  <= least(magnitude(x_4), v_switch);
      else
        with_high_5 <= least(magnitude(x_4), v_switch);
        with_low_5  <= least(magnitude(x_4), v_diode);
      end if;
      off_5 <= resize(clamp(free_4, -diode_v, resize(u_dc, V_W + 1) + diode_v), V_W + 1);

      -- Stages 6 to 9: the leg's three voltages
      with_high := resize(signed('0' & with_high_5), V_W + 1);
      sum       := (resize(u_dc, V_W + 1) & '1') + ((with_high xor not minus_5) & not minus_5);
      high_6    <= saturate(sum(V_W + 1 downto 1), V_W);
      low_6     <= negated(resize(signed('0' & with_low_5), V_W), not minus_5);
      off_6     <= saturate(off_5, V_W);
      if valid(6) = '1' then
        high_a <= high_6;
        low_a  <= low_6;
        off_a  <= off_6;
      end if;
      if valid(7) = '1' then
        high_b <= high_6;
        low_b  <= low_6;
        off_b  <= off_6;
      end if;
      if valid(8) = '1' then
        high_c <= high_6;
        low_c  <= low_6;
        off_c  <= off_6;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
