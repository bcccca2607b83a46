-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the bus of the inverter: a capacitor with what the legs take, a source with resistance, a brake resistor.
--   u += k_source*(u_source - u) - inv_c*charge - k_brake*u
--   rectifier: the source takes nothing back;  brake: the resistor is on;  inv_c = 0 or start: u = u_source
-- The three products go through one multiplier, one after the other.
-- Formats: u S(1,40), output and factor cut to S(1,22); charge S(8,16), inv_c U(-12,36), k_source and k_brake U(-6,30).
-- Latency: 8.  Interval: 8.
-- Rounding: products half up to 40 bits; u saturates at zero and below 2, the output is cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_bus is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    charge    : in  signed(MOTOR_CHARGE_W - 1 downto 0);
    u_source  : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    brake     : in  std_logic;
    start     : in  std_logic;
    inv_c     : in  unsigned(23 downto 0);
    k_source  : in  unsigned(23 downto 0);
    k_brake   : in  unsigned(23 downto 0);
    rectifier : in  std_logic;
    out_valid : out std_logic;
    u_dc      : out signed(MOTOR_VOLTAGE_W - 1 downto 0)
  );
end entity motor_bus;

architecture rtl of motor_bus is
  constant LATENCY : positive := MOTOR_BUS_LATENCY;
  constant DROP_U  : positive := MOTOR_BUS_DROP_U;
  constant U_W     : positive := MOTOR_VOLTAGE_W + DROP_U;
  constant SUM_W   : positive := U_W + 2;
  constant A_W     : positive := MOTOR_CHARGE_W;
  constant B_W     : positive := 25;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal u_0    : signed(MOTOR_VOLTAGE_W - 1 downto 0);
  signal fed_0  : signed(A_W - 1 downto 0);
  signal a_1    : signed(A_W - 1 downto 0);
  signal b_1    : signed(B_W - 1 downto 0);
  signal prod_2 : signed(A_W + B_W - 1 downto 0);
  signal prod_3 : signed(A_W + B_W - 1 downto 0);
  signal part_3 : signed(SUM_W - 1 downto 0);
  signal sum_6  : signed(SUM_W - 1 downto 0);
  signal u_7    : signed(U_W - 1 downto 0);  -- state
begin
  valid(0) <= in_valid;
  u_0      <= u_7(U_W - 1 downto DROP_U);
  fed_0    <= resize(u_source, A_W) - u_0;
  part_3   <= resize(round_half_up(prod_3, MOTOR_BUS_DROP), SUM_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1 to 3: k_source*(u_source - u), then inv_c*charge, then k_brake*u
      a_1 <= fed_0;
      b_1 <= signed('0' & k_source);
      if rectifier = '1' and fed_0(A_W - 1) = '1' then
        a_1 <= (others => '0');
      end if;
      if valid(1) = '1' then
        a_1 <= charge;
        b_1 <= signed('0' & inv_c);
      elsif valid(2) = '1' then
        a_1 <= resize(u_0, A_W);
        b_1 <= (others => '0');
        if brake = '1' then
          b_1 <= signed('0' & k_brake);
        end if;
      end if;
      prod_2 <= a_1 * b_1;
      prod_3 <= prod_2;

      -- Stages 4 to 6: their sum with u
      if valid(3) = '1' then
        sum_6 <= resize(u_7, SUM_W) + part_3;
      elsif valid(4) = '1' or valid(5) = '1' then
        sum_6 <= sum_6 - part_3;
      end if;

      -- Stage 7: u
      if valid(6) = '1' then
        u_7 <= saturate(sum_6, U_W);
        if sum_6(SUM_W - 1) = '1' then
          u_7 <= (others => '0');
        end if;
        if start = '1' or inv_c = 0 then
          u_7 <= shift_left(resize(u_source, U_W), DROP_U);
        end if;
      end if;

      -- Stage 8
      if valid(7) = '1' then
        u_dc <= u_0;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        u_7                 <= (others => '0');
        u_dc                <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
