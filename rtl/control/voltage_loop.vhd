-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the slow voltage loop of field weakening: it lowers the flux limit where the voltage exceeds its target.
--   left   = (u_share*u_max)**2 - u_d**2 - u_q**2
--   share += k_voltage*left    within share_min..1;  1 with run = 0
--   calm   = left >= 1/4*(u_share*u_max)**2
-- One multiplier makes all products.
-- Formats: share U(0,28), of which U(0,16) is shown; left exact, then PU.
-- Latency: 13.  Interval: 13.  Rounding: left floored and saturated, the increment half up.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity voltage_loop is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    u_max     : in  unsigned(U_MAX_W - 1 downto 0);
    run       : in  std_logic;
    u_d       : in  signed(PU_W - 1 downto 0);
    u_q       : in  signed(PU_W - 1 downto 0);
    u_share   : in  unsigned(15 downto 0);
    k_voltage : in  unsigned(KI_W - 1 downto 0);
    share_min : in  unsigned(15 downto 0);
    out_valid : out std_logic;
    share     : out unsigned(15 downto 0);
    calm      : out std_logic
  );
end entity voltage_loop;

architecture rtl of voltage_loop is
  constant LATENCY : positive := VOLTAGE_LOOP_LATENCY;
  constant SHARE_W : positive := 28;
  constant DROP    : positive := VOLTAGE_LOOP_DROP_STEP;
  constant MOVED_W : positive := KI_W + 2 + PU_W - DROP;

  constant FULL : unsigned(SHARE_W - 1 downto 0) := (others => '1');

  type state_t is record
    share : unsigned(SHARE_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid : std_logic_vector(0 to LATENCY);
  signal z     : signed(PU_W - 1 downto 0);  -- what is squared
  signal x     : signed(KI_W downto 0);
  signal y     : signed(PU_W - 1 downto 0);
  signal p     : signed(KI_W + PU_W downto 0);
  signal spare : signed(PU_W - 1 downto 0);  -- a quarter of (u_share*u_max)**2
  signal used  : signed(36 downto 0);  -- u_d**2 + u_q**2 - (u_share*u_max)**2 - 1, the complement of what is left
  signal left  : signed(PU_W - 1 downto 0);
  signal moved : signed(MOVED_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
    variable difference : signed(PU_W downto 0);
    variable low        : signed(MOVED_W - SHARE_W + 16 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      p <= x * y;

      -- Stages 1, 2: u_share*u_max;  stages 3 to 5, 4 to 6, 5 to 7: the squares of it, of u_d, of u_q
      if valid(2) = '1' then
        z <= resize(shift_right(p, 16), PU_W);
      elsif valid(3) = '1' then
        z <= u_d;
      else
        z <= u_q;
      end if;
      if valid(0) = '1' then
        x <= signed(resize(u_share, x'length));
        y <= signed(resize(u_max, PU_W));
      elsif valid(9) = '1' then
        x <= signed('0' & k_voltage);
        y <= left;
      else
        x <= resize(z, x'length);
        y <= z;
      end if;

      -- Stages 6 to 8: used, a sum of products;  stage 9: left = not used, narrowed
      if (valid(6) or valid(7)) = '1' then
        used <= resize(used + p, used'length);
      end if;
      if valid(5) = '1' then
        used  <= resize(not p, used'length);
        spare <= resize(shift_right(p, VOLTAGE_LOOP_DROP_E + 2), PU_W);
      end if;
      if valid(8) = '1' then
        left <= saturate(shift_right(not used, VOLTAGE_LOOP_DROP_E), PU_W);
      end if;

      -- Stage 10: calm = left >= spare;  stages 10, 11: k_voltage*left;  stage 12: moved = share + k_voltage*left
      difference := resize(left, PU_W + 1) - spare;
      if valid(9) = '1' then
        calm <= not difference(PU_W);
      end if;
      moved <= plus_rounded(resize(signed('0' & state.share), MOVED_W), p, DROP);

      -- Stage 13: share, limited
      low := resize(moved(MOVED_W - 1 downto SHARE_W - 16), low'length) - signed('0' & share_min);
      if valid(12) = '1' then
        state.share <= unsigned(moved(SHARE_W - 1 downto 0));
        if run = '0' then
          state.share <= FULL;
        elsif low(low'high) = '1' then
          state.share <= shift_left(resize(share_min, SHARE_W), SHARE_W - 16);
        elsif moved(MOVED_W - 1 downto SHARE_W) /= 0 then
          state.share <= FULL;
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.share         <= FULL;
      end if;
    end if;
  end process;

  share     <= state.share(SHARE_W - 1 downto SHARE_W - 16);
  out_valid <= valid(LATENCY);

end architecture rtl;
