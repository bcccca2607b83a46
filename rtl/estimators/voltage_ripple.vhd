-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: flux linkage of the ripple that over-modulation adds to the voltage asked for.
--   du    = u_applied - u of the last sample
--   mean += (park(du) - mean)/16                           rotor frame
--   rip  += t_s*(du - inverse_park(mean)) - rip/8          stator frame;  zero with run or voltage_known = 0
-- Formats: du, rotated PU, limited to 1.375; mean S(1,22); rip S(-2,23), PU out.
-- Latency: 11.  Interval: 11.
-- One rotation turns the mean, then du the other way.
-- Rounding: half up.  Saturation: rip at a quarter per unit.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity voltage_ripple is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    u_applied_alpha : in  signed(FLUX_W - 1 downto 0);
    u_applied_beta  : in  signed(FLUX_W - 1 downto 0);
    voltage_known   : in  std_logic;
    u_alpha         : in  signed(PU_W - 1 downto 0);
    u_beta          : in  signed(PU_W - 1 downto 0);
    cos_theta       : in  signed(TRIG_W - 1 downto 0);
    sin_theta       : in  signed(TRIG_W - 1 downto 0);
    run             : in  std_logic;
    t_s             : in  unsigned(SAMPLE_TIME_W - 1 downto 0);
    out_valid       : out std_logic;
    rip_alpha       : out signed(PU_W - 1 downto 0);
    rip_beta        : out signed(PU_W - 1 downto 0)
  );
end entity voltage_ripple;

architecture rtl of voltage_ripple is
  constant LATENCY  : positive := VOLTAGE_RIPPLE_LATENCY;
  constant MEAN_W   : positive := VOLTAGE_RIPPLE_MEAN_W;
  constant RIPPLE_W : positive := VOLTAGE_RIPPLE_RIPPLE_W;
  constant DU_W     : positive := PU_W + 2;
  constant SHOWN    : positive := VOLTAGE_RIPPLE_SHOWN;

  type state_t is record
    mean_d    : signed(MEAN_W - 1 downto 0);
    mean_q    : signed(MEAN_W - 1 downto 0);
    rip_alpha : signed(RIPPLE_W - 1 downto 0);
    rip_beta  : signed(RIPPLE_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid        : std_logic_vector(0 to LATENCY);
  signal du_alpha_1   : signed(PU_W - 1 downto 0);
  signal du_beta_1    : signed(PU_W - 1 downto 0);
  signal turns_mean   : std_logic;
  signal rotate_start : std_logic;
  signal first        : signed(PU_W - 1 downto 0);
  signal second       : signed(PU_W - 1 downto 0);
  signal out_x        : signed(PU_W - 1 downto 0);  -- mean_alpha, then du_q
  signal out_y        : signed(PU_W - 1 downto 0);  -- mean_beta, then du_d
  signal part_6       : signed(DU_W - 1 downto 0);
  signal part_beta_6  : signed(DU_W - 1 downto 0);
  signal left_6       : signed(RIPPLE_W - 1 downto 0);
  signal left_beta_6  : signed(RIPPLE_W - 1 downto 0);
  signal sample_time  : signed(SAMPLE_TIME_W downto 0);
  signal increased    : signed(RIPPLE_W - 1 downto 0);
  signal rip_alpha_10 : signed(RIPPLE_W - 1 downto 0);

  -- Within what a rotation takes
  function limited (x : signed) return signed is
    constant HIGH : signed(x'length - 1 downto 0) := to_signed(VOLTAGE_RIPPLE_VECTOR - 1, x'length);
    constant LOW  : signed(x'length - 1 downto 0) := to_signed(-VOLTAGE_RIPPLE_VECTOR, x'length);
  begin
    return resize(clamp(x, LOW, HIGH), PU_W);
  end function;

  function apart (applied : signed; u : signed) return signed is
  begin
    return limited(resize(round_half_up(applied, PU_TO_FLUX), DU_W) - u);
  end function;

  function mean_of (mean : signed; du : signed) return signed is
    constant AWAY : signed(MEAN_W downto 0) := shift_left(resize(limited(du), MEAN_W + 1), SHOWN) - mean;
  begin
    return resize(mean + round_half_up(AWAY, VOLTAGE_RIPPLE_FADE_MEAN), MEAN_W);
  end function;
begin
  valid(0) <= in_valid;

  -- Stages 1 to 5: the mean to the stator frame;  stages 6 to 10: du to the rotor frame, its axes exchanged
  turns_mean   <= valid(0) or valid(1) or valid(2) or valid(3);
  rotate_start <= valid(0) or valid(5);
  first        <= resize(round_half_up(state.mean_d, SHOWN), PU_W) when turns_mean = '1' else du_beta_1;
  second       <= resize(round_half_up(state.mean_q, SHOWN), PU_W) when turns_mean = '1' else du_alpha_1;

  rotation : entity work.rotate
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => rotate_start,
      x         => first,
      y         => second,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_soon  => open,
      out_valid => open,
      out_x     => out_x,
      out_y     => out_y
    );

  sample_time <= signed('0' & t_s);

  -- Stages 7 to 9, 8 to 10: rip of alpha, then of beta
  increase : entity work.multiply_add
    generic map (DROP => VOLTAGE_RIPPLE_DROP)
    port map (
      clk     => clk,
      a       => sample_time,
      b       => part_6,
      c       => left_6,
      y       => increased,
      limited => open
    );

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: du = u_applied - u of the last sample
      if valid(0) = '1' then
        du_alpha_1 <= apart(u_applied_alpha, u_alpha);
        du_beta_1  <= apart(u_applied_beta, u_beta);
      end if;

      -- Stage 6: du - mean of both axes, rip less its eighth;  stage 7: beta follows alpha
      part_6 <= part_beta_6;
      left_6 <= left_beta_6;
      if valid(5) = '1' then
        part_6      <= resize(du_alpha_1, DU_W) - out_x;
        part_beta_6 <= resize(du_beta_1, DU_W) - out_y;
        left_6      <= resize(state.rip_alpha - round_half_up(state.rip_alpha, VOLTAGE_RIPPLE_FADE), RIPPLE_W);
        left_beta_6 <= resize(state.rip_beta - round_half_up(state.rip_beta, VOLTAGE_RIPPLE_FADE), RIPPLE_W);
      end if;

      -- Stage 10: rip of alpha, beside that of beta
      rip_alpha_10 <= increased;

      -- Stage 11: the new mean and rip
      if valid(LATENCY - 1) = '1' then
        state.mean_d    <= mean_of(state.mean_d, out_y);
        state.mean_q    <= mean_of(state.mean_q, out_x);
        state.rip_alpha <= rip_alpha_10;
        state.rip_beta  <= increased;
        if run = '0' or voltage_known = '0' then
          state <= (others => (others => '0'));
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.mean_d        <= (others => '0');
        state.mean_q        <= (others => '0');
        state.rip_alpha     <= (others => '0');
        state.rip_beta      <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);
  rip_alpha <= resize(round_half_up(state.rip_alpha, VOLTAGE_RIPPLE_TO_PU), PU_W);
  rip_beta  <= resize(round_half_up(state.rip_beta, VOLTAGE_RIPPLE_TO_PU), PU_W);

end architecture rtl;
