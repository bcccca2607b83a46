-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: what the sensors of a drive say about the motor: codes of three currents, of the bus and of the angle.
--   code = limit(gain*value + offset + noise);  code_theta = theta_m + angle_offset
--   noise = (sum of the signed bytes of a random number)*amplitude; a xorshift of 32 bits draws one for each channel
-- Channels a, b, c and bus one after the other through one multiplier.
-- Formats: gain S(4,20), offset PU, amplitude U(-16,24); sums 16 fraction bits; codes of ADC_BITS, right-aligned.
-- Latency: 11.  Interval: 11.
-- Rounding: noise, product and code half up; codes are limited to their range, the angle is cut and wraps.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_sensors is
  generic (
    ADC_BITS      : positive range 12 to 16 := 12;
    POSITION_BITS : positive range 12 to 18 := 16
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    i_a          : in  signed(PU_W - 1 downto 0);
    i_b          : in  signed(PU_W - 1 downto 0);
    i_c          : in  signed(PU_W - 1 downto 0);
    u_dc         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    theta_m      : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    scale_a      : in  signed(24 downto 0);
    scale_b      : in  signed(24 downto 0);
    scale_c      : in  signed(24 downto 0);
    scale_u      : in  signed(24 downto 0);
    zero_a       : in  signed(PU_W - 1 downto 0);
    zero_b       : in  signed(PU_W - 1 downto 0);
    zero_c       : in  signed(PU_W - 1 downto 0);
    zero_u       : in  signed(PU_W - 1 downto 0);
    noise_i      : in  unsigned(7 downto 0);
    noise_u      : in  unsigned(7 downto 0);
    angle_offset : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    out_valid    : out std_logic;
    code_a       : out unsigned(ADC_BITS - 1 downto 0);
    code_b       : out unsigned(ADC_BITS - 1 downto 0);
    code_c       : out unsigned(ADC_BITS - 1 downto 0);
    code_u_dc    : out unsigned(ADC_BITS - 1 downto 0);
    code_theta   : out unsigned(POSITION_BITS - 1 downto 0)
  );
end entity motor_sensors;

architecture rtl of motor_sensors is
  constant LATENCY : positive              := MOTOR_SENSORS_LATENCY;
  constant Y_W     : positive              := 22;
  constant DROP    : positive              := PU_W - 1 - ADC_BITS;
  constant SEED    : unsigned(31 downto 0) := to_unsigned(MOTOR_SENSORS_SEED, 32);
  constant TOP     : signed(Y_W downto 0)  := to_signed(2 ** ADC_BITS - 1, Y_W + 1);

  signal valid   : std_logic_vector(0 to LATENCY);
  signal random  : unsigned(31 downto 0);  -- state
  signal bell_2  : signed(9 downto 0);
  signal amp_2   : signed(8 downto 0);
  signal noise_3 : signed(18 downto 0);
  signal zero_3  : signed(PU_W - 1 downto 0);
  signal base_4  : signed(PU_W + 1 downto 0);
  signal gain_4  : signed(24 downto 0);
  signal value_4 : signed(PU_W - 1 downto 0);
  signal y_7     : signed(Y_W - 1 downto 0);
  signal bias_7  : signed(PU_W downto 0);
  signal code_7  : unsigned(ADC_BITS - 1 downto 0);
  signal theta_0 : unsigned(MOTOR_ANGLE_W - 1 downto 0);

  function drawn (x : unsigned(31 downto 0)) return unsigned is
    variable y : unsigned(31 downto 0) := x;
  begin
    y := y xor shift_left(y, 13);
    y := y xor shift_right(y, 17);
    return y xor shift_left(y, 5);
  end function;
begin
  valid(0) <= in_valid;
  theta_0  <= theta_m + angle_offset;

  -- The channel that enters each stage: a, b, c, bus
  amp_2   <= signed('0' & noise_u) when valid(5) = '1' else signed('0' & noise_i);
  zero_3  <= zero_b when valid(4) = '1' else zero_c when valid(5) = '1' else zero_u when valid(6) = '1' else zero_a;
  gain_4  <= scale_b when valid(5) = '1' else scale_c when valid(6) = '1' else
             scale_u when valid(7) = '1' else scale_a;
  value_4 <= i_b when valid(5) = '1' else i_c when valid(6) = '1' else
             u_dc(MOTOR_VOLTAGE_W - 1 downto MOTOR_SENSORS_DROP_BUS) when valid(7) = '1' else i_a;

  -- Stages 5 to 7: y = gain*value + offset + noise
  channel : entity work.multiply_add
    generic map (DROP => MOTOR_SENSORS_DROP_GAIN)
    port map (clk => clk, a => gain_4, b => value_4, c => base_4, y => y_7, limited => open);

  -- The code; a current's zero is in the middle
  bias_7 <= to_signed(0, PU_W + 1) when valid(10) = '1' else shift_left(to_signed(1, PU_W + 1), PU_W - 2);
  code_7 <= resize(unsigned(clamp(resize(round_half_up(resize(y_7, Y_W + 1) + bias_7, DROP), Y_W + 1),
                                  to_signed(0, Y_W + 1), TOP)), ADC_BITS);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: a random number for each channel
      if (or valid(0 to 3)) = '1' then
        random <= drawn(random);
      end if;

      -- Stage 2: bell = sum of its bytes
      bell_2 <= resize(signed(random(7 downto 0)), 10) + signed(random(15 downto 8))
                + signed(random(23 downto 16)) + signed(random(31 downto 24));

      -- Stage 3: noise = bell*amplitude
      noise_3 <= bell_2 * amp_2;

      -- Stage 4: base = offset + noise
      base_4 <= resize(zero_3, PU_W + 2) + round_half_up(noise_3, MOTOR_SENSORS_DROP_NOISE);

      -- Stages 8 to 11: the codes, one after the other
      if valid(7) = '1' then
        code_a     <= code_7;
        code_theta <= theta_0(MOTOR_ANGLE_W - 1 downto MOTOR_ANGLE_W - POSITION_BITS);
      end if;
      if valid(8) = '1' then
        code_b <= code_7;
      end if;
      if valid(9) = '1' then
        code_c <= code_7;
      end if;
      if valid(10) = '1' then
        code_u_dc <= code_7;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        random              <= SEED;
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
