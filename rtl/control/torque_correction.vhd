-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the correction of the torque table by the estimated torque: a factor, learnt by least mean squares.
--   torque_gain += k_torque*(torque_now - torque)*torque_now    within 1/2..3/2, where run, |omega_me| >= omega_learn,
--                                                               calm and not torque_limited
-- One multiplier makes both products.
-- Formats: torque_gain U(1,28), of which U(1,16) is shown; the error and its product PU.
-- Latency: 6.  Interval: 6.
-- Rounding: the error saturates, its product is floored and saturated, the increment half up.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity torque_correction is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    in_valid       : in  std_logic;
    torque_now     : in  signed(PU_W - 1 downto 0);
    torque         : in  signed(PU_W - 1 downto 0);
    omega_me       : in  signed(PU_W - 1 downto 0);
    torque_limited : in  std_logic;
    calm           : in  std_logic;
    run            : in  std_logic;
    k_torque       : in  unsigned(KI_W - 1 downto 0);
    omega_learn    : in  signed(PU_W - 1 downto 0);
    out_valid      : out std_logic;
    torque_gain    : out unsigned(16 downto 0)
  );
end entity torque_correction;

architecture rtl of torque_correction is
  constant LATENCY : positive := TORQUE_CORRECTION_LATENCY;
  constant GAIN_W  : positive := 29;
  constant DROP    : positive := TORQUE_CORRECTION_DROP_STEP;
  constant MOVED_W : positive := KI_W + 2 + PU_W - DROP;

  constant ONE      : unsigned(GAIN_W - 1 downto 0) := (GAIN_W - 1 => '1', others => '0');
  constant GAIN_MIN : unsigned(GAIN_W - 1 downto 0) := shift_right(ONE, 1);
  constant GAIN_MAX : unsigned(GAIN_W - 1 downto 0) := ONE + GAIN_MIN;

  type state_t is record
    torque_gain : unsigned(GAIN_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal x      : signed(KI_W downto 0);
  signal y      : signed(PU_W - 1 downto 0);
  signal p      : signed(KI_W + PU_W downto 0);
  signal learns : std_logic;
  signal moved  : signed(MOVED_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
    variable error  : signed(PU_W - 1 downto 0);
    variable slower : signed(PU_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      p <= x * y;

      -- Stages 1, 2: (torque_now - torque)*torque_now;  whether it learns
      error  := saturate(resize(torque_now, PU_W + 1) - torque, PU_W);
      slower := signed(resize(magnitude(omega_me), PU_W + 1)) - omega_learn;
      if valid(0) = '1' then
        x      <= resize(error, x'length);
        y      <= torque_now;
        learns <= run and calm and not torque_limited and not slower(PU_W);
      end if;

      -- Stages 3, 4: k_torque times the product, narrowed
      if valid(2) = '1' then
        x <= signed('0' & k_torque);
        y <= saturate(shift_right(p, 16), PU_W);
      end if;

      -- Stage 5: moved = torque_gain + k_torque*...;  stage 6: torque_gain, limited
      if valid(4) = '1' then
        moved <= plus_rounded(resize(signed('0' & state.torque_gain), MOVED_W), p, DROP);
      end if;
      if valid(5) = '1' and learns = '1' then
        state.torque_gain <= unsigned(moved(GAIN_W - 1 downto 0));
        if moved(MOVED_W - 1) = '1' or moved(MOVED_W - 1 downto GAIN_W - 2) = 0 then
          state.torque_gain <= GAIN_MIN;
        elsif moved(MOVED_W - 1 downto GAIN_W) /= 0 or moved(GAIN_W - 1 downto GAIN_W - 2) = "11" then
          state.torque_gain <= GAIN_MAX;
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.torque_gain   <= ONE;
      end if;
    end if;
  end process;

  torque_gain <= state.torque_gain(GAIN_W - 1 downto GAIN_W - 17);
  out_valid   <= valid(LATENCY);

end architecture rtl;
