# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the gates, for any inputs at any clock."""

from __future__ import annotations

from golden_model.modulation import pwm_compare
from scripts.prove.proof import Fault, Proof, committed

GATES = "modulation/gate_generation.vhd"
COMPARE = "modulation/pwm_compare.vhd"
BOOTSTRAP = "modulation/bootstrap_charge.vhd"
SPIES = ("state",)
FULL = {"CARRIER_HALF": 10000}  # 200 MHz, 10 kHz: the default of the core
SMALL = {"CARRIER_HALF": 8}  # a period of 16 clocks, so that a search sees several
SEVERAL_PERIODS = 48


def gate_proof(name: str, says: str, macro: str, *faults: Fault, **more) -> Proof:
    return Proof(
        name=f"gates_{name}",
        says=says,
        entity="gate_generation",
        harness=committed("gate_generation.sv"),
        faults=faults,
        generics=FULL,
        macros=(macro,),
        spies=SPIES,
        search_generics=SMALL,
        search_depth=SEVERAL_PERIODS,
        **more,
    )


def compare_proof(name: str, says: str, macro: str, *faults: Fault, method: str = "pdr") -> Proof:
    block = pwm_compare.BLOCK
    return Proof(
        name=name,
        says=says,
        entity=block.name,
        harness=committed("pwm_compare.sv"),
        faults=faults,
        method=method,
        depth=block.latency + 2,
        generics=FULL,
        macros=(macro, f"LATENCY={block.latency}", f"INTERVAL={block.interval}"),
        assumed="duties from 0 to 1, samples at their distance, settings constant while a sample is in flight",
        search_depth=3 * block.latency,
    )


def charge_proof(name: str, says: str, macro: str, *faults: Fault, **more) -> Proof:
    return Proof(
        name=f"bootstrap_{name}",
        says=says,
        entity="bootstrap_charge",
        harness=committed("bootstrap_charge.sv"),
        faults=faults,
        macros=(macro,),
        method="pdr",
        **more,
    )


