# SPDX-License-Identifier: BSD-3-Clause
"""Latches the faults and the first fault, and keeps the gates off until ``clear_trip``; runs at every clock.

    0 to 5   faults of a sample, see sample_checks
    6        no sample for ``watchdog`` clocks
    7        input ``trip``
    8        a sample came too early and was rejected: reported, never a trip
    9 to 11  overspeed, runaway, stall, see motion_checks
    12       a phase or the motor is not connected, see load_check
    13       the zero of a current sensor is wrong, see offset_check
    14       the host does not write any more, see host_watch
    15       encoder and EMF contradict each other, see emf_check

Faults are latched while ``enable`` is 1 (``trip`` always), so that registers can be written before; while a fault is
present ``enable`` has no effect.  ``clear_trip`` clears the faults whose cause is gone, where no new cause of a
trip came in the ``HELD`` clocks before; else it clears nothing: who wrote it on the bus cannot have seen that trip.
``first_fault`` contains all faults of the first clock that tripped, until nothing trips any more.
``fault_ignore``: fault x is reported in the flags and does not trip; ``trip`` always trips.
``gate_clear`` is such a ``clear_trip`` one clock later, when the flags are cleared, for the trip latch of the gates.
Formats: bits.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.formats import BIT
from golden_model.io.motion_checks import FAULTS as MOTION_FAULTS
from golden_model.io.sample_checks import CHECKS, IGNORE
from golden_model.kernel import kernel

NAMES = (
    "overcurrent", "current_sum", "at_rail", "u_dc_low", "u_dc_high", "position", "watchdog", "trip", "early",
    "overspeed", "runaway", "stall", "open_load", "current_offset", "host_lost",
    "encoder_lost",
)  # fmt: skip
FLAGS = IGNORE
LATE, TRIP, EARLY, MOTION, OPEN, OFFSET, HOST, ENCODER = 6, 7, 8, 9, 12, 13, 14, 15
ALWAYS = 1 << TRIP  # latched without enable, and cannot be ignored
TRIPPING = FLAGS.hi - (1 << EARLY)
HELD = 16  # clocks: longer than a write takes from the pins of the bus to clear_trip, and a trip pin to the latch


def of_sample(values):
    """The flags that a sample's values raise, by their names in Observed: integers or arrays."""
    found = values["sample_faults"] + (values["motion_faults"] << MOTION) + (values["open_load"] << OPEN)
    return found + (values["current_offset"] << OFFSET) + (values["encoder_lost"] << ENCODER)


class State(NamedTuple):
    flags: int = 0
    first: int = 0
    stop: int = 0
    causes: int = 0  # that trip, of the last clock
    held: int = 0  # clocks for which clear_trip clears nothing


@kernel
def step(state, inputs, regs):
    s, x = state, inputs
    now = x.sample_faults + (x.sample_late << LATE) + (x.trip << TRIP) + (x.sample_early << EARLY)
    now += (x.motion_faults << MOTION) + (x.open_load << OPEN) + (x.current_offset << OFFSET)
    now += (x.host_lost << HOST) + (x.encoder_lost << ENCODER)
    new = now if x.enable else now & ALWAYS
    trips = TRIPPING & (ALWAYS | ~regs.fault_ignore)
    causes = new & trips
    caused = causes & ~s.causes != 0
    clear = 1 if x.clear_trip and not caused and s.held == 0 else 0
    kept = s.flags & now if clear else s.flags
    flags = new | kept
    tripping = flags & trips
    stop = 1 if tripping != 0 else 0
    first = s.first if s.stop else tripping
    following = State(flags, first, stop, causes, HELD if caused else max(s.held - 1, 0))
    return following, (flags, first, stop, clear)


def stimuli(rng, config):
    """Each fault alone and two in sequence, cleared while present, too early and when gone, ignored, without enable."""
    calm = dict.fromkeys((p.name for p in BLOCK.inputs + BLOCK.registers), 0) | {"enable": 1}
    causes = [{"sample_faults": 1 << k} for k in range(6)]
    causes += [{"sample_late": 1}, {"trip": 1}, {"sample_early": 1}]
    causes += [{"motion_faults": 1 << k} for k in range(3)]
    causes += [{"open_load": 1}, {"current_offset": 1}, {"host_lost": 1}, {"encoder_lost": 1}]
    rows = []
    for k, cause in enumerate(causes):
        other = causes[(k + 4) % len(causes)]
        clear, ignore = {"clear_trip": 1}, {"fault_ignore": 1 << k}
        later = [calm] * HELD
        for wait in (0, 1, HELD - 1, HELD, HELD + 1):
            rows += [calm | cause, *[calm] * wait, calm | clear, calm, *later, calm | clear, calm]
            rows += [*[calm | cause] * (wait + 1), calm | other, calm | clear, *later, calm | clear, calm]
        rows += [calm, calm | cause, calm, calm | other, calm | other | clear, calm | clear, *later, calm | clear, calm]
        rows += [calm | cause | other, calm | cause | clear, *later, calm | cause | clear, *later, calm | clear, calm]
        rows += [calm | cause | {"enable": 0}, calm | cause | {"enable": 0}, calm | cause, *later, calm | clear, calm]
        rows += [
            calm | cause,
            *[calm | cause | {"enable": 0}] * HELD,
            calm | cause | clear | {"enable": 0},
            calm | cause | {"enable": 0},
            *later,
            calm | clear,
        ]
        rows += [calm | cause | ignore, calm | other | ignore, *later, calm | ignore | clear, calm | clear, calm]
    return rows


INPUTS = (
    Port("trip", BIT, doc="1: gates off, latched"),
    Port("sample_faults", CHECKS, doc="what is wrong with the last sample"),
    Port("sample_late", BIT, doc="1: the last sample is older than watchdog clocks"),
    Port("sample_early", BIT, doc="1: a sample came too early and was rejected"),
    Port("motion_faults", MOTION_FAULTS, doc="overspeed, runaway, stall"),
    Port("open_load", BIT, doc="1: a phase or the motor is not connected"),
    Port("current_offset", BIT, doc="1: the zero of a current sensor is wrong"),
    Port("host_lost", BIT, doc="1: the last write is older than heartbeat periods"),
    Port("encoder_lost", BIT, doc="1: encoder and EMF contradict each other"),
    Port("enable", BIT, doc="1: gates may switch"),
    Port("clear_trip", BIT, doc="1: clear the flags whose cause is gone"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (Port("fault_ignore", IGNORE, doc="bit x: fault x of fault_flags is reported and does not trip"),)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="fault_latch",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("fault_flags", FLAGS, doc="faults since the last clear_trip, see fault_latch"),
        Port("first_fault", FLAGS, doc="faults that tripped first"),
        Port("fault_stop", BIT, doc="1: gates off"),
        Port("gate_clear", BIT, doc="clear_trip, where it acts, one clock later, when the flags are cleared"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"LATE": LATE, "TRIP": TRIP, "EARLY": EARLY, "HELD": HELD},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
