-- Purpose: speed regulator, from speed error to i_q reference, limited, with conditional integration.
--   err = omega_ref - omega_me;  u = speed_kp*err + integral;  i_q_ref = limit(u, +-i_max)
--   integral += speed_ki*err unless u is beyond the limit and err pushes further
-- Torque mode (speed_mode = 0): i_q_ref is i_q_ext, limited, and the integral follows it.
-- run = 0: output and integral are zero.
-- Formats: err PU, proportional part S(3,28), integral S(1,28), output PU.
-- Latency: 5.  Interval: 5.  Rounding: half up; err saturates, the proportional part saturates at 8, far
-- beyond the output's limit; the integral is kept within +-i_max.

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
    speed_mode    : in  std_logic;
    run           : in  std_logic;
    speed_kp      : in  unsigned(KP_W - 1 downto 0);
    speed_ki      : in  unsigned(KI_W - 1 downto 0);
    i_max         : in  signed(PU_W - 1 downto 0);
    out_valid     : out std_logic;
    i_q_ref       : out signed(PU_W - 1 downto 0);
    speed_limited : out std_logic
  );
end entity speed_pi;

architecture rtl of speed_pi is
  constant LATENCY : positive := SPEED_PI_LATENCY;
  constant P_W     : positive := SPEED_PI_PROPORTIONAL_W;
  constant TOTAL_W : positive := P_W + 1 - PU_TO_INTEGRAL + 1;

  -- State
  signal integral : signed(INTEGRAL_W - 1 downto 0);

  signal valid          : std_logic_vector(0 to LATENCY);
  signal err_1          : signed(PU_W - 1 downto 0);
  signal prod_p_2       : signed(PU_W + KP_W downto 0);
  signal prod_i_2       : signed(PU_W + KI_W downto 0);
  signal proportional_3 : signed(P_W - 1 downto 0);
  signal increment_3    : signed(INTEGRAL_W - 1 downto 0);
  signal total_4        : signed(TOTAL_W - 1 downto 0);
  signal moved_4        : signed(INTEGRAL_W downto 0);
  signal asked_4        : signed(TOTAL_W - 1 downto 0);
  signal above_4        : std_logic;
  signal below_4        : std_logic;
  signal limit          : signed(INTEGRAL_W downto 0);
begin
  valid(0) <= in_valid;

  asked_4 <= total_4 when speed_mode = '1' else resize(i_q_ext, TOTAL_W);
  above_4 <= '1' when asked_4 > i_max else '0';
  below_4 <= '1' when asked_4 < -i_max else '0';
  limit   <= shift_left(resize(i_max, INTEGRAL_W + 1), PU_TO_INTEGRAL);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: err = omega_ref - omega_me
      if valid(0) = '1' then
        err_1 <= saturate(resize(omega_ref, PU_W + 1) - resize(omega_me, PU_W + 1), PU_W);
      end if;

      -- Stage 2: prod_p = speed_kp*err, prod_i = speed_ki*err
      if valid(1) = '1' then
        prod_p_2 <= err_1 * signed('0' & speed_kp);
        prod_i_2 <= err_1 * signed('0' & speed_ki);
      end if;

      -- Stage 3: proportional, increment = products, narrowed
      if valid(2) = '1' then
        proportional_3 <= round_sat(prod_p_2, SPEED_PI_DROP_P, P_W);
        increment_3    <= round_sat(prod_i_2, SPEED_PI_DROP_I, INTEGRAL_W);
      end if;

      -- Stage 4: total = proportional + integral;  moved = integral + increment
      if valid(3) = '1' then
        total_4 <= round_half_up(resize(proportional_3, P_W + 1) + integral, PU_TO_INTEGRAL);
        moved_4 <= resize(integral, INTEGRAL_W + 1) + increment_3;
      end if;

      -- Stage 5: i_q_ref = limit(total or i_q_ext);  integral = moved unless held
      if valid(4) = '1' then
        speed_limited <= above_4 or below_4;
        i_q_ref       <= resize(clamp(asked_4, resize(-i_max, TOTAL_W), resize(i_max, TOTAL_W)), PU_W);
        if speed_mode = '0' then
          integral <= resize(shift_left(resize(clamp(i_q_ext, -i_max, i_max), INTEGRAL_W), PU_TO_INTEGRAL), INTEGRAL_W);
        elsif not (above_4 = '1' and err_1 > 0) and not (below_4 = '1' and err_1 < 0) then
          integral <= resize(clamp(moved_4, -limit, limit), INTEGRAL_W);
        end if;
        if run = '0' then
          speed_limited <= '0';
          i_q_ref       <= (others => '0');
          integral      <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        integral            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
