-- Purpose: the voltage at the motor's terminals: the commanded voltage minus the loss of the legs; alpha, then beta.
--   u_clean = u_applied - v_leg*s(k-1)
-- s(k-1): the directions of the previous sample, whose voltage acts in the coming period.
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
  constant DROP    : positive := CLEAN_VOLTAGE_DROP;
  constant SUM_W   : positive := FLUX_W + 1 + DROP;

  -- State: the directions of the previous sample
  signal last_alpha : signed(PU_W - 1 downto 0);
  signal last_beta  : signed(PU_W - 1 downto 0);

  signal valid  : std_logic_vector(0 to LATENCY);
  signal s_1    : signed(PU_W - 1 downto 0);
  signal v_1    : signed(V_LEG_W - 1 downto 0);  -- v_leg in the multiplier's operand register, as its source is distant
  signal prod_2 : signed(V_LEG_W + PU_W - 1 downto 0);
  signal u_2    : signed(FLUX_W - 1 downto 0);
  signal sum_3  : signed(SUM_W - 1 downto 0);
  signal diff_3 : signed(FLUX_W downto 0);
begin
  valid(0) <= in_valid;

  u_2 <= u_applied_beta when valid(3) = '1' else u_applied_alpha;

  -- sum is the complement of u_applied - prod, because the adder behind the multiplier can only add.
  diff_3 <= not sum_3(FLUX_W + DROP downto DROP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: prod = v_leg*s(k-1)
      if valid(0) = '1' or valid(1) = '1' then
        s_1 <= last_beta when valid(1) = '1' else last_alpha;
        v_1 <= v_leg;
      end if;
      if valid(1) = '1' or valid(2) = '1' then
        prod_2 <= v_1 * s_1;
      end if;

      -- Stage 3: diff = u_applied - prod
      if valid(2) = '1' or valid(3) = '1' then
        sum_3 <= rounding_base(not u_2, DROP, SUM_W) + prod_2;
      end if;

      -- Stage 4: u_clean = diff, narrowed; alpha at clock 4, beta at 5
      if valid(3) = '1' then
        u_clean_alpha <= saturate(diff_3, FLUX_W);
      end if;
      if valid(4) = '1' then
        u_clean_beta <= saturate(diff_3, FLUX_W);
        last_alpha   <= s_alpha;
        last_beta    <= s_beta;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        last_alpha          <= (others => '0');
        last_beta           <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
