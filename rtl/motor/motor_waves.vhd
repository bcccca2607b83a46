-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: words of the tables on both sides of an angle: harmonic fluxes over the electrical, cogging over the
-- mechanical turn, each in two halves for even and odd addresses.
-- Formats: 1024 words a turn; the angle after the last one is the first.
-- Latency: 3.  Interval: 1; no strobes, no reset.
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity motor_waves is
  port (
    clk          : in  std_logic;
    theta_e      : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    theta_m      : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    table_write  : in  std_logic;
    table_select : in  unsigned(1 downto 0);
    table_at     : in  unsigned(11 downto 0);
    table_word   : in  unsigned(35 downto 0);
    wave_before  : out unsigned(35 downto 0);
    wave_after   : out unsigned(35 downto 0);
    cog_before   : out unsigned(17 downto 0);
    cog_after    : out unsigned(17 downto 0)
  );
end entity motor_waves;

architecture rtl of motor_waves is
  type waves_t is array (0 to 1) of unsigned(35 downto 0);
  type cogs_t is array (0 to 1) of unsigned(17 downto 0);

  signal at_e    : unsigned(9 downto 0);
  signal at_m    : unsigned(9 downto 0);
  signal waves_2 : waves_t;
  signal cogs_2  : cogs_t;
  signal odd_e_1 : std_logic;
  signal odd_m_1 : std_logic;
  signal odd_e_2 : std_logic;
  signal odd_m_2 : std_logic;
begin
  at_e <= theta_e(MOTOR_ANGLE_W - 1 downto MOTOR_ANGLE_F_BITS);
  at_m <= theta_m(MOTOR_ANGLE_W - 1 downto MOTOR_ANGLE_F_BITS);

  halves : for k in 0 to 1 generate
    constant ODD     : std_logic := to_unsigned(k, 1)(0);
    signal   next_e  : unsigned(9 downto 0);
    signal   next_m  : unsigned(9 downto 0);
    signal   mine    : std_logic;
    signal   write_e : std_logic;
    signal   write_m : std_logic;
  begin
    next_e  <= at_e + 1 when ODD = '0' else at_e;
    next_m  <= at_m + 1 when ODD = '0' else at_m;
    mine    <= table_write and (table_at(0) xnor ODD);
    write_e <= mine when table_select = 1 else '0';
    write_m <= mine when table_select = 2 else '0';

    waves : entity work.motor_table
      generic map (ADDRESS_BITS => 9, WIDTH => 36)
      port map (
        clk => clk, write => write_e, write_at => table_at(9 downto 1), write_word => table_word,
        read_at => next_e(9 downto 1), word => waves_2(k)
      );

    cogging : entity work.motor_table
      generic map (ADDRESS_BITS => 9, WIDTH => 18)
      port map (
        clk => clk, write => write_m, write_at => table_at(9 downto 1), write_word => table_word(17 downto 0),
        read_at => next_m(9 downto 1), word => cogs_2(k)
      );

  end generate halves;

  process (clk)
  begin
    if rising_edge(clk) then
      odd_e_1 <= at_e(0);
      odd_e_2 <= odd_e_1;
      odd_m_1 <= at_m(0);
      odd_m_2 <= odd_m_1;

      -- Stage 3: before and after the angle
      wave_before <= waves_2(1) when odd_e_2 = '1' else waves_2(0);
      wave_after  <= waves_2(0) when odd_e_2 = '1' else waves_2(1);
      cog_before  <= cogs_2(1) when odd_m_2 = '1' else cogs_2(0);
      cog_after   <= cogs_2(0) when odd_m_2 = '1' else cogs_2(1);
    end if;
  end process;

end architecture rtl;
