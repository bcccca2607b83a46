# SPDX-License-Identifier: BSD-3-Clause
"""Latches the conditions that disturb the flux estimate, until they are cleared.

One bit per condition, set by a single sample and cleared by ``clear_faults`` unless the condition persists:

    0  a current converter at its end            4  delta_lambda at its range
    1  bus reading at its end or below 1/32      5  compensation at delta_max
    2  current model at its range                6  estimate, or a rotation before it, at its range
    3  merge at its range

The flags have no effect in the core: every limit is a saturation, and the estimate recovers without a reset.
Formats: bits.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

FAULTS = Format(0, 7, 0)
# Of bits 0 to 6, for those who show the flags.
CONDITIONS = (
    "current converter at its end", "bus reading at its end or low", "current model at its range", "merge at its range",
    "delta_lambda at its range", "compensation at its limit", "estimate at its range",
)  # fmt: skip


class State(NamedTuple):
    faults: int = 0


@kernel
def step(
    state, current_at_rail, u_dc_at_rail, u_dc_low, model_limited, merge_limited, delta_limited,
    compensation_limited, estimate_limited, clear_faults,
):  # fmt: skip
    current, bus = (1 if current_at_rail != 0 else 0), u_dc_at_rail | u_dc_low
    now = current + 2 * bus + 4 * model_limited + 8 * merge_limited
    now += 16 * delta_limited + 32 * compensation_limited + 64 * estimate_limited
    faults = now | (0 if clear_faults else state.faults)
    return State(faults), (faults,)


def stimuli(_rng, _config):
    """Every flag alone, latched, then cleared; cleared while the condition persists."""
    rows = []
    for name in (p.name for p in BLOCK.inputs[:-1]):
        quiet = dict.fromkeys((p.name for p in BLOCK.inputs), 0)
        rows += [
            {**quiet, name: 1},
            quiet,
            {**quiet, name: 1, "clear_faults": 1},
            {**quiet, "clear_faults": 1},
            quiet,
        ]
    return rows


BLOCK = Block(
    name="flux_monitor",
    folder="estimators",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=(
        Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),
        Port("u_dc_at_rail", BIT, doc="bus reading at either end"),
        Port("u_dc_low", BIT, doc="bus below 1/32 per unit"),
        Port("model_limited", BIT, doc="the current model reached its range"),
        Port("merge_limited", BIT, doc="the merge reached its range"),
        Port("delta_limited", BIT, doc="delta lambda reached its range"),
        Port("compensation_limited", BIT, doc="the compensation reached its limit"),
        Port("estimate_limited", BIT, doc="the estimate reached its range"),
        Port("clear_faults", BIT, doc="1: clear the flags whose cause is gone"),
    ),
    outputs=(Port("flux_faults", FAULTS, doc="what has disturbed the flux estimate, see flux_monitor"),),
    state=State(),
    latency=1,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
