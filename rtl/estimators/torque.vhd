-- Purpose: estimated torque, paper 001 eq. (4), both products through one multiplier.
--   torque = lambda_d*i_q - lambda_q*i_d        per unit of 3/2*p*lambda_base*I_base
-- Formats: PU in and out; products and difference exact.
-- Latency: 7.  Interval: 4.  Rounding: half up, saturated at 2 per unit; flux and current both at their bases give 1.

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

  signal valid      : std_logic_vector(0 to LATENCY);
  signal lambda_d_1 : signed(PU_W - 1 downto 0);
  signal lambda_q_1 : signed(PU_W - 1 downto 0);
  signal lambda_1   : signed(PU_W downto 0);
  signal factor_1   : signed(PU_W + 1 downto 0);
  signal lambda_2   : signed(PU_W downto 0);
  signal i_2        : signed(PU_W - 1 downto 0);
  signal prod_3     : signed(SUM_W - 1 downto 0);
  signal addend_3   : signed(SUM_W - 1 downto 0);
  signal sum_4      : signed(SUM_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- lambda_d, then not lambda_q plus a carry from the bit below: yosys would map a plain sum in front of the
  -- multiplier to the DSP48's pre-adder and lose the signs of the operands
  lambda_1 <= not resize(lambda_q_1, PU_W + 1) when valid(3) = '1' else resize(lambda_d_1, PU_W + 1);
  factor_1 <= (lambda_1 & '1') + signed'('0' & valid(3));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the flux, registered close to the multiplier
      lambda_d_1 <= lambda_d;
      lambda_q_1 <= lambda_q;

      -- Stages 2, 4: lambda_d and i_q, then -lambda_q and i_d
      if valid(1) = '1' or valid(3) = '1' then
        lambda_2 <= factor_1(PU_W + 1 downto 1);
        i_2      <= i_d when valid(3) = '1' else i_q;
      end if;

      -- Stages 3, 5: prod = lambda_d*i_q, then -lambda_q*i_d;  addend: half an LSB, then the sum so far, in a
      -- register of its own, because yosys maps a feedback into the DSP48 incorrectly
      if valid(2) = '1' or valid(4) = '1' then
        prod_3   <= lambda_2 * i_2;
        addend_3 <= sum_4;
        if valid(2) = '1' then
          addend_3 <= half(TORQUE_DROP, SUM_W);
        end if;
      end if;

      -- Stages 4, 6: lambda_d*i_q, then lambda_d*i_q - lambda_q*i_d
      if valid(3) = '1' or valid(5) = '1' then
        sum_4 <= prod_3 + addend_3;
      end if;

      -- Stage 7: torque = sum, narrowed
      if valid(6) = '1' then
        torque <= saturate(sum_4(SUM_W - 1 downto TORQUE_DROP), PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
