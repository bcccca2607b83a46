# SPDX-License-Identifier: BSD-3-Clause
"""The part of the core that runs at every clock, wired as in rtl/fluxproof.vhd and rtl/io/protection.vhd.

Sample guard, host watch, fault latch, bootstrap charge, gates and the pin of the brake resistor.
One step is one clock; ``State`` holds the blocks' states and the registers between them.  The values of a sample come
from fluxproof.step.  They are valid as many clocks after the clock at which the sample entered as ``DUE`` says, from
the following step on.
"""

from typing import NamedTuple

from golden_model import fluxproof
from golden_model.io import fault_latch, host_watch, sample_guard
from golden_model.io.sample_guard import AGE_W
from golden_model.kernel import kernel
from golden_model.modulation import bootstrap_charge, gate_generation

INTERVAL = fluxproof.SAMPLE_INTERVAL
# clocks after a sample entered -> its values that are valid then
DUE = {
    name: (fluxproof.schedule()[name][1], fluxproof.outputs_of(name))
    for name in ("checks", "chopper", "zero_check", "motion", "emf", "load", "compare")
} | {"residual": (fluxproof.schedule()["residual"][1], ("motor_differs",))}
CHECKS_CLOCKS = DUE["checks"][0]


class State(NamedTuple):
    of_sample_guard: sample_guard.State = sample_guard.State()
    of_host_watch: host_watch.State = host_watch.State()
    of_fault_latch: fault_latch.State = fault_latch.State()
    of_gate_generation: gate_generation.State = gate_generation.State()
    of_bootstrap_charge: bootstrap_charge.State = bootstrap_charge.State()
    # Outputs that the next clock reads
    sample_busy: int = 0
    sample_early: int = 0
    sample_late: int = 0
    host_lost: int = 0
    period: int = 0
    fault_stop: int = 0
    gate_clear: int = 0
    gates_on: int = 0
    charging: int = 0


class Inputs(NamedTuple):
    """Inputs of one clock: the core's inputs and the results of the sample in flight."""

    sample_valid: int = 0
    enable: int = 0
    trip: int = 0
    clear_trip: int = 0
    host_write: int = 0
    sample_faults: int = 0
    sample_trip: int = 0
    current_offset: int = 0
    motion_faults: int = 0
    open_load: int = 0
    encoder_lost: int = 0
    motor_differs: int = 0  # read by interrupts, beside the core
    brake_asked: int = 0
    compare_a: int = 0
    compare_b: int = 0
    compare_c: int = 0


class Seen(NamedTuple):
    """Outputs of the core after a clock, by the names of its ports."""

    gate_high: int
    gate_low: int
    sample_trigger: int
    running: int
    tripped: int
    fault_flags: int
    first_fault: int
    early_samples: int
    setting_refused: int
    brake: int


@kernel
def step(state, inputs, regs, carrier_half):
    """One clock: (next state, whether a sample has entered at it, Seen)."""
    s, x, r = state, inputs, regs
    guard_state, (sample_busy, sample_early, sample_late, early_samples) = sample_guard.step(
        s.of_sample_guard, x.sample_valid, x.clear_trip, r.watchdog, INTERVAL, AGE_W
    )
    entered = 1 if x.sample_valid and not s.sample_busy else 0

    host_state, (host_lost,) = host_watch.step(s.of_host_watch, x.host_write, s.period, r.heartbeat)
    latch_state, (fault_flags, first_fault, fault_stop, gate_clear) = fault_latch.step(
        s.of_fault_latch,
        fault_latch.Inputs(
            trip=x.trip, sample_faults=x.sample_faults, sample_late=s.sample_late, sample_early=s.sample_early,
            motion_faults=x.motion_faults, open_load=x.open_load, current_offset=x.current_offset,
            host_lost=s.host_lost, encoder_lost=x.encoder_lost, enable=x.enable, clear_trip=x.clear_trip,
        ),
        fault_latch.Registers(fault_ignore=r.fault_ignore),
    )  # fmt: skip
    gate_trip = 1 if x.trip or s.fault_stop or (x.sample_trip and x.enable) else 0

    charge_state, (charging, charged) = bootstrap_charge.step(
        s.of_bootstrap_charge, s.gates_on, s.period, r.charge_samples
    )
    gate_state, (gate_high, gate_low, sample_trigger, gates_on, tripped, setting_refused, _, _, _) = (
        gate_generation.step(
            s.of_gate_generation,
            0 if s.charging else x.compare_a,
            0 if s.charging else x.compare_b,
            0 if s.charging else x.compare_c,
            x.enable,
            gate_trip,
            s.gate_clear,
            r.dead_time,
            r.min_pulse,
            r.double_update,
            carrier_half,
        )
    )
    following = State(
        of_sample_guard=guard_state,
        of_host_watch=host_state,
        of_fault_latch=latch_state,
        of_gate_generation=gate_state,
        of_bootstrap_charge=charge_state,
        sample_busy=sample_busy,
        sample_early=sample_early,
        sample_late=sample_late,
        host_lost=host_lost,
        period=sample_trigger,
        fault_stop=fault_stop,
        gate_clear=gate_clear,
        gates_on=gates_on,
        charging=charging,
    )
    seen = Seen(
        gate_high=gate_high,
        gate_low=gate_low,
        sample_trigger=sample_trigger,
        running=1 if gates_on and charged else 0,
        tripped=tripped,
        fault_flags=fault_flags,
        first_fault=first_fault,
        early_samples=early_samples,
        setting_refused=setting_refused,
        brake=1 if x.brake_asked and not s.sample_late else 0,
    )
    return following, entered, seen
