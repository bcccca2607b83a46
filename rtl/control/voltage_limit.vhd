-- Purpose: adds the decoupling and keeps the voltage inside the circle of radius u_max, d axis first.
--   u_d = limit(u_pi_d + u_dec_d, +-u_max)
--   u_q = limit(u_pi_q + u_dec_q, +-sqrt(u_max**2 - u_d**2))
--   sat = -1, 0, +1: the limit that holds the axis
-- The radicand is (u_max - u)*(u_max + u); a negative factor tells that d is at its limit, and on which side.
-- Formats: sums exact; radicand exact, U(0,32); PU out.
-- Latency: 10.  Rounding: none but the root's, which errs inwards: the circle is never left.

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
    u_max     : in  unsigned(U_MAX_W - 1 downto 0);
    out_valid : out std_logic;
    u_d       : out signed(PU_W - 1 downto 0);
    u_q       : out signed(PU_W - 1 downto 0);
    sat_d     : out signed(1 downto 0);
    sat_q     : out signed(1 downto 0)
  );
end entity voltage_limit;

architecture rtl of voltage_limit is
  constant LATENCY : positive := VOLTAGE_LIMIT_LATENCY;
  constant W       : positive := PU_W + 2;

  type wait_t is array (2 to LATENCY - 1) of signed(PU_W downto 0);
  type d_wait_t is array (3 to LATENCY - 1) of signed(PU_W - 1 downto 0);
  type sat_wait_t is array (3 to LATENCY - 1) of signed(1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal sum_d_1    : signed(PU_W downto 0);
  signal sum_q_1    : signed(PU_W downto 0);
  signal u_max_1    : signed(U_MAX_W downto 0);
  signal room_up_2  : signed(W - 1 downto 0);
  signal room_dn_2  : signed(W - 1 downto 0);
  signal sum_d_2    : signed(PU_W downto 0);
  signal u_max_2    : signed(U_MAX_W downto 0);
  signal radicand_3 : unsigned(31 downto 0);
  signal root_9     : unsigned(U_MAX_W - 1 downto 0);
  signal limit_9    : signed(PU_W downto 0);
  signal sum_q      : wait_t;
  signal d_wait     : d_wait_t;
  signal sat_wait   : sat_wait_t;
begin
  valid(0) <= in_valid;

  root : entity work.sqrt
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => valid(3),
      x         => radicand_3,
      out_valid => open,
      root      => root_9
    );

  limit_9 <= signed(resize(root_9, PU_W + 1));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: sum = u_pi + u_dec
      if valid(0) = '1' then
        sum_d_1 <= resize(u_pi_d, PU_W + 1) + resize(u_dec_d, PU_W + 1);
        sum_q_1 <= resize(u_pi_q, PU_W + 1) + resize(u_dec_q, PU_W + 1);
        u_max_1 <= signed('0' & u_max);
      end if;

      -- Stage 2: room to either limit = u_max -+ sum_d
      if valid(1) = '1' then
        room_up_2 <= resize(u_max_1, W) - sum_d_1;
        room_dn_2 <= resize(u_max_1, W) + sum_d_1;
        sum_d_2   <= sum_d_1;
        u_max_2   <= u_max_1;
        sum_q(2)  <= sum_q_1;
      end if;

      -- Stage 3: radicand = room_up * room_dn;  u_d = sum_d, limited
      if valid(2) = '1' then
        radicand_3  <= resize(unsigned(room_up_2(PU_W - 1 downto 0)) * unsigned(room_dn_2(PU_W - 1 downto 0)), 32);
        d_wait(3)   <= resize(sum_d_2, PU_W);
        sat_wait(3) <= to_signed(0, 2);
        sum_q(3)    <= sum_q(2);
        if room_up_2 < 0 then
          radicand_3  <= (others => '0');
          d_wait(3)   <= resize(u_max_2, PU_W);
          sat_wait(3) <= to_signed(1, 2);
        elsif room_dn_2 < 0 then
          radicand_3  <= (others => '0');
          d_wait(3)   <= resize(-u_max_2, PU_W);
          sat_wait(3) <= to_signed(-1, 2);
        end if;
      end if;

      -- Stages 4 to 9: the root; u_d and sum_q wait for it
      for k in 4 to LATENCY - 1 loop
        if valid(k - 1) = '1' then
          sum_q(k)    <= sum_q(k - 1);
          d_wait(k)   <= d_wait(k - 1);
          sat_wait(k) <= sat_wait(k - 1);
        end if;
      end loop;

      -- Stage 10: u_q = sum_q, limited to the root
      if valid(LATENCY - 1) = '1' then
        u_d   <= d_wait(LATENCY - 1);
        sat_d <= sat_wait(LATENCY - 1);
        u_q   <= resize(clamp(sum_q(LATENCY - 1), -limit_9, limit_9), PU_W);
        sat_q <= to_signed(0, 2);
        if sum_q(LATENCY - 1) > limit_9 then
          sat_q <= to_signed(1, 2);
        elsif sum_q(LATENCY - 1) < -limit_9 then
          sat_q <= to_signed(-1, 2);
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        sat_d               <= (others => '0');
        sat_q               <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
