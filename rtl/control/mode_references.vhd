-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the references of a mode that begins: where the mode before ended, from there by limited steps to what is asked
-- for.  One pipeline moves u_d_now, u_q_now, i_d_now, i_q_now and omega_now one after another.
--   u_x_now  = to u_x_ext by u_step at most in voltage mode, else u_x - u_comp_x, the voltage that the motor has got
--   i_d_now  = i_d in voltage mode, else to i_d_source by i_step at most
--   i_q_now  = i_q_made in voltage mode, to i_q_ext by i_step at most in torque mode while it holds, else torque_ref
--   omega_now = to omega_ref by omega_step at most in speed mode while it holds, else omega_me
--   hold_d, hold_q, hold_omega: 1 in voltage mode (hold_q: outside of torque mode, hold_omega: of speed mode) and after it
--              until the target is within a step
--   u_rest_x = u_x - u_dec_x - u_comp_x, what is left to a current regulator at this voltage
-- All act on the next sample.  run = 0: all references are zero and nothing holds.
-- Formats: PU, sums exact.  Latency: 7.  Interval: 7.
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
    i_d        : in  signed(PU_W - 1 downto 0);
    i_q_made   : in  signed(PU_W - 1 downto 0);
    i_d_source : in  signed(PU_W - 1 downto 0);
    i_q_ext    : in  signed(PU_W - 1 downto 0);
    torque_ref : in  signed(PU_W - 1 downto 0);
    omega_me   : in  signed(PU_W - 1 downto 0);
    omega_ref  : in  signed(PU_W - 1 downto 0);
    by_voltage : in  std_logic;
    by_speed   : in  std_logic;
    regulates  : in  std_logic;
    run        : in  std_logic;
    u_d_ext    : in  signed(PU_W - 1 downto 0);
    u_q_ext    : in  signed(PU_W - 1 downto 0);
    u_step     : in  signed(PU_W - 1 downto 0);
    i_step     : in  signed(PU_W - 1 downto 0);
    omega_step : in  signed(PU_W - 1 downto 0);
    out_valid  : out std_logic;
    u_d_now    : out signed(PU_W - 1 downto 0);
    u_q_now    : out signed(PU_W - 1 downto 0);
    i_d_now    : out signed(PU_W - 1 downto 0);
    i_q_now    : out signed(PU_W - 1 downto 0);
    hold_d     : out std_logic;
    hold_q     : out std_logic;
    omega_now  : out signed(PU_W - 1 downto 0);
    hold_omega : out std_logic;
    u_rest_d   : out signed(PU_W - 1 downto 0);
    u_rest_q   : out signed(PU_W - 1 downto 0)
  );
end entity mode_references;

architecture rtl of mode_references is
  constant LATENCY : positive := MODE_REFERENCES_LATENCY;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal target_0 : signed(PU_W - 1 downto 0);
  signal now_0    : signed(PU_W - 1 downto 0);
  signal most_0   : signed(PU_W - 1 downto 0);
  signal u_0      : signed(PU_W - 1 downto 0);
  signal comp_0   : signed(PU_W - 1 downto 0);
  signal dec_1    : signed(PU_W - 1 downto 0);
  signal change_1 : signed(PU_W downto 0);
  signal most_1   : signed(PU_W - 1 downto 0);
  signal now_1    : signed(PU_W - 1 downto 0);
  signal free_1   : signed(PU_W downto 0);
  signal past_2   : std_logic;
  signal moved_2  : signed(PU_W - 1 downto 0);
  signal free_2   : signed(PU_W - 1 downto 0);
  signal rest_2   : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- What enters: u_d, u_q, i_d, i_q, omega
  target_0 <= omega_ref when valid(4) = '1' else
              i_q_ext when valid(3) = '1' else
              i_d_source when valid(2) = '1' else
              u_q_ext when valid(1) = '1' else
              u_d_ext;
  now_0    <= omega_now when valid(4) = '1' else
              i_q_now when valid(3) = '1' else
              i_d_now when valid(2) = '1' else
              u_q_now when valid(1) = '1' else
              u_d_now;
  most_0   <= omega_step when valid(4) = '1' else
              i_step when valid(2) = '1' or valid(3) = '1' else u_step;
  u_0      <= u_q when valid(1) = '1' else u_d;
  comp_0   <= u_comp_q when valid(1) = '1' else u_comp_d;
  dec_1    <= u_dec_q when valid(2) = '1' else u_dec_d;

  process (clk)
    variable change : signed(PU_W downto 0);
    variable past   : std_logic;
    variable sum    : signed(PU_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the way to the target; the voltage that the motor has got
      change_1 <= resize(target_0, PU_W + 1) - now_0;
      now_1    <= now_0;
      most_1   <= most_0;
      free_1   <= resize(u_0, PU_W + 1) - comp_0;

      -- Stage 2: moved = now + change, limited;  rest = free - dec
      change := change_1;
      past   := beyond(change, unsigned(most_1), 0);
      if past = '1' then  -- a negative limit is the complement plus one, which the adder adds
        change := resize(most_1, PU_W + 1) xor change(PU_W);
      end if;
      sum     := resize((now_1 & '1') + (change & (past and change(PU_W))), PU_W + 1);
      past_2  <= past;
      moved_2 <= sum(PU_W downto 1);
      free_2  <= saturate(free_1, PU_W);
      rest_2  <= saturate(resize(free_1, PU_W + 2) - dec_1, PU_W);

      -- Stages 3 to 7: the references of the next sample, one after another
      if valid(2) = '1' then
        u_d_now  <= moved_2 when by_voltage = '1' else free_2;
        u_rest_d <= rest_2;
      end if;
      if valid(3) = '1' then
        u_q_now  <= moved_2 when by_voltage = '1' else free_2;
        u_rest_q <= rest_2;
      end if;
      if valid(4) = '1' then
        i_d_now <= i_d when by_voltage = '1' else moved_2;
        hold_d  <= by_voltage or (hold_d and past_2);
      end if;
      if valid(5) = '1' then
        i_q_now <= torque_ref;
        if by_voltage = '1' then
          i_q_now <= i_q_made;
        elsif regulates = '0' and hold_q = '1' then
          i_q_now <= moved_2;
        end if;
        hold_q <= by_voltage or regulates or (hold_q and past_2);
      end if;
      if valid(6) = '1' then
        omega_now  <= moved_2 when by_speed = '1' else omega_me;
        hold_omega <= not by_speed or (hold_omega and past_2);
      end if;
      if run = '0' and (or valid(2 to 6)) = '1' then
        u_d_now    <= (others => '0');
        u_q_now    <= (others => '0');
        i_d_now    <= (others => '0');
        i_q_now    <= (others => '0');
        omega_now  <= (others => '0');
        hold_d     <= '0';
        hold_q     <= '0';
        hold_omega <= '0';
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        u_d_now             <= (others => '0');
        u_q_now             <= (others => '0');
        i_d_now             <= (others => '0');
        i_q_now             <= (others => '0');
        omega_now           <= (others => '0');
        hold_d              <= '0';
        hold_q              <= '0';
        hold_omega          <= '0';
        u_rest_d            <= (others => '0');
        u_rest_q            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
