# SPDX-License-Identifier: BSD-3-Clause
"""Duties to compare values of the carrier: compare = duty * CARRIER_HALF, short pulses dropped.

A leg is high for 2*compare clocks in the middle of a period and low for CARRIER_HALF - compare at either
end.  A high pulse shorter than ``min_pulse`` clocks is dropped: compare becomes 0.  A low end shorter
than ``min_pulse`` is closed: compare becomes CARRIER_HALF; each end counts alone, because the period
before or after may be high throughout.  With ``double_update`` the halves of a period have compare values of their own,
so each half of the high pulse counts alone too: compare < ``min_pulse`` becomes 0.

Rounding: half up to whole clocks.  No overflow: duty <= 1, so compare <= CARRIER_HALF.
The three values change together, so the carrier can never load a mixture of two samples.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up
from golden_model.formats import BIT, DUTY, DUTY_ONE
from golden_model.kernel import kernel

COUNT = Format(0, 16, 0)
CLOCKS = Format(0, 12, 0)
DROP = DUTY.frac_bits


@kernel
def leg(duty, min_pulse, double_update, carrier_half):
    compare = round_half_up(duty * carrier_half, DROP)
    longest = carrier_half - min_pulse
    shortest = 2 * min_pulse if double_update else min_pulse
    if 2 * compare < shortest:
        return 0
    if compare > longest:
        return carrier_half
    return compare


@kernel
def step(duty_a, duty_b, duty_c, min_pulse, double_update, carrier_half):
    compare_a = leg(duty_a, min_pulse, double_update, carrier_half)
    compare_b = leg(duty_b, min_pulse, double_update, carrier_half)
    compare_c = leg(duty_c, min_pulse, double_update, carrier_half)
    return compare_a, compare_b, compare_c


def reference(v, _state):
    """The exact product, without the minimum pulse, which has no real-number counterpart."""
    if v["min_pulse"] > 0:
        return {}
    return {f"compare_{k}": v[f"duty_{k}"] * v["CARRIER_HALF"] for k in "abc"}


def bound(_v, _state):
    return {f"compare_{k}": 0.5 for k in "abc"}


def stimuli(_rng, config):
    """Duties whose pulses are at the minimum, one clock shorter, one longer; 0 % and 100 %."""
    half = config["CARRIER_HALF"]
    rows = []
    for pulse in (0, 1, 2, 20, 21):
        for clocks in (
            0,
            1,
            pulse // 2 - 1,
            pulse // 2,
            pulse // 2 + 1,
            pulse - 1,
            pulse + 1,
            half // 2,
            half - pulse - 1,
            half - pulse,
            half - 1,
            half,
        ):
            duty = min(max(clocks * DUTY_ONE // half, 0), DUTY_ONE)
            duties = {"duty_a": duty, "duty_b": DUTY_ONE - duty, "duty_c": duty}
            rows += [duties | {"min_pulse": pulse, "double_update": double} for double in (0, 1)]
    return rows


BLOCK = Block(
    name="pwm_compare",
    folder="modulation",
    paper="001, section 5.2, IGBT pulse generation",
    step=step,
    inputs=tuple(Port(f"duty_{k}", DUTY, hi=DUTY_ONE, doc=f"duty, leg {k}") for k in "abc"),
    registers=(
        Port("min_pulse", CLOCKS, doc="shortest pulse of a leg, clocks"),
        Port("double_update", BIT, doc="1: sample and update at the peak too; taken while the gates are off"),
    ),
    outputs=tuple(Port(f"compare_{k}", COUNT, doc=f"compare value, leg {k}") for k in "abc"),
    latency=7,
    interval=3,
    atomic=True,
    constants={"DROP": DROP},
    configs=({"CARRIER_HALF": 10000}, {"CARRIER_HALF": 100}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
