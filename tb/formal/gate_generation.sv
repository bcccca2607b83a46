// SPDX-License-Identifier: BSD-3-Clause
// What the gates promise, around the converted entity gate_generation and through its ports alone.
// The harness keeps its own idea of the valley, of the settings in force and of what a leg was asked for.
// `leg` is any of the three legs: the solver chooses, so a proof holds for all.
// One property at a time: the macro of its name is defined when this file is read.  LEMMAS ties the harness's
// registers to those of the entity (the spy_ ports) so that induction gets along with two clocks; the lemmas are
// proved together with the property, and a planted fault faces the property without them.

`ifndef CARRIER_HALF
  `define CARRIER_HALF 10000
`endif

module formal_top (
    input        clk,
    input        rst,
    input [15:0] compare_a,
    input [15:0] compare_b,
    input [15:0] compare_c,
    input        enable,
    input        trip,
    input        clear_trip,
    input [11:0] dead_time,
    input [11:0] min_pulse,
    input        double_update
);
  localparam [16:0] HALF = `CARRIER_HALF;  // sized: the solver's arithmetic is as wide as this

  wire [ 2:0] gate_high;
  wire [ 2:0] gate_low;
  wire        sample;
  wire        running;
  wire        tripped;
  wire        setting_refused;
  wire [11:0] min_pulse_used;
  wire        double_used;
  wire [15:0] carrier;
