# SPDX-License-Identifier: BSD-3-Clause
"""Charges the bootstrap capacitors of the upper gate drivers before the drive switches.

From the valley at which the gates go on all lower switches are on for ``charge_samples`` sample times: compare values
of zero (``charging``).  Then the duties act, and with the next sample the regulators run (``charged``), as they do with
the first sample after the gates went on where nothing is charged.  ``charge_samples`` = 0: as if there were no such
block.  Once charged, a new setting waits until the gates have been off.

The motor is short-circuited meanwhile: its current rises by omega*psi/L, so a turning shaft wants a short time.
Formats: sample times.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

SAMPLES = Format(0, 10, 0)
CHARGE_W = SAMPLES.width


class State(NamedTuple):
    count: int = 0  # sample times since the gates went on
    done: int = 0


@kernel
def step(state, gates_on, period, charge_samples):
    count, done = state.count, state.done
    if not gates_on:
        count, done = 0, 0
    elif period and not done:
        if count >= charge_samples:
            done = 1
        else:
            count += 1
    charging = 1 if count < charge_samples and not done else 0
    charged = 1 if done or charge_samples == 0 else 0
    return State(count, done), (charging, charged)


def stimuli(_rng, _config):
    """No charge, short and longer ones, each interrupted, ended and repeated; a setting that changes meanwhile."""
    rows = []
    for charge in (0, 1, 2, 7, 0):
        for on in (3, 40, 9):
            rows += [{"gates_on": 0, "period": int(k == 1), "charge_samples": charge} for k in range(3)]
            rows += [{"gates_on": 1, "period": int(k % 3 == 1), "charge_samples": charge} for k in range(on)]
            rows += [{"gates_on": 1, "period": 1, "charge_samples": c} for c in (charge + 2, charge, 0, charge)]
    return rows


def patient_stimuli(_rng, _config):
    """The longest charge of each bit of the register."""
    rows = []
    for bit in range(3, CHARGE_W + 1):
        longest = (1 << bit) - 1
        rows.append({"gates_on": 0, "period": 0, "charge_samples": longest})
        rows += [{"gates_on": 1, "period": 1, "charge_samples": longest}] * (longest + 3)
    return rows


BLOCK = Block(
    name="bootstrap_charge",
    folder="modulation",
    paper="none: supply of the upper gate drivers",
    step=step,
    inputs=(
        Port("gates_on", BIT, doc="1: the gates are on"),
        Port("period", BIT, doc="1: a sample time begins"),
    ),
    registers=(
        Port(
            "charge_samples", SAMPLES, doc="sample times with all lower switches on before the drive switches; 0: none"
        ),
    ),
    outputs=(
        Port("charging", BIT, doc="1: all lower switches on, compare values are not taken"),
        Port("charged", BIT, doc="1: the drive may run"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"CHARGE_W": CHARGE_W},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
