-- Purpose: estimated torque, paper 001 eq. (4), both products through one multiplier.
--   torque = lambda_d*i_q - lambda_q*i_d        per unit of 3/2*p*lambda_base*I_base
-- Formats: PU in and out; products and difference exact.
-- Latency: 4.  Interval: 2.  Rounding: half up, saturated at 2 per unit; flux and current at their bases make one.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity torque is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    lambda_d  : in  signed(PU_W - 1 downto 0);
    lambda_q  : in  signed(PU_W - 1 downto 0);
    i_d       : in  signed(PU_W - 1 downto 0);
    i_q       : in  signed(PU_W - 1 downto 0);
    out_valid : out std_logic;
    torque    : out signed(PU_W - 1 downto 0)
  );
end entity torque;

architecture rtl of torque is
  constant LATENCY : positive := TORQUE_LATENCY;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal lambda_0 : signed(PU_W - 1 downto 0);
  signal i_0      : signed(PU_W - 1 downto 0);
  signal prod     : signed(2 * PU_W - 1 downto 0);  -- lambda_d*i_q at clock 1, lambda_q*i_d at clock 2
  signal prod_d_2 : signed(2 * PU_W - 1 downto 0);
  signal diff_3   : signed(2 * PU_W downto 0);
begin
  valid(0) <= in_valid;
  lambda_0 <= lambda_q when valid(1) = '1' else lambda_d;
  i_0      <= i_d when valid(1) = '1' else i_q;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = lambda_d*i_q, a clock later lambda_q*i_d
      if valid(0) = '1' or valid(1) = '1' then
        prod <= lambda_0 * i_0;
      end if;

      -- Stage 2: the first product waits for the second
      if valid(1) = '1' then
        prod_d_2 <= prod;
      end if;

      -- Stage 3: diff = lambda_d*i_q - lambda_q*i_d
      if valid(2) = '1' then
        diff_3 <= resize(prod_d_2, 2 * PU_W + 1) - resize(prod, 2 * PU_W + 1);
      end if;

      -- Stage 4: torque = diff, narrowed
      if valid(3) = '1' then
        torque <= round_sat(diff_3, TORQUE_DROP, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
