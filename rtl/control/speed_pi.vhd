-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: speed regulator, from speed error to i_q reference, limited, with conditional integration.
--   i_q_max is what current_limit leaves beside i_d
--   err = omega_ref - omega_me;  u = speed_kp*err + torque_ff + integral;  i_q_ref = limit(u, +-i_q_max)
--   integral += speed_ki*err unless u is beyond the limit and err pushes further, or the bus voltage limited the braking
--   current of the last sample (regen_limited) and err brakes
-- Torque mode (speed_mode = 0): i_q_ref is i_q_ext, limited, and the integral follows it.
-- take_over = 1, the first sample of speed control or the first two of position control: i_q_ref is i_q_ext once more, and the integral is what
-- makes it so beside the proportional part, within +-i_q_max.
-- run = 0: output and integral are zero.  torque_ff, of a trajectory, acts in speed mode; zero without one.
-- Formats: err PU, proportional part with torque_ff 28 fraction bits, integral S(1,28), output PU.
-- Latency: 5.  Interval: 5.
-- Rounding: half up; err saturates, i_q_ref and the integral are kept within +-i_q_max.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed_pi is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    omega_ref     : in  signed(PU_W - 1 downto 0);
    omega_me      : in  signed(PU_W - 1 downto 0);
    i_q_ext       : in  signed(PU_W - 1 downto 0);
    i_q_max       : in  signed(PU_W - 1 downto 0);
    regen_limited : in  std_logic;
    speed_mode    : in  std_logic;
    take_over     : in  std_logic;
    run           : in  std_logic;
    torque_ff     : in  signed(PU_W - 1 downto 0);
    speed_kp      : in  unsigned(KP_W - 1 downto 0);
    speed_ki      : in  unsigned(KI_W - 1 downto 0);
    out_valid     : out std_logic;
    i_q_ref       : out signed(PU_W - 1 downto 0);
    speed_limited : out std_logic
  );
end entity speed_pi;

architecture rtl of speed_pi is
  constant LATENCY : positive := SPEED_PI_LATENCY;
  constant PROP_W  : positive := SPEED_PI_PROPORTIONAL_W;
  constant TOTAL_W : positive := PROP_W + 2 - PU_TO_INTEGRAL;
  constant LOAD_W  : positive := PROP_W + 1;

  type state_t is record
    integral : signed(INTEGRAL_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid          : std_logic_vector(0 to LATENCY);
  signal by_kp          : signed(KP_W downto 0);
  signal by_ki          : signed(KI_W downto 0);
  signal err_0          : signed(PU_W - 1 downto 0);
  signal fed_forward    : signed(INTEGRAL_W - 1 downto 0);
  signal rises          : std_logic;  -- err > 0, from clock 1 on
  signal falls          : std_logic;
  signal proportional_3 : signed(PROP_W - 1 downto 0);
  signal moved_3        : signed(INTEGRAL_W downto 0);
  signal asked_4        : signed(TOTAL_W - 1 downto 0);
  signal load_4         : signed(LOAD_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  by_kp    <= signed('0' & speed_kp);
  by_ki    <= signed('0' & speed_ki);
  err_0    <= saturate(resize(omega_ref, PU_W + 1) - omega_me, PU_W);

  fed_forward <= shift_left(resize(torque_ff, INTEGRAL_W), PU_TO_INTEGRAL);

  -- Stages 1 to 3: proportional = speed_kp*err + torque_ff;  moved = integral + speed_ki*err
  proportional_part : entity work.multiply_add
    generic map (DROP => SPEED_PI_DROP_P)
    port map (clk => clk, a => by_kp, b => err_0, c => fed_forward, y => proportional_3, limited => open);

  integral_part : entity work.multiply_add
    generic map (DROP => SPEED_PI_DROP_I)
    port map (clk => clk, a => by_ki, b => err_0, c => state.integral, y => moved_3, limited => open);

  process (clk)
    variable wanted : signed(PU_W - 1 downto 0);
    variable past   : std_logic;
    variable brakes : std_logic;
    variable held   : std_logic;
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the direction of err
      rises <= '1' when err_0 > 0 else '0';
      falls <= '1' when err_0 < 0 else '0';

      -- Stage 4: asked = proportional + integral, or i_q_ext in torque mode and at its end;  load = i_q_ext - proportional
      asked_4 <= round_half_up(resize(proportional_3, PROP_W + 1) + state.integral, PU_TO_INTEGRAL);
      load_4  <= shift_left(resize(i_q_ext, LOAD_W), PU_TO_INTEGRAL) - proportional_3;
      if speed_mode = '0' or take_over = '1' then
        asked_4 <= resize(i_q_ext, TOTAL_W);
      end if;

      -- Stage 5: i_q_ref = asked, limited;  integral = moved, limited, unless held, or i_q_ref in torque mode, or load
      wanted := resize(within(asked_4, unsigned(i_q_max), 0), PU_W);
      past   := beyond(asked_4, unsigned(i_q_max), 0);
      brakes := (rises and omega_me(PU_W - 1)) or (falls and not omega_me(PU_W - 1));
      held   := (past and ((rises and not asked_4(TOTAL_W - 1)) or (falls and asked_4(TOTAL_W - 1))))
                or (regen_limited and brakes);
      if valid(LATENCY - 1) = '1' then
        i_q_ref       <= wanted;
        speed_limited <= past;
        if take_over = '1' then
          state.integral <= resize(within(load_4, unsigned(i_q_max), PU_TO_INTEGRAL), INTEGRAL_W);
        elsif speed_mode = '0' then
          state.integral <= shift_left(resize(wanted, INTEGRAL_W), PU_TO_INTEGRAL);
        elsif held = '0' then
          state.integral <= resize(within(moved_3, unsigned(i_q_max), PU_TO_INTEGRAL), INTEGRAL_W);
        end if;
        if run = '0' then
          i_q_ref        <= (others => '0');
          speed_limited  <= '0';
          state.integral <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.integral      <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
