-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the flux linkage that bus voltage and speed allow, as a part of that of the torque table's last row.
--   flux_part = share*u_max*k_flux/|omega_me|;  1 from the last row's flux linkage on
-- One multiplier makes both products.
-- Formats: share U(0,16); share*u_max U(0,17), its product with k_flux as PU; flux_part U(0,16).
-- Latency: 13.  Interval: 13.  Rounding: all floored.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_limit is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    omega_me  : in  signed(PU_W - 1 downto 0);
    u_max     : in  unsigned(U_MAX_W - 1 downto 0);
    share     : in  unsigned(15 downto 0);
    k_flux    : in  unsigned(KP_W - 1 downto 0);
    out_valid : out std_logic;
    flux_part : out unsigned(15 downto 0)
  );
end entity flux_limit;

architecture rtl of flux_limit is
  constant DIVIDEND_W : positive := FLUX_LIMIT_DIVIDEND_W;

  signal valid    : std_logic_vector(0 to 4);
  signal x        : unsigned(KP_W - 1 downto 0);
  signal y        : unsigned(FLUX_LIMIT_REACH_BITS - 1 downto 0);
  signal p        : unsigned(KP_W + FLUX_LIMIT_REACH_BITS - 1 downto 0);
  signal dividend : unsigned(DIVIDEND_W - 1 downto 0);
  signal speed    : unsigned(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to 4) <= valid(0 to 3);

      -- Stages 1, 2: share*u_max;  speed = |omega_me|;  stages 3, 4: share*u_max*k_flux
      p <= x * y;
      if valid(0) = '1' then
        x     <= resize(share, KP_W);
        y     <= resize(u_max, y'length);
        speed <= resize(magnitude(omega_me), PU_W);
      end if;
      if valid(2) = '1' then
        x <= k_flux;
        y <= resize(shift_right(p, 32 - FLUX_LIMIT_REACH_BITS), y'length);
      end if;

      if rst = '1' then
        valid(1 to 4) <= (others => '0');
      end if;
    end if;
  end process;

  dividend <= resize(shift_right(p, FLUX_LIMIT_DROP_REACH), DIVIDEND_W);

  -- Stages 5 to 13: flux_part = share*u_max*k_flux/speed
  part : entity work.ratio
    generic map (DIVIDEND_W => DIVIDEND_W)
    port map (clk => clk, rst => rst, in_valid => valid(4),
              dividend => dividend, divisor => speed,
              out_valid => out_valid, ratio => flux_part, full => open);

end architecture rtl;
