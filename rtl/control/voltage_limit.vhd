-- Purpose: adds decoupling and dead-time compensation, keeps the voltage in the circle of radius u_max, d axis first.
--   limit = min(u_max, room),  u_d = limit(u_pi_d + u_dec_d + u_comp_d, +-limit)
--   u_q = limit(u_pi_q + u_dec_q + u_comp_q, +-sqrt(u_max**2 - u_d**2))
--   room = sqrt(u_max**2 - min(|u_dec_q|, u_max)**2), for the next sample
--   sat = -1, 0, +1: the active limit of the axis
-- Room: the d axis has priority, but only within the voltage that remains beside the EMF of the last sample, so that
-- the q axis can always balance its EMF.  Without it the drive has a second stable point at high speed, see the model.
-- Formats: sums exact; radicands (u_max - u)*(u_max + u) exact, U(0,32); PU out.
-- Latency: 11; u_d is valid with out_soon.  Interval: 12 (room is ready one clock after the output).
-- The q axis' inputs are needed a clock after the d axis'.
-- One adder, one comparison, one multiplier and one root are shared: they process sum_d against limit, the EMF against
-- u_max, then sum_q, which is the EMF plus two more terms and waits for the root, its limit.
-- Absolute values by inversion: |v| = (v xor s) + s, s the sign.
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
  constant PART_W  : positive := PU_W - 1;  -- u_max - u and u_max + u, from 0 to 2

  -- State
  signal room : unsigned(U_MAX_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal beat       : unsigned(1 downto 0);
  signal so_far_0   : signed(SUM_W - 1 downto 0);
  signal next_0     : signed(SUM_W - 1 downto 0);
  signal v_1        : signed(SUM_W - 1 downto 0);
  signal limit_1    : unsigned(U_MAX_W - 1 downto 0);
  signal bound_1    : unsigned(U_MAX_W - 1 downto 0);  -- limit_1; the root at clocks 9 and 10
  signal v_2        : signed(SUM_W - 1 downto 0);
  signal limit_2    : unsigned(U_MAX_W - 1 downto 0);
  signal beyond_2   : std_logic;
  signal limited_2  : signed(PU_W - 1 downto 0);
  signal side_2     : signed(1 downto 0);  -- -1, 0, +1: the active limit
  signal part_2     : unsigned(U_MAX_W - 1 downto 0);
  signal carry_2    : std_logic;
  signal lo_3       : unsigned(PART_W - 1 downto 0);
  signal hi_3       : unsigned(PART_W - 1 downto 0);
  signal radicand_4 : unsigned(31 downto 0);
  signal root_start : std_logic;
  signal root_9     : unsigned(U_MAX_W - 1 downto 0);

  -- '1' if |v| > limit: limit - |v| is negative.
  function beyond (v : signed; limit : unsigned) return std_logic is
    constant MINUS : signed(v'length - 1 downto 0) := (others => not v(v'high));
    variable rest  : signed(v'length downto 0);
  begin
    rest := (signed(resize(limit, v'length)) & '1') + ((v xor MINUS) & not v(v'high));
    return rest(rest'high);
  end function;
begin
  valid(0) <= in_valid;

  root : entity work.sqrt
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => root_start,
      x         => radicand_4,
      out_valid => open,
      root      => root_9
    );

  root_start <= valid(4) or valid(5);

  -- The terms of this clock: all three of the d axis while in_valid, as carry-save sum and carry, then the EMF, then
  -- the other two of the q axis
  with beat select so_far_0 <=
    resize(u_pi_d xor u_dec_d xor u_comp_d, SUM_W) when "00",
    (others => '0') when "01",
    v_1 when others;

  with beat select next_0 <=
    shift_left(resize((u_pi_d and u_dec_d) or (u_pi_d and u_comp_d) or (u_dec_d and u_comp_d), SUM_W), 1) when "00",
    resize(u_dec_q, SUM_W) when "01",
    resize(u_pi_q, SUM_W) when "10",
    resize(u_comp_q, SUM_W) when others;

  bound_1 <= root_9 when valid(9) = '1' or valid(10) = '1' else limit_1;

  -- v within +-limit
  process (all)
    variable within : signed(PU_W - 1 downto 0);
    variable carry  : signed(1 downto 0);
  begin
    within := v_2(PU_W - 1 downto 0);
    carry  := "00";
    if beyond_2 = '1' then
      within   := signed(resize(limit_2, PU_W)) xor (PU_W - 1 downto 0 => v_2(v_2'high));
      carry(0) := v_2(v_2'high);
    end if;
    limited_2 <= within + carry;
  end process;

  side_2 <= (v_2(v_2'high) and beyond_2) & beyond_2;

  -- |v|, or the limit if v is beyond it; for a negative v the complement, with carry_2 as the missing one
  part_2  <= limit_2 when beyond_2 = '1' else
             unsigned(v_2(U_MAX_W - 1 downto 0)) xor (U_MAX_W - 1 downto 0 => v_2(v_2'high));
  carry_2 <= v_2(v_2'high) and not beyond_2;

  process (clk)
    variable high, low : unsigned(PART_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1 to 4: v = u_pi + u_dec + u_comp of the d axis, the EMF, the q axis;  limit = min(u_max, room), u_max
      beat <= (valid(1) or valid(2)) & (valid(0) or valid(2));
      if valid(0) = '1' or beat /= 0 then
        v_1 <= so_far_0 + next_0;
      end if;
      if valid(0) = '1' or valid(1) = '1' then
        limit_1 <= u_max;
        if valid(1) = '0' and room < u_max then
          limit_1 <= room;
        end if;
      end if;

      -- Stages 2, 3, 10: comparison of |v| with its limit; stage 11: limit is the root that becomes room
      if valid(1) = '1' or valid(2) = '1' or valid(9) = '1' or valid(10) = '1' then
        v_2      <= v_1;
        limit_2  <= bound_1;
        beyond_2 <= beyond(v_1, bound_1);
      end if;

      -- Stage 3: u_d = sum_d, limited.  Stages 3, 4: lo = u_max - |u|,  hi = u_max + |u|
      if valid(2) = '1' then
        u_d   <= limited_2;
        sat_d <= side_2;
      end if;
      if valid(2) = '1' or valid(3) = '1' then
        low  := (resize(u_max, PART_W) & not carry_2) + ((not resize(part_2, PART_W)) & not carry_2);
        high := (resize(u_max, PART_W) & carry_2) + (resize(part_2, PART_W) & carry_2);
        lo_3 <= low(PART_W downto 1);
        hi_3 <= high(PART_W downto 1);
      end if;

      -- Stages 4, 5: radicand = lo*hi;  stages 5 to 10: its root
      if valid(3) = '1' or valid(4) = '1' then
        radicand_4 <= resize(lo_3 * hi_3, 32);
      end if;

      -- Stage 11: u_q = sum_q, limited to the root
      if valid(10) = '1' then
        u_q   <= limited_2;
        sat_q <= side_2;
      end if;

      -- Stage 12: room = the root of the second radicand
      if valid(LATENCY) = '1' then
        room <= limit_2;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        beat                <= (others => '0');
        sat_d               <= (others => '0');
        sat_q               <= (others => '0');
        room                <= (others => '1');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
