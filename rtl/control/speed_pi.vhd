-- Purpose: speed regulator, from speed error to i_q reference, limited, with conditional integration.
--   err = omega_ref - omega_me;  u = speed_kp*err + integral;  i_q_ref = limit(u, +-i_max)
--   integral += speed_ki*err unless u is beyond the limit and err pushes further
-- Torque mode (speed_mode = 0): i_q_ref is i_q_ext, limited, and the integral follows it.
-- run = 0: output and integral are zero.
-- Two beats through one comparison with i_max: what is asked for, then the integral.  |v| = (v xor s) + s, s its sign.
-- Formats: err PU, proportional part 28 fraction bits, integral S(1,28), output PU.
-- Latency: 6; the integral follows a clock later.  Interval: 6.  Rounding: half up; err saturates; the proportional part needs no limit of its own, as
-- what it asks for beyond i_max is cut anyway, and the increment none, as speed_ki < 1; the integral is kept within
-- +-i_max.

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
  constant SUM_W   : positive := PU_W + KP_W + 2;
  constant TOTAL_W : positive := SUM_W - SPEED_PI_DROP_P - PU_TO_INTEGRAL;

  -- State
  signal integral : signed(INTEGRAL_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal err_1      : signed(PU_W - 1 downto 0);
  signal prod_p_2   : signed(PU_W + KP_W downto 0);
  signal prod_i_2   : signed(PU_W + KI_W downto 0);
  signal integral_2 : signed(INTEGRAL_W downto 0);
  signal rises_2    : std_logic;
  signal falls_2    : std_logic;
  signal sum_p_3    : signed(SUM_W - 1 downto 0);
  signal sum_i_3    : signed(PU_W + KI_W downto 0);
  signal total_3    : signed(TOTAL_W - 1 downto 0);
  signal moved_3    : signed(INTEGRAL_W downto 0);
  signal v_3        : signed(PU_W downto 0);
  signal far_3      : std_logic;
  signal v_4        : signed(PU_W downto 0);
  signal far_4      : std_logic;
  signal room_4     : signed(PU_W + 1 downto 0);
  signal v_5        : signed(PU_W downto 0);
  signal beyond_5   : std_logic;
  signal limited_5  : signed(PU_W - 1 downto 0);
  signal held_6     : std_logic;
  signal whole_6    : std_logic;
begin
  valid(0) <= in_valid;

  total_3 <= sum_p_3(SUM_W - 1 downto SUM_W - TOTAL_W);
  moved_3 <= sum_i_3(SPEED_PI_DROP_I + INTEGRAL_W downto SPEED_PI_DROP_I);

  -- The beat's value in PU, one bit more where it may be beyond: the current asked for, then the integral; far: bits
  -- above those say that the current is beyond any limit, and only its sign counts
  v_3   <= resize(i_q_ext, PU_W + 1) when speed_mode = '0' else
           moved_3(INTEGRAL_W downto PU_TO_INTEGRAL) when valid(4) = '1' else
           total_3(TOTAL_W - 1) & total_3(PU_W - 1 downto 0);
  far_3 <= exceeds(total_3, PU_W + 1) and speed_mode and not valid(4);

  -- room = i_max - |v|, less one for an integral above zero, whose bits below v count too; nothing of v where it is far
  -- beyond but a one that makes it so, nothing at all while not running
  process (all)
    variable minus : signed(PU_W downto 0);
    variable carry : std_logic;
  begin
    minus := v_4 xor (PU_W downto 0 => not v_4(v_4'high));
    carry := not v_4(v_4'high) and not valid(5);
    if far_4 = '1' then
      minus := (PU_W => '1', others => '0');
    end if;
    if run = '0' then
      minus := (others => '0');
    end if;
    room_4 <= (resize(i_max, PU_W + 1) & '1') + (minus & carry);
  end process;

  -- v within +-i_max
  process (all)
    variable within : signed(PU_W - 1 downto 0);
  begin
    within := v_5(PU_W - 1 downto 0);
    if beyond_5 = '1' then
      within := i_max xor (within'range => v_5(v_5'high));
    end if;
    limited_5 <= plus_carry(within, beyond_5 and v_5(v_5'high));
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: err = omega_ref - omega_me
      if valid(0) = '1' then
        err_1 <= saturate(resize(omega_ref, PU_W + 1) - resize(omega_me, PU_W + 1), PU_W);
      end if;

      -- Stage 2: prod_p = speed_kp*err, prod_i = speed_ki*err;  the integral and half an LSB of the output
      if valid(1) = '1' then
        prod_p_2   <= err_1 * signed('0' & speed_kp);
        prod_i_2   <= err_1 * signed('0' & speed_ki);
        integral_2 <= integral + half(PU_TO_INTEGRAL, INTEGRAL_W + 1);
        rises_2    <= '1' when err_1 > 0 else '0';
        falls_2    <= err_1(err_1'high);
      end if;

      -- Stage 3: total = proportional + integral;  moved = integral + increment;  both with half an LSB to round with
      if valid(2) = '1' then
        sum_p_3 <= resize(prod_p_2, SUM_W) + (integral_2 & half(SPEED_PI_DROP_P, SPEED_PI_DROP_P));
        sum_i_3 <= prod_i_2 + (integral & half(SPEED_PI_DROP_I, SPEED_PI_DROP_I));
      end if;

      -- Stages 4, 5: what is asked for, then the integral
      if valid(3) = '1' or valid(4) = '1' then
        v_4   <= v_3;
        far_4 <= far_3;
      end if;

      -- Stages 5, 6: v against i_max
      if valid(4) = '1' or valid(5) = '1' then
        v_5      <= v_4 and (v_4'range => run);
        beyond_5 <= room_4(room_4'high);
      end if;

      -- Stage 6: i_q_ref = limit(total or i_q_ext)
      if valid(5) = '1' then
        i_q_ref       <= limited_5;
        speed_limited <= beyond_5;
        held_6        <= speed_mode and beyond_5 and ((rises_2 and not v_5(v_5'high)) or (falls_2 and v_5(v_5'high)));
        whole_6       <= not speed_mode or not run;
      end if;

      -- Stage 7: integral = moved, limited, unless held
      if valid(6) = '1' and held_6 = '0' then
        integral <= limited_5 & moved_3(PU_TO_INTEGRAL - 1 downto 0);
        if whole_6 = '1' or beyond_5 = '1' then
          integral(PU_TO_INTEGRAL - 1 downto 0) <= (others => '0');
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