PROOFS = (
    gate_proof(
        "never_both",
        "both gates of a leg are never on",
        "NEVER_BOTH",
        Fault(
            "low gate on with the high gate",
            GATES,
            "gate_low(k)      <= not state.level(k);",
            "gate_low(k)      <= '1';",
        ),
    ),
    gate_proof(
        "dead_time",
        "between two gates of a leg both are off for the dead time in force, also while the register changes",
        "DEAD_TIME",
        Fault(
            "dead time one short",
            GATES,
            "state.elapsed(k) < state.dead_time",
            "state.elapsed(k) + 1 < state.dead_time",
        ),
        Fault(
            "no dead time after enable",
            GATES,
            "state.elapsed(k) <= (others => '0');",
            "state.elapsed(k) <= SETTLED;",
        ),
        Fault("dead time counted from two", GATES, "to_unsigned(1, 12)", "to_unsigned(2, 12)"),
    ),
    gate_proof(
        "release",
        "gates that switch stop at enable = 0 or a trip alone: a torque released above base speed leaves them on",
        "RELEASE",
        Fault(
            "stopped by a refused setting",
            GATES,
            "state.running    <= enable and configured and not tripped_0;",
            "state.running    <= enable and configured and good and not tripped_0;",
        ),
    ),
    gate_proof(
        "trip_off",
        "every gate is off one clock after trip",
        "TRIP_OFF",
        Fault(
            "trip waits for the valley",
            GATES,
            "state.running and enable and not trip;",
            "state.running and enable;",
        ),
    ),
    gate_proof(
        "trip_held",
        "after a trip the gates stay off until clear_trip without trip, then enable at a valley",
        "TRIP_HELD",
        Fault("trip not latched", GATES, "trip or (state.tripped and not clear_trip)", "trip"),
        Fault(
            "trip cleared while it lasts",
            GATES,
            "trip or (state.tripped and not clear_trip)",
            "(trip or state.tripped) and not clear_trip",
        ),
        Fault(
            "on again before the valley",
            GATES,
            "      state.running   <= on_0;",
            "      state.running   <= state.running and not tripped_0;",
        ),
    ),
    gate_proof(
        "enable_off",
        "every gate is off one clock after enable falls",
        "ENABLE_OFF",
        Fault(
            "enable drops at the valley",
            GATES,
            "state.running and enable and not trip;",
            "state.running and not trip;",
        ),
    ),
    gate_proof(
        "duty_at_the_valley",
        "a gate follows the compare value of the last valley, with double_update of the last extreme, and no later one",
        "AT_THE_VALLEY",
        Fault("duty taken at once", GATES, "+ state.compare(k)", "+ compare_a"),
        Fault(
            "duty taken at the peak too",
            GATES,
            "(peak and state.double_update)",
            "peak",
        ),
    ),
    gate_proof(
        "settings",
        "dead time and minimum pulse change at the valley, never to contradicting ones, double_update while the gates "
        "are off; no gate is on before",
        "SETTINGS",
        Fault(
            "contradiction accepted",
            GATES,
            "dead_time < min_pulse",
            "dead_time <= min_pulse",
        ),
        Fault(
            "runs unconfigured",
            GATES,
            "enable and configured and not tripped_0",
            "enable and not tripped_0",
        ),
        Fault("long minimum pulse accepted", GATES, " and resize(min_pulse, 16) <= CARRIER_HALF else", " else"),
    ),
    gate_proof(
        "stays_on",
        "a gate that is on goes off only when the command of its leg changes, or by trip, enable or reset",
        "STAYS_ON",
        # Low gate: the high gate is on at the valley only after half a period, beyond the depth of the search.
        Fault(
            "gate off when the dead time grows",
            GATES,
            "state.elapsed(k) <= SETTLED;",
            "state.elapsed(k) <= state.dead_time;",
        ),
    ),
    gate_proof(
        "minimum_pulse",
        "a gate that is on stays on for at least min_pulse - dead_time, unless trip, enable or reset end it",
        "GATE_PULSE",
        Fault("dead time one too long", GATES, "state.elapsed(k) < state.dead", "state.elapsed(k) <= state.dead"),
        Fault(
            "duty taken at the peak too",
            GATES,
            "(peak and state.double_update)",
            "peak",
        ),
        patience=600,
        assumed="the loaded compare values respect the minimum pulse loaded with them (see minimum_pulse_asked)",
    ),
    compare_proof(
        "minimum_pulse_asked",
        "no compare value commands a pulse or a low end of a period shorter than min_pulse",
        "MINIMUM",
        Fault(
            "minimum pulse one short",
            COMPARE,
            "signed(resize(HALF, 18)) - signed",
            "signed(resize(HALF, 18)) + 1 - signed",
        ),
        Fault(
            "pulses dropped by half their length",
            COMPARE,
            "(compare_3 & '0') < shortest",
            "('0' & compare_3(15 downto 1)) + 1 < shortest(12 downto 3)",
        ),
        Fault("half pulses as short as whole ones", COMPARE, "min_pulse & '0' when double_update = '1' else ", ""),
        method="induction",
    ),
    compare_proof(
        "compare_together",
        "the three compare values change together, with out_valid and at no other clock",
        "TOGETHER",
        Fault(
            "compare values in two steps",
            COMPARE,
            "        kept_a_5 <= dropped_4;",
            "        kept_a_5 <= dropped_4;\n        compare_a <= dropped_4;",
        ),
    ),
    charge_proof(
        "exact",
        "the lower switches charge for charge_samples sample times after the gates went on, the drive runs one later",
        "EXACT",
        Fault(
            "a sample time too early",
            BOOTSTRAP,
            "if count >= charge_samples then",
            "if count + 1 >= charge_samples then",
        ),
        Fault("a pause of the gates forgotten", BOOTSTRAP, "        count := (others => '0');", "        null;"),
        assumed="charge_samples below 12 and constant",
        search_depth=40,
    ),
    charge_proof(
        "stays",
        "never charging and charged; no charging in a drive that runs, whatever is written; not charged with gates off",
        "STAYS",
        Fault(
            "a longer time stops the drive",
            BOOTSTRAP,
            "done or (nor charge_samples)",
            "nor charge_samples when count < charge_samples else done",
        ),
        Fault("the running drive charges", BOOTSTRAP, "charging <= not done;", "charging <= '1';"),
        Fault("charged for ever", BOOTSTRAP, "        done  := '0';\n      elsif", "        null;\n      elsif"),
    ),
)
