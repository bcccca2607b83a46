-- Purpose: winding resistance from its temperature, paper 000 eq. (12), and the resistive flux drop of half a sample.
--   r = r_s + tcr*(temp_winding - t_0);  minus_rho = -r*t_s/2
-- Without a valid reading (temp_valid = 0, or outside t_min to t_max) r = r_s and temp_lost is 1.  Both products share
-- one multiplier and the adder behind it.
-- Formats: temperatures S(9,6), tcr U(-6,30), t_s U(-1,18), r_s, r U(0,24), minus_rho S(-2,24); products exact.
-- Latency: 8.  Interval: 8.
-- Rounding: each product half up, rho before it is negated.  r saturates, rho cannot: it is below 1/4.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity winding_resistance is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    temp_winding : in  signed(15 downto 0);
    temp_valid   : in  std_logic;
    r_s          : in  unsigned(RESISTANCE_W - 1 downto 0);
    tcr          : in  unsigned(23 downto 0);
    t_0          : in  signed(15 downto 0);
    t_min        : in  signed(15 downto 0);
    t_max        : in  signed(15 downto 0);
    t_s          : in  unsigned(SAMPLE_TIME_W - 1 downto 0);
    out_valid    : out std_logic;
    r            : out unsigned(RESISTANCE_W - 1 downto 0);
    minus_rho    : out signed(MINUS_RHO_W - 1 downto 0);
    temp_lost    : out std_logic
  );
end entity winding_resistance;

architecture rtl of winding_resistance is
  constant LATENCY  : positive := WINDING_RESISTANCE_LATENCY;
  constant WIDE_W   : positive := RESISTANCE_W + 1;
  constant SLIM_W   : positive := SAMPLE_TIME_W + 1;
  constant PROD_W   : positive := WIDE_W + SLIM_W;
  constant DROP_TCR : positive := WINDING_RESISTANCE_DROP_TCR;
  constant DROP_RHO : positive := WINDING_RESISTANCE_DROP_RHO;

  -- One LSB less than half: a value that is negated after rounding half up is rounded half down.
  constant HALF_DOWN : signed(PROD_W - 1 downto 0) := (DROP_RHO - 2 downto 0 => '1', others => '0');

  signal valid  : std_logic_vector(0 to LATENCY);
  signal lost_1 : std_logic_vector(2 downto 0);         -- invalid, below t_min, above t_max
  signal from_0 : signed(SLIM_W - 1 downto 0);
  signal less_0 : signed(SLIM_W - 1 downto 0);
  signal slim   : signed(SLIM_W - 1 downto 0);          -- temp_winding - t_0 at clock 1, -t_s at clock 5
  signal wide   : unsigned(RESISTANCE_W - 1 downto 0);  -- tcr at clock 1, r at clock 5
  signal prod   : signed(PROD_W - 1 downto 0);
  signal addend : signed(PROD_W - 1 downto 0);
  signal sum    : signed(PROD_W - 1 downto 0);

  -- a < b with one carry chain: a comparison with a constant setting would otherwise become a tree of LUTs.
  function below (a : signed; b : signed) return std_logic is
    variable room : signed(a'length downto 0);
  begin
    room := resize(a, a'length + 1) - resize(b, a'length + 1);
    return room(room'high);
  end function;
begin
  valid(0) <= in_valid;

  from_0 <= resize(temp_winding, SLIM_W) when valid(0) = '1' else (others => '0');
  less_0 <= resize(t_0, SLIM_W) when valid(0) = '1' else signed('0' & t_s);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: warmer = temp_winding - t_0, and tcr;  lost = no valid reading;  stage 2: warmer = 0 if lost
      if valid(0) = '1' or valid(4) = '1' then
        slim <= from_0 - less_0;
      end if;
      if valid(1) = '1' and lost_1 /= "000" then
        slim <= (others => '0');
      end if;
      if valid(0) = '1' then
        wide   <= tcr;
        addend <= rounding_base(signed('0' & r_s), DROP_TCR, PROD_W);
        lost_1 <= (not temp_valid) & below(temp_winding, t_min) & below(t_max, temp_winding);
      end if;

      -- Stages 3, 6: prod = warmer*tcr, -t_s*r
      if valid(2) = '1' or valid(5) = '1' then
        prod <= slim * signed('0' & wide);
      end if;

      -- Stages 4, 7: sum = r_s + prod, prod
      if valid(3) = '1' or valid(6) = '1' then
        sum <= addend + prod;
      end if;

      -- Stage 5: r = sum, limited;  the addend of the next product is its rounding constant only
      if valid(4) = '1' then
        wide   <= saturate_u(sum(PROD_W - 1 downto DROP_TCR), RESISTANCE_W);
        addend <= HALF_DOWN;
      end if;

      -- Stage 8: minus_rho = prod/2, narrowed
      if valid(7) = '1' then
        minus_rho <= sum(MINUS_RHO_W - 1 + DROP_RHO downto DROP_RHO);
        temp_lost <= or lost_1;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  r         <= wide;
  out_valid <= valid(LATENCY);

end architecture rtl;
