-- Purpose: adds decoupling and dead-time compensation, keeps the voltage in the circle of radius u_max, d axis first.
--   limit = min(u_max, room),  u_d = limit(u_pi_d + u_dec_d + u_comp_d, +-limit)
--   u_q = limit(u_pi_q + u_dec_q + u_comp_q, +-sqrt(u_max**2 - u_d**2))
--   room = sqrt(u_max**2 - min(|u_dec_q|, u_max)**2), for the next sample
--   sat = -1, 0, +1: the limit that holds the axis
-- Room: d comes first in what the EMF of the last sample leaves, so that the q axis can always hold its EMF;
-- without it the drive has a second stable point at high speed, see the model.
-- Formats: sums exact; radicands (u_max - u)*(u_max + u) exact, U(0,32); PU out.
-- Latency: 10.  Interval: 11 (room is ready one clock after the output; both roots share multiplier and sqrt).
-- Rounding: none but the root's, which errs inwards: the circle is never left.

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
  constant SUM_W   : positive := PU_W + 2;

  type sum_wait_t is array (1 to LATENCY - 1) of signed(SUM_W - 1 downto 0);
  type d_wait_t is array (3 to LATENCY - 1) of signed(PU_W - 1 downto 0);
  type sat_wait_t is array (2 to LATENCY - 1) of signed(1 downto 0);

  -- State
  signal room : unsigned(U_MAX_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal sum_d_1    : signed(SUM_W - 1 downto 0);
  signal u_max_1    : signed(U_MAX_W downto 0);
  signal limit_1    : signed(U_MAX_W downto 0);
  signal dec_q_1    : unsigned(PU_W - 1 downto 0);
  signal sum_d_2    : signed(SUM_W - 1 downto 0);
  signal limit_2    : signed(U_MAX_W downto 0);
  signal u_max_2    : signed(U_MAX_W downto 0);
  signal emf_2      : signed(U_MAX_W downto 0);
  signal u_2        : signed(PU_W - 1 downto 0);
  signal emf_3      : signed(U_MAX_W downto 0);
  signal u_max_3    : signed(U_MAX_W downto 0);
  signal factor_lo  : signed(W - 1 downto 0);
  signal factor_hi  : signed(W - 1 downto 0);
  signal radicand   : unsigned(31 downto 0);
  signal root_start : std_logic;
  signal root_9     : unsigned(U_MAX_W - 1 downto 0);
  signal limit_9    : signed(PU_W downto 0);
  signal sum_q      : sum_wait_t;
  signal d_wait     : d_wait_t;
  signal sat_wait   : sat_wait_t;
begin
  valid(0) <= in_valid;

  root : entity work.sqrt
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => root_start,
      x         => radicand,
      out_valid => open,
      root      => root_9
    );

  root_start <= valid(3) or valid(4);
  limit_9    <= signed(resize(root_9, PU_W + 1));

  -- u_d, limited; then the EMF: what the multiplier makes a radicand of
  u_2       <= resize(limit_2, PU_W) when sat_wait(2) > 0 else
               -resize(limit_2, PU_W) when sat_wait(2) < 0 else
               sum_d_2(PU_W - 1 downto 0);
  factor_lo <= resize(u_max_3, W) - emf_3 when valid(3) = '1' else resize(u_max_2, W) - u_2;
  factor_hi <= resize(u_max_3, W) + emf_3 when valid(3) = '1' else resize(u_max_2, W) + u_2;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: sum = u_pi + u_dec + u_comp;  limit = min(u_max, room)
      if valid(0) = '1' then
        sum_d_1  <= resize(u_pi_d, SUM_W) + resize(u_dec_d, SUM_W) + resize(u_comp_d, SUM_W);
        sum_q(1) <= resize(u_pi_q, SUM_W) + resize(u_dec_q, SUM_W) + resize(u_comp_q, SUM_W);
        dec_q_1  <= unsigned(abs(u_dec_q));
        u_max_1  <= signed('0' & u_max);
        limit_1  <= signed('0' & minimum(u_max, room));
      end if;

      -- Stage 2: side of the limit on which sum_d is;  emf = min(|u_dec_q|, u_max)
      if valid(1) = '1' then
        sum_d_2     <= sum_d_1;
        limit_2     <= limit_1;
        u_max_2     <= u_max_1;
        emf_2       <= signed(resize(minimum(dec_q_1, resize(unsigned(u_max_1), PU_W)), U_MAX_W + 1));
        sat_wait(2) <= to_signed(0, 2);
        if sum_d_1 > limit_1 then
          sat_wait(2) <= to_signed(1, 2);
        elsif sum_d_1 < -limit_1 then
          sat_wait(2) <= to_signed(-1, 2);
        end if;
      end if;

      -- Stages 3, 4: radicand = (u_max - u_d)*(u_max + u_d), then (u_max - emf)*(u_max + emf)
      if valid(2) = '1' or valid(3) = '1' then
        radicand <= resize(unsigned(factor_lo(PU_W - 1 downto 0)) * unsigned(factor_hi(PU_W - 1 downto 0)), 32);
      end if;
      if valid(2) = '1' then
        d_wait(3) <= u_2;
        emf_3     <= emf_2;
        u_max_3   <= u_max_2;
      end if;

      -- Stages 4 to 9: the root of the first radicand; sum_q, u_d and its flag wait for it
      for k in 2 to LATENCY - 1 loop
        if valid(k - 1) = '1' then
          sum_q(k) <= sum_q(k - 1);
        end if;
      end loop;
      for k in 3 to LATENCY - 1 loop
        if valid(k - 1) = '1' then
          sat_wait(k) <= sat_wait(k - 1);
        end if;
      end loop;
      for k in 4 to LATENCY - 1 loop
        if valid(k - 1) = '1' then
          d_wait(k) <= d_wait(k - 1);
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

      -- Stage 11: room = the root of the second radicand
      if valid(LATENCY) = '1' then
        room <= root_9;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        sat_d               <= (others => '0');
        sat_q               <= (others => '0');
        room                <= (others => '1');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
