-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the references of torque and voltage mode, which begin where the mode before ended.
--   u_x_now  = to u_x_ext by u_step at most in voltage mode, else u_x - u_comp_x, the voltage that the motor has got
--   i_q_now  = to i_q_ext by i_step at most in torque mode, i_q_made in voltage mode, else torque_ref
--   u_rest_x = u_x - u_dec_x - u_comp_x, what is left to a current regulator at this voltage
-- All act on the next sample.  run = 0: i_q_now and u_x_now are zero.
-- Formats: PU, sums exact.  Latency: 3.  Interval: 4.
-- Rounding: none; sums saturate to PU.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity mode_references is
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    in_valid   : in  std_logic;
    u_d        : in  signed(PU_W - 1 downto 0);
    u_q        : in  signed(PU_W - 1 downto 0);
    u_dec_d    : in  signed(PU_W - 1 downto 0);
    u_dec_q    : in  signed(PU_W - 1 downto 0);
    u_comp_d   : in  signed(PU_W - 1 downto 0);
    u_comp_q   : in  signed(PU_W - 1 downto 0);
    i_q_ext    : in  signed(PU_W - 1 downto 0);
    i_q_made   : in  signed(PU_W - 1 downto 0);
    torque_ref : in  signed(PU_W - 1 downto 0);
    by_voltage : in  std_logic;
    regulates  : in  std_logic;
    run        : in  std_logic;
    u_d_ext    : in  signed(PU_W - 1 downto 0);
    u_q_ext    : in  signed(PU_W - 1 downto 0);
    u_step     : in  signed(PU_W - 1 downto 0);
    i_step     : in  signed(PU_W - 1 downto 0);
    out_valid  : out std_logic;
    u_d_now    : out signed(PU_W - 1 downto 0);
    u_q_now    : out signed(PU_W - 1 downto 0);
    i_q_now    : out signed(PU_W - 1 downto 0);
    u_rest_d   : out signed(PU_W - 1 downto 0);
    u_rest_q   : out signed(PU_W - 1 downto 0)
  );
end entity mode_references;

architecture rtl of mode_references is
  constant LATENCY : positive := MODE_REFERENCES_LATENCY;

  -- A change of at most step towards a target
  function limited (change : signed(PU_W downto 0); step : signed(PU_W - 1 downto 0)) return signed is
  begin
    return within(change, unsigned(step), 0);
  end function limited;

  signal valid                          : std_logic_vector(0 to LATENCY);
  signal free_d_1, free_q_1             : signed(PU_W downto 0);
  signal change_d_1, change_q_1         : signed(PU_W downto 0);
  signal change_i_1                     : signed(PU_W downto 0);
  signal free_d_2, free_q_2             : signed(PU_W - 1 downto 0);
  signal rest_d_2, rest_q_2             : signed(PU_W - 1 downto 0);
  signal moved_d_2, moved_q_2, moved_i_2 : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the voltage that the motor has got, and the ways to the targets
      free_d_1   <= resize(u_d, PU_W + 1) - u_comp_d;
      free_q_1   <= resize(u_q, PU_W + 1) - u_comp_q;
      change_d_1 <= resize(u_d_ext, PU_W + 1) - u_d_now;
      change_q_1 <= resize(u_q_ext, PU_W + 1) - u_q_now;
      change_i_1 <= resize(i_q_ext, PU_W + 1) - i_q_now;

      -- Stage 2: what is left beside the rotational voltage; a step of each way, which ends at the target
      free_d_2  <= saturate(free_d_1, PU_W);
      free_q_2  <= saturate(free_q_1, PU_W);
      rest_d_2  <= saturate(resize(free_d_1, PU_W + 2) - u_dec_d, PU_W);
      rest_q_2  <= saturate(resize(free_q_1, PU_W + 2) - u_dec_q, PU_W);
      moved_d_2 <= resize(u_d_now + limited(change_d_1, u_step), PU_W);
      moved_q_2 <= resize(u_q_now + limited(change_q_1, u_step), PU_W);
      moved_i_2 <= resize(i_q_now + limited(change_i_1, i_step), PU_W);

      -- Stage 3: the references of the next sample
      if valid(LATENCY - 1) = '1' then
        u_d_now  <= free_d_2;
        u_q_now  <= free_q_2;
        i_q_now  <= torque_ref;
        u_rest_d <= rest_d_2;
        u_rest_q <= rest_q_2;
        if by_voltage = '1' then
          u_d_now <= moved_d_2;
          u_q_now <= moved_q_2;
          i_q_now <= i_q_made;
        elsif regulates = '0' then
          i_q_now <= moved_i_2;
        end if;
        if run = '0' then
          u_d_now <= (others => '0');
          u_q_now <= (others => '0');
          i_q_now <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        u_d_now             <= (others => '0');
        u_q_now             <= (others => '0');
        i_q_now             <= (others => '0');
        u_rest_d            <= (others => '0');
        u_rest_q            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
