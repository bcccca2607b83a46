-- Purpose: the winding's resistance from its temperature, paper 000 eq. (12), and the flux it takes in half a sample.
--   r = r_s + tcr*(temp_winding - t_0);  rho = r*t_s/2
-- Without a reading, or with one outside t_min to t_max, r = r_s and temp_lost is raised.  Both products go through
-- one multiplier and the adder behind it.
-- Formats: temperatures S(9,6), tcr U(-6,30), t_s U(-1,18), r_s, r, rho U(0,24); products exact.
-- Latency: 7.  Interval: 7.
-- Rounding: each product half up.  r saturates, rho cannot: it is below 1/4.

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
    rho          : out unsigned(RESISTANCE_W - 1 downto 0);
    temp_lost    : out std_logic
  );
end entity winding_resistance;

architecture rtl of winding_resistance is
  constant LATENCY  : positive := WINDING_RESISTANCE_LATENCY;
  constant WIDE_W   : positive := RESISTANCE_W + 1;
  constant SLIM_W   : positive := SAMPLE_TIME_W + 1;
  constant PROD_W   : positive := WIDE_W + SLIM_W;
  constant DROP_TCR : positive := WINDING_RESISTANCE_DROP_TCR;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal lost_1 : std_logic;
  signal mul_a  : signed(SLIM_W - 1 downto 0);  -- temp_winding - t_0 at clock 1, t_s at clock 4
  signal mul_b  : signed(WIDE_W - 1 downto 0);  -- tcr at clock 1, r at clock 4
  signal prod   : signed(PROD_W - 1 downto 0);
  signal addend : signed(PROD_W - 1 downto 0);
  signal sum    : signed(PROD_W - 1 downto 0);
  signal r_3    : unsigned(RESISTANCE_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  r_3 <= r_s when lost_1 = '1' else
         saturate_u(sum(PROD_W - 1 downto DROP_TCR), RESISTANCE_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: warmer = temp_winding - t_0 and tcr;  lost = no reading to believe
      if valid(0) = '1' then
        mul_a  <= resize(temp_winding, SLIM_W) - resize(t_0, SLIM_W);
        mul_b  <= signed('0' & tcr);
        addend <= rounding_base(signed('0' & r_s), DROP_TCR, PROD_W);
        lost_1 <= '1';
        if temp_valid = '1' and temp_winding >= t_min and temp_winding <= t_max then
          lost_1 <= '0';
        end if;
      end if;

      -- Stages 2, 5: prod = warmer*tcr, r*t_s
      if valid(1) = '1' or valid(4) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stages 3, 6: sum = r_s + prod, prod
      if valid(2) = '1' or valid(5) = '1' then
        sum <= addend + prod;
      end if;

      -- Stage 4: r = sum, limited, or r_s;  nothing but half an LSB goes with the next product
      if valid(3) = '1' then
        r     <= r_3;
        mul_a <= signed('0' & t_s);
        mul_b <= signed('0' & r_3);
      end if;
      if valid(3) = '1' then
        addend <= rounding_base("0", WINDING_RESISTANCE_DROP_RHO, PROD_W);
      end if;

      -- Stage 7: rho = prod/2, narrowed
      if valid(6) = '1' then
        rho       <= unsigned(sum(RESISTANCE_W - 1 + WINDING_RESISTANCE_DROP_RHO downto WINDING_RESISTANCE_DROP_RHO));
        temp_lost <= lost_1;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
