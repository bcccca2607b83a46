-- Purpose: estimated torque, paper 001 eq. (4), both products through one multiplier.
--   torque = lambda_d*i_q - lambda_q*i_d        per unit of 3/2*p*lambda_base*I_base
-- Formats: PU in and out; products and difference exact.
-- Latency: 5.  Interval: 3.  Rounding: half up, saturated at 2 per unit; flux and current at their bases make one.

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
  constant SUM_W   : positive := 2 * PU_W + 1;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal lambda_1 : signed(PU_W - 1 downto 0);
  signal i_1      : signed(PU_W - 1 downto 0);
  signal prod_2   : signed(2 * PU_W - 1 downto 0);
  signal addend_2 : signed(SUM_W - 1 downto 0);
  signal sum_2    : signed(SUM_W downto 0);
  signal sum_3    : signed(SUM_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- -lambda_q*i_d is made of not lambda_q, which is -lambda_q - 1, and the missing i_d: no carry before the multiplier.
  addend_2 <= sum_3 when valid(3) = '1' else
              rounding_base("0", TORQUE_DROP, SUM_W) + i_d;

  -- prod + addend, as prod - not addend - 1 with the borrow from one bit more below: yosys would put a plain sum with
  -- its own feedback into the DSP48, wrongly
  sum_2 <= (prod_2(prod_2'high) & prod_2 & '0') - ((not addend_2) & '1');

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: lambda_d and i_q, a clock later not lambda_q and i_d
      if valid(0) = '1' or valid(1) = '1' then
        lambda_1 <= not lambda_q when valid(1) = '1' else lambda_d;
        i_1      <= i_d when valid(1) = '1' else i_q;
      end if;

      -- Stages 2, 3: prod = lambda_d*i_q, a clock later -lambda_q*i_d - i_d
      if valid(1) = '1' or valid(2) = '1' then
        prod_2 <= lambda_1 * i_1;
      end if;

      -- Stages 3, 4: sum = i_d + lambda_d*i_q, a clock later lambda_d*i_q - lambda_q*i_d; with half an LSB to round
      if valid(2) = '1' or valid(3) = '1' then
        sum_3 <= sum_2(SUM_W downto 1);
      end if;

      -- Stage 5: torque = sum, narrowed
      if valid(4) = '1' then
        torque <= saturate(sum_3(SUM_W - 1 downto TORQUE_DROP), PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
