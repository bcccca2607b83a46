-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a position that the host gives, standing or turning, in place of the encoder's: for commissioning.
--   place(k) = forced_angle + travelled(k);  travelled(k) = travelled(k-1) + forced_rate while position_source stays 1
-- The source of a sample is that of its sample strobe.  position_restart: the code has nothing to do with the one
-- before, because the source has changed, forced_angle was moved, or the encoder says so.  With a forced position the
-- speed is that of the code: speed_now is speed_given of the encoder alone.
-- Formats: turns of the shaft; place U(0,32), wraps as angles do; forced_rate in 2**-32 turn a sample.
-- Latency: 1 (every clock is a sample); sample to position_code 2, encoder_code to position_code 1.  Rounding: cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity forced_position is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    encoder_code     : in  unsigned(POSITION_BITS - 1 downto 0);
    encoder_restart  : in  std_logic;
    speed_given      : in  std_logic;
    sample           : in  std_logic;
    position_source  : in  std_logic;
    forced_angle     : in  unsigned(TURN_W - 1 downto 0);
    forced_rate      : in  signed(25 downto 0);
    position_code    : out unsigned(POSITION_BITS - 1 downto 0);
    position_restart : out std_logic;
    speed_now        : out std_logic;
    forced           : out std_logic
  );
end entity forced_position;

architecture rtl of forced_position is
  constant PLACE_W : positive := FORCED_POSITION_PLACE_W;

  type state_t is record
    source    : std_logic;
    angle     : unsigned(TURN_W - 1 downto 0);
    travelled : unsigned(PLACE_W - 1 downto 0);
    jumped    : std_logic;
  end record state_t;

  signal state : state_t;
  signal moved : std_logic;
  signal place : unsigned(PLACE_W - 1 downto 0);
begin
  moved <= '1' when position_source = '1' and forced_angle /= state.angle else '0';
  place <= shift_left(resize(state.angle, PLACE_W), FORCED_POSITION_SHIFT) + state.travelled;

  process (clk)
  begin
    if rising_edge(clk) then
      -- A sample: travelled = travelled + forced_rate;  jumped = the source or the angle is another one
      if sample = '1' then
        state.source    <= position_source;
        state.angle     <= forced_angle;
        state.jumped    <= (position_source xor state.source) or moved;
        state.travelled <= (others => '0');
        if (state.source and position_source) = '1' then
          state.travelled <= state.travelled + unsigned(resize(forced_rate, PLACE_W));
        end if;
      end if;

      -- Every clock: code = place or the encoder's
      position_code    <= encoder_code;
      position_restart <= state.jumped or (encoder_restart and not state.source);
      speed_now        <= speed_given and not state.source;
      if state.source = '1' then
        position_code <= place(PLACE_W - 1 downto PLACE_W - POSITION_BITS);
      end if;

      if rst = '1' then
        state.source     <= '0';
        state.angle      <= (others => '0');
        state.travelled  <= (others => '0');
        state.jumped     <= '0';
        position_code    <= (others => '0');
        position_restart <= '0';
        speed_now        <= '0';
      end if;
    end if;
  end process;

  forced <= state.source;

end architecture rtl;