`ifdef LEMMAS
  wire [131:0] spy_state;
`endif

  gate_generation dut (
      .clk(clk),
      .rst(rst),
      .compare_a(compare_a),
      .compare_b(compare_b),
      .compare_c(compare_c),
      .enable(enable),
      .trip(trip),
      .clear_trip(clear_trip),
      .dead_time(dead_time),
      .min_pulse(min_pulse),
      .double_update(double_update),
      .gate_high(gate_high),
      .gate_low(gate_low),
      .sample(sample),
      .running(running),
      .tripped(tripped),
      .setting_refused(setting_refused),
      .min_pulse_used(min_pulse_used),
      .double_used(double_used),
      .carrier(carrier)
`ifdef LEMMAS
      ,
      .spy_state(spy_state)
`endif
  );

  // The first clock is a reset; afterwards rst is an input like any other.
  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  (* anyconst *) wire [1:0] leg;
  always @* assume (leg < 3);
  wire high = leg == 0 ? gate_high[0] : leg == 1 ? gate_high[1] : gate_high[2];
  wire low = leg == 0 ? gate_low[0] : leg == 1 ? gate_low[1] : gate_low[2];
  wire [15:0] asked = leg == 0 ? compare_a : leg == 1 ? compare_b : compare_c;

  // The valley: the carrier has come down to 0 and takes new values with the coming edge; the peak: it has come up.
  reg was_one, was_below;
  wire valley = carrier == 0 && was_one;
  wire peak = carrier == HALF - 1 && was_below;
  wire good = dead_time > 0 && dead_time < min_pulse && min_pulse <= HALF;

  reg [15:0] compare;
  reg [11:0] dead_in_force;
  reg [11:0] pulse_in_force;
  reg double_in_force;  // taken while the gates are off
  wire update = valley || (peak && double_in_force);
  reg accepted;
  reg locked;  // by a trip, until it is cleared
  reg allowed;  // enabled at a valley, and nothing against it since
  wire wanted = carrier + {1'b0, compare} >= HALF;

  always @(posedge clk) begin
    was_one   <= carrier == 1;
    was_below <= carrier == HALF - 2;
    if (update) compare <= asked;
    if (!running) double_in_force <= double_update;
    if (valley) begin
      if (good) begin
        dead_in_force  <= dead_time;
        pulse_in_force <= min_pulse;
        accepted       <= 1;
      end
    end
    locked <= trip || (locked && !clear_trip);
    if (valley && !(locked && !clear_trip)) allowed <= 1;
    if (trip || !enable) allowed <= 0;
    if (rst) begin
      was_one        <= 0;
      was_below      <= 0;
      compare        <= 0;
      double_in_force <= 0;
      dead_in_force  <= 0;
      pulse_in_force <= 0;
      accepted       <= 0;
      locked         <= 0;
      allowed        <= 0;
    end
  end

  // The clock before, for what the gates show one register later.
  reg was_high, was_low, was_wanted, was_trip, was_enable, was_cut;
  reg [11:0] dead_before;
  always @(posedge clk) begin
    was_high    <= high;
    was_low     <= low;
    was_wanted  <= wanted;
    was_trip    <= trip;
    was_enable  <= enable;
    was_cut     <= rst || trip || !enable;
    dead_before <= dead_in_force;
  end
  // Clocks for which both gates of the leg have been off, as far as the counter goes.
  reg [11:0] off_time;
  always @(posedge clk) begin
    if (~&off_time) off_time <= off_time + 1;
    if (rst || high || low) off_time <= 0;
  end
  wire rise = (high && !was_high) || (low && !was_low);

`ifdef NEVER_BOTH
  always @(posedge clk) if (begun) begin
    assert (!(high && low));
    cover (high);
    cover (low);
  end
`endif

`ifdef DEAD_TIME
  // The setting in force when the gate was decided on: one that changes counts for a dead time that has begun.
  reg [11:0] dead_long_ago;
  always @(posedge clk) if (high || low) dead_long_ago <= dead_in_force;
  always @(posedge clk) if (begun && rise) begin
    assert (off_time >= dead_before);
    cover (high && off_time == dead_before);
    cover (low && dead_before > dead_long_ago && dead_long_ago != 0);
  end
`endif

`ifdef TRIP_OFF
  always @(posedge clk) if (begun && was_trip) begin
    assert (gate_high == 0 && gate_low == 0);
    cover (was_high);
    cover (was_low);
  end
`endif

`ifdef TRIP_HELD
  reg once_tripped;
  always @(posedge clk) once_tripped <= !rst && (once_tripped || (was_high && locked));
  always @(posedge clk) if (begun) begin
    assert (tripped == locked);
    if (gate_high != 0 || gate_low != 0) assert (allowed);
    cover (once_tripped && high);
    cover (locked && clear_trip && trip);
  end
`endif

`ifdef ENABLE_OFF
  always @(posedge clk) if (begun && !was_enable) begin
    assert (gate_high == 0 && gate_low == 0);
    cover (was_high);
  end
`endif

`ifdef RELEASE
  // Gates that switch stop at enable = 0 or a trip alone: no reference, voltage or setting stops them.
  reg was_running;
  always @(posedge clk) was_running <= running;
  always @(posedge clk) if (begun) begin
    assert (!(running && tripped));
    if (was_running && !was_cut) assert (running);
    cover (was_running && !was_cut && !good && was_one);
  end
`endif

`ifdef AT_THE_VALLEY
  always @(posedge clk) if (begun) begin
    if (high) assert (was_wanted);
    if (low) assert (!was_wanted);
    cover (high && asked != compare && compare < HALF);
    cover (low && asked != compare && compare > 0);
    cover (high && double_in_force && !double_update);
    cover (high && !double_in_force && double_update);
  end
`endif

`ifdef SETTINGS
  always @(posedge clk) if (begun) begin
    assert (min_pulse_used == pulse_in_force && double_used == double_in_force);
    if (high || low) assert (accepted);
    cover (high && setting_refused);
    cover (high && pulse_in_force != min_pulse && !setting_refused);
  end
`endif

`ifdef STAYS_ON
  // Also while the dead time grows, and for longer than the dead time's counter counts.
  reg grown;
  always @(posedge clk) grown <= (high || low) && !rst && (grown || dead_in_force > dead_before);
  always @(posedge clk) if (begun && !was_cut) begin
    if (was_high && was_wanted) assert (high);
    if (was_low && !was_wanted) assert (low);
    cover (was_high && !high);
    cover (low && grown);
  end
`endif

`ifdef GATE_PULSE
  // What pwm_compare sees to: no duty asks for less than the minimum pulse that comes into force with it.
  wire [11:0] pulse_next = valley && good ? min_pulse : pulse_in_force;
  wire double_next = running ? double_in_force : double_update;
  wire [16:0] asked_high = double_next ? asked : {asked, 1'b0};  // with double_update half a pulse counts alone
  wire fits = asked == 0 || asked == HALF || (asked < HALF && asked_high >= pulse_next && HALF - asked >= pulse_next);
  always @* if (begun && update) assume (fits);

  // How long a gate has been on, and the settings when the leg made up its mind.
  reg [11:0] on_time, pulse_then, dead_then, room_before;
  reg was_running;
  wire fall = (was_high && !high) || (was_low && !low);
  always @(posedge clk) begin
    on_time <= !(high || low) ? 0 : &on_time ? on_time : on_time + 1;
    if (wanted != was_wanted || !was_running) begin
      pulse_then <= pulse_in_force;
      dead_then  <= dead_in_force;
    end
    room_before <= pulse_then - dead_then;
    was_running <= running;
    if (rst) {was_running, pulse_then, dead_then, room_before} <= 0;
  end
  always @(posedge clk) if (begun && !was_cut && fall) begin
    assert (on_time >= room_before);
    cover (was_high && on_time == room_before && room_before > 1);
    cover (was_low && on_time == room_before && room_before > 1);
  end
`endif

`ifdef LEMMAS
  // The record `state` of the entity, its last field first; within an array leg a is the uppermost.
  wire [35:0] spy_elapsed;
  wire [ 2:0] spy_level;
  wire        spy_tripped, spy_running, spy_configured, spy_double;
  wire [11:0] spy_min_pulse, spy_dead_time;
  wire [47:0] spy_compare;
  wire        spy_down;
  wire [15:0] spy_carrier;
  assign {spy_elapsed, spy_level, spy_tripped, spy_running, spy_configured, spy_double, spy_min_pulse, spy_dead_time, spy_compare,
          spy_down, spy_carrier} = spy_state;

  wire [15:0] compare_of_leg = leg == 0 ? spy_compare[47:32] : leg == 1 ? spy_compare[31:16] : spy_compare[15:0];
  wire [11:0] elapsed = leg == 0 ? spy_elapsed[35:24] : leg == 1 ? spy_elapsed[23:12] : spy_elapsed[11:0];
  wire level = leg == 0 ? spy_level[0] : leg == 1 ? spy_level[1] : spy_level[2];
  wire settled = high || low;

  always @(posedge clk) if (begun) begin
    // The same valley, the same settings
    assert (carrier == spy_carrier && spy_carrier < HALF);
    if (spy_carrier == 0) assert (spy_down == was_one);
    if (spy_carrier == HALF - 1) assert (spy_down == !was_below);
    assert (double_in_force == spy_double);
    assert (compare == compare_of_leg);
    assert (dead_in_force == spy_dead_time && pulse_in_force == spy_min_pulse);
    assert (accepted == spy_configured);
    assert (running == spy_running);
    assert (tripped == spy_tripped && tripped == locked);
    if (accepted) assert (dead_in_force > 0 && dead_in_force < pulse_in_force && pulse_in_force <= HALF);
    if (running) assert (accepted && allowed && !locked);
    if (high || low) assert (running);
    // A gate is on where the leg has settled, and only there
    assert (settled == (&elapsed));
    assert (high == (settled && level) && low == (settled && !level));
    if (high || low) assert (level == was_wanted && accepted && allowed);
    if (!settled) assert (elapsed <= off_time + 13'd1);
  end

`ifdef GATE_PULSE
  // Where the carrier is in its period, and for how many clocks the leg has wanted what it wants.
  wire [16:0] at = spy_down ? {HALF[15:0], 1'b0} - 17'd1 - spy_carrier : {1'b0, spy_carrier};
  wire on = running && was_running;
  wire own_half = double_in_force && at >= HALF;  // the falling half has a compare value of its own
  reg [15:0] held;
  always @(posedge clk) held <= rst || wanted != was_wanted || !was_running ? 1 : &held ? held : held + 1;

  always @(posedge clk) if (begun) begin
    if (running)
      assert (compare == 0 || compare == HALF
              || (compare < HALF && (double_in_force ? compare : {compare, 1'b0}) >= pulse_in_force
                  && HALF - compare >= pulse_in_force));
    if (running && !was_running) assert (at == 0);
    if (!was_running) assert (elapsed == 0 && !level);
    if (high || low) assert (was_running);
    if (on) begin
      assert (pulse_then > dead_then && dead_then > 0);
      // Since when the leg wants it: from the compare value and the carrier
      if (at == 0 || (double_in_force && at == HALF)) assert (settled && held >= pulse_then);
      if (own_half && was_wanted) assert (held + HALF >= at && (at == HALF || at <= HALF + compare));
      if (at > 0 && was_wanted && !own_half) assert (held + HALF >= at + compare && at > HALF - compare && at <= HALF + compare);
      if (at > 0 && !was_wanted && at > HALF) assert (held + HALF + compare >= at && at > HALF + compare);
      if (at > 0 && !was_wanted && at <= HALF && !own_half) assert (held >= at && at <= HALF - compare);
      assert (held >= pulse_then || (pulse_then == pulse_in_force && dead_then == dead_in_force));
      // What it means for the gate
      assert (level == was_wanted);
      if (!settled) assert (elapsed == held && elapsed <= dead_in_force && dead_then == dead_in_force);
      if (!settled) assert (pulse_then == pulse_in_force);
      if (settled) assert (&on_time || held <= on_time + dead_then + 16'd1);
    end
  end
`endif
`endif
endmodule
