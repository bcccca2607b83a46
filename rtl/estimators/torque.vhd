-- Purpose: estimated torque, paper 001 eq. (4).
--   torque = lambda_d*i_q - lambda_q*i_d        per unit of 3/2*p*lambda_base*I_base
-- One multiplier for both products: lambda_d*i_q, then lambda_q*i_d a clock later.
-- Formats: PU in and out; products and difference exact.
-- Latency: 6.  Interval: 4.  Rounding: half up, saturated at 2 per unit; flux and current both at their bases give 1.

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
  constant PROD_W  : positive := 2 * PU_W;

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid    : std_logic_vector(0 to LATENCY);
  signal lambda_0 : signed(PU_W - 1 downto 0);
  signal i_0      : signed(PU_W - 1 downto 0);
  signal prod_3   : signed(PROD_W downto 0);
  signal prod_4   : signed(PROD_W downto 0);
  signal diff_5   : signed(PROD_W downto 0);
begin
  valid(0) <= in_valid;

  -- The product that enters
  lambda_0 <= lambda_q when valid(1) = '1' else lambda_d;
  i_0      <= i_d when valid(1) = '1' else i_q;

  -- Stages 1 to 3: prod = lambda_d*i_q, then lambda_q*i_d
  product : entity work.multiply_add
    generic map (DROP => 0)
    port map (clk => clk, a => lambda_0, b => i_0, c => NOTHING, y => prod_3, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 4, 5: diff = lambda_d*i_q, which waits for the other, - lambda_q*i_d
      prod_4 <= prod_3;
      diff_5 <= prod_4 - prod_3;

      -- Stage 6: torque = diff, narrowed
      if valid(5) = '1' then
        torque <= round_sat(diff_5, TORQUE_DROP, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
