-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the voltage at the motor's terminals: the commanded voltage minus the loss of the legs.
--   u_clean = u_applied - v_leg*s(k-1)
-- s(k-1): the directions of the previous sample, whose voltage acts in the coming period.
-- One pipeline for both axes: alpha, then beta a clock later.
-- Formats: u FLUX, s PU, v_leg V_LEG; products exact.
-- Latency: 5 (alpha, then beta).  Interval: 5.
-- Rounding: half up, each product.  The difference saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity clean_voltage is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    u_applied_alpha : in  signed(FLUX_W - 1 downto 0);
    u_applied_beta  : in  signed(FLUX_W - 1 downto 0);
    s_alpha         : in  signed(PU_W - 1 downto 0);
    s_beta          : in  signed(PU_W - 1 downto 0);
    v_leg           : in  signed(V_LEG_W - 1 downto 0);
    out_valid       : out std_logic;
    u_clean_alpha   : out signed(FLUX_W - 1 downto 0);
    u_clean_beta    : out signed(FLUX_W - 1 downto 0)
  );
end entity clean_voltage;

architecture rtl of clean_voltage is
  constant LATENCY : positive := CLEAN_VOLTAGE_LATENCY;

  type state_t is record
    s_alpha : signed(PU_W - 1 downto 0);  -- of the previous sample
    s_beta  : signed(PU_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid       : std_logic_vector(0 to LATENCY);
  signal u_applied_0 : signed(FLUX_W - 1 downto 0);
  signal s_0         : signed(PU_W - 1 downto 0);
  signal u_clean_3   : signed(FLUX_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The axis that enters
  u_applied_0 <= u_applied_beta when valid(1) = '1' else u_applied_alpha;
  s_0         <= state.s_beta when valid(1) = '1' else state.s_alpha;

  -- Stages 1 to 3: u_clean = u_applied - v_leg*s(k-1)
  leg_loss : entity work.multiply_add
    generic map (DROP => CLEAN_VOLTAGE_DROP, MINUS => 1)
    port map (clk => clk, a => v_leg, b => s_0, c => u_applied_0, y => u_clean_3, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 4, 5: the voltages, and the state of the next sample
      if valid(3) = '1' then
        u_clean_alpha <= u_clean_3;
      end if;
      if valid(4) = '1' then
        u_clean_beta <= u_clean_3;
        state        <= (s_alpha => s_alpha, s_beta => s_beta);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (others => (others => '0'));
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
