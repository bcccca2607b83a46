-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the pins of an incremental encoder and of three Hall sensors at an angle.
--   count = counts*theta_m: A, B are its Gray code, Z is the count 0;  sector = 6*(theta_e - hall_offset)
-- Formats: angles U(0,25) turns, counts U(16,0); products exact.
-- Latency: 3.  Interval: 1.
-- Rounding: count and sector are cut; angles wrap.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity motor_encoder is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    theta_m     : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    theta_e     : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    counts      : in  unsigned(15 downto 0);
    hall_offset : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    out_valid   : out std_logic;
    pin_a       : out std_logic;
    pin_b       : out std_logic;
    pin_z       : out std_logic;
    hall_a      : out std_logic;
    hall_b      : out std_logic;
    hall_c      : out std_logic
  );
end entity motor_encoder;

architecture rtl of motor_encoder is
  constant LATENCY : positive := MOTOR_ENCODER_LATENCY;

  type halls_t is array (0 to 7) of unsigned(2 downto 0);
  -- c, b, a of the sectors; 6 and 7 do not occur
  constant HALLS : halls_t := ("101", "001", "011", "010", "110", "100", "000", "000");

  signal valid     : std_logic_vector(0 to LATENCY);
  signal theta_1   : unsigned(MOTOR_ANGLE_W - 1 downto 0);
  signal counts_1  : unsigned(15 downto 0);
  signal from_1    : unsigned(MOTOR_ANGLE_W - 1 downto 0);
  signal product_2 : unsigned(MOTOR_ANGLE_W + 15 downto 0);
  signal sector_2  : unsigned(MOTOR_ANGLE_W + 2 downto 0);
  signal count_2   : unsigned(15 downto 0);
begin
  valid(0) <= in_valid;
  count_2  <= product_2(MOTOR_ANGLE_W + 15 downto MOTOR_ANGLE_W);

  process (clk)
    variable hall : unsigned(2 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: operands
      theta_1  <= theta_m;
      counts_1 <= counts;
      from_1   <= theta_e - hall_offset;

      -- Stage 2: counts*theta_m;  6 = 4 + 2 times the angle
      product_2 <= theta_1 * counts_1;
      sector_2  <= shift_left(resize(from_1, MOTOR_ANGLE_W + 3), 2) + shift_left(resize(from_1, MOTOR_ANGLE_W + 3), 1);

      -- Stage 3: the pins
      if valid(2) = '1' then
        pin_a  <= count_2(1) xor count_2(0);
        pin_b  <= count_2(1);
        pin_z  <= nor count_2;
        hall   := HALLS(to_integer(sector_2(MOTOR_ANGLE_W + 2 downto MOTOR_ANGLE_W)));
        hall_a <= hall(0);
        hall_b <= hall(1);
        hall_c <= hall(2);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
