-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: adds decoupling and dead-time compensation, keeps the voltage in the circle of radius u_max, d axis first.
--   limit = min(u_max, room),  u_d = limit(u_pi_d + u_dec_d + u_comp_d, +-limit)
--   u_q = limit(u_pi_q + u_dec_q + u_comp_q, +-sqrt(u_max**2 - u_d**2))
--   room = sqrt(u_max**2 - min(|u_dec_q|, u_max)**2), for the next sample;  u_max where lambda_d < 0 and sat_d = 1
--   sat = -1, 0, +1: the active limit of the axis
-- Room: the d axis has priority, but only within the voltage that remains beside the EMF of the last sample, so that
-- the q axis can always balance its EMF.  Without it the drive has a second stable point at high speed; with it where
-- lambda_d < 0 and u_d at its upper end i_d would run away, see the model.
-- Formats: sums exact; radicands (u_max - u)*(u_max + u) exact, U(0,32); PU out.
-- Latency: 10; u_d is valid with out_soon.  Interval: 11 (room is ready one clock after the output).
-- The q axis' inputs are needed a clock after the d axis'.
-- Both roots use one multiplier and one table: that of u_d, a clock later that of the EMF.
-- Rounding: that of the root only, which is never above the true one: the circle is never left.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity voltage_limit is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    u_pi_d    : in  signed(PU_W - 1 downto 0);
    u_pi_q    : in  signed(PU_W - 1 downto 0);
    u_dec_d   : in  signed(PU_W - 1 downto 0);
    u_dec_q   : in  signed(PU_W - 1 downto 0);
    u_comp_d  : in  signed(PU_W - 1 downto 0);
    u_comp_q  : in  signed(PU_W - 1 downto 0);
    u_max     : in  unsigned(U_MAX_W - 1 downto 0);
    lambda_d  : in  signed(PU_W - 1 downto 0);
    out_soon  : out std_logic;
    out_valid : out std_logic;
    u_d       : out signed(PU_W - 1 downto 0);
    u_q       : out signed(PU_W - 1 downto 0);
    sat_d     : out signed(1 downto 0);
    sat_q     : out signed(1 downto 0)
  );
end entity voltage_limit;

architecture rtl of voltage_limit is
  constant LATENCY : positive := VOLTAGE_LIMIT_LATENCY;
  constant SUM_W   : positive := PU_W + 2;

  type state_t is record
    room : unsigned(U_MAX_W - 1 downto 0);  -- largest u_d that leaves enough voltage for the EMF
  end record state_t;

  signal state : state_t;

  signal valid      : std_logic_vector(0 to LATENCY);
  signal sum_d_1    : signed(SUM_W - 1 downto 0);
  signal limit_1    : unsigned(U_MAX_W - 1 downto 0);
  signal sum_q_2    : signed(SUM_W - 1 downto 0);
  signal size_2     : unsigned(PU_W - 1 downto 0);
  signal emf_3      : unsigned(U_MAX_W - 1 downto 0);
  signal part       : signed(PU_W - 1 downto 0);  -- u_d, then the EMF
  signal lo_3       : unsigned(PU_W - 2 downto 0);  -- within 0 and 2, as |part| <= u_max
  signal hi_3       : unsigned(PU_W - 2 downto 0);
  signal radicand_4 : unsigned(31 downto 0);
  signal root_start : std_logic;
  signal root_9     : unsigned(U_MAX_W - 1 downto 0);  -- the limit of u_q, then the room

  -- The active limit: -1, 0, +1.
  function side (v : signed; limit : unsigned) return signed is
    variable result : signed(1 downto 0) := "00";
  begin
    if beyond(v, limit, 0) = '1' then
      result := v(v'high) & '1';
    end if;
    return result;
  end function;
begin
  valid(0) <= in_valid;

  -- Stages 5 to 9, 6 to 10: the roots
  root_start <= valid(4) or valid(5);

  root : entity work.sqrt
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => root_start,
      x         => radicand_4,
      out_valid => open,
      root      => root_9
    );

  part <= signed(resize(emf_3, PU_W)) when valid(3) = '1' else u_d;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: sum_d = u_pi_d + u_dec_d + u_comp_d;  limit = min(u_max, room)
      sum_d_1 <= resize(u_pi_d, SUM_W) + u_dec_d + u_comp_d;
      limit_1 <= minimum(u_max, state.room);

      -- Stage 2: u_d = sum_d, limited;  sum_q = u_pi_q + u_dec_q + u_comp_q;  stages 2, 3: emf = min(|u_dec_q|, u_max)
      if valid(1) = '1' then
        u_d   <= resize(within(sum_d_1, limit_1, 0), PU_W);
        sat_d <= side(sum_d_1, limit_1);
      end if;
      sum_q_2 <= resize(u_pi_q, SUM_W) + u_dec_q + u_comp_q;
      size_2  <= magnitude(u_dec_q);
      emf_3   <= resize(minimum(size_2, resize(u_max, PU_W)), U_MAX_W);
      if lambda_d < 0 and sat_d = 1 then
        emf_3 <= (others => '0');
      end if;

      -- Stages 3, 4: lo = u_max - part;  hi = u_max + part
      lo_3 <= resize(unsigned(difference(signed(resize(u_max, PU_W)), part)), PU_W - 1);
      hi_3 <= resize(unsigned(signed(resize(u_max, PU_W)) + part), PU_W - 1);

      -- Stages 4, 5: radicand = lo*hi = u_max**2 - part**2, below one
      radicand_4 <= resize(lo_3 * hi_3, 32);

      -- Stage 10: u_q = sum_q, limited to the root of u_d
      if valid(LATENCY - 1) = '1' then
        u_q   <= resize(within(sum_q_2, root_9, 0), PU_W);
        sat_q <= side(sum_q_2, root_9);
      end if;

      -- Stage 11: room = the root of the EMF
      if valid(LATENCY) = '1' then
        state.room <= root_9;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.room          <= (others => '1');
        sat_d               <= (others => '0');
        sat_q               <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
