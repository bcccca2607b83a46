-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: angle at which the voltage will act, theta_out = theta_me + k_delay*omega_me, modulo one turn.
-- k_delay = 1.5*T_s*omega_base/(2*pi): a duty acts on average 1.5 sample times after the sampling instant.
-- Formats: theta TURN U(0,18), omega_me PU, k_delay U(0,17).
-- Latency: 3.
-- Rounding: product half up to TURN; the sum wraps, it is an angle.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity svm_delay_compensation is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    theta_me  : in  unsigned(TURN_W - 1 downto 0);
    omega_me  : in  signed(PU_W - 1 downto 0);
    k_delay   : in  unsigned(16 downto 0);
    out_valid : out std_logic;
    theta_out : out unsigned(TURN_W - 1 downto 0)
  );
end entity svm_delay_compensation;

architecture rtl of svm_delay_compensation is
  constant LATENCY : positive := SVM_DELAY_COMPENSATION_LATENCY;
  constant SUM_W   : positive := PU_W + 19;

  signal valid   : std_logic_vector(0 to LATENCY);
  signal omega_1 : signed(PU_W - 1 downto 0);
  signal theta_1 : unsigned(TURN_W - 1 downto 0);
  signal prod_2  : signed(PU_W + 17 downto 0);
  signal theta_2 : unsigned(TURN_W - 1 downto 0);
  signal sum_3   : signed(SUM_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: prod = omega_me*k_delay
      omega_1 <= omega_me;
      theta_1 <= theta_me;
      prod_2  <= omega_1 * signed('0' & k_delay);
      theta_2 <= theta_1;

      -- Stage 3: sum = theta_me + prod, at the scale of the product and with half an LSB of the angle
      if valid(2) = '1' then
        sum_3 <= rounding_base(signed('0' & theta_2), SVM_DELAY_COMPENSATION_DROP, SUM_W) + prod_2;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);
  theta_out <= unsigned(sum_3(SVM_DELAY_COMPENSATION_DROP + TURN_W - 1 downto SVM_DELAY_COMPENSATION_DROP));

end architecture rtl;
