# SPDX-License-Identifier: BSD-3-Clause
"""An absolute encoder from its lines to a code for each sample: the master of its protocol and the bridge, wired.

Nothing is computed here.  A frame starts with ``sample_trigger``; the bridge's sample is the strobe of the converters'
codes, so a frame that has ended by then is this sample's.  ``encoder`` is 4 (SSI), 5 (BiSS-C) or 6 (EnDat).
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders import biss_master, endat_master, position_bridge, ssi_master
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

SSI, BISS, ENDAT = 4, 5, 6
SOME = 2000  # clocks of the master's hard cases
ssi_step, biss_step, endat_step = ssi_master.step, biss_master.step, endat_master.step
bridge_step = position_bridge.step


class State(NamedTuple):
    of_ssi: ssi_master.State = ssi_master.State()
    of_biss: biss_master.State = biss_master.State()
    of_endat: endat_master.State = endat_master.State()
    of_bridge: position_bridge.State = position_bridge.State()
    # Outputs that the next clock reads
    code: int = 0
    code_valid: int = 0


@kernel
def step(state, inputs, regs, encoder, position_bits):
    x, r = inputs, regs
    s = state
    ssi, biss, endat = s.of_ssi, s.of_biss, s.of_endat
    data_out, data_drive, alarm, warning = 0, 0, 0, 0
    if encoder == SSI:
        ssi, (serial_clock, code, code_valid, _, _) = ssi_step(
            s.of_ssi,
            x.serial_data,
            x.sample_trigger,
            r.half_period,
            r.encoder_bits,
            r.turn_bits,
            r.gray,
            r.parity_on,
            position_bits,
        )
    elif encoder == BISS:
        biss, (serial_clock, code, code_valid, _, alarm, warning, _) = biss_step(
            s.of_biss, x.serial_data, x.sample_trigger, r.half_period, r.encoder_bits, r.turn_bits, r.crc_on,
            r.start_max, position_bits,
        )  # fmt: skip
    else:
        endat, (serial_clock, data_out, data_drive, code, code_valid, _, alarm, _) = endat_step(
            s.of_endat, x.serial_data, x.sample_trigger, r.half_period, r.mode_command, r.two_errors, r.encoder_bits,
            r.turn_bits, r.crc_on, r.start_max, position_bits,
        )  # fmt: skip
    bridge, (code_theta, code_done, position_valid, position_lost, bridged_count) = bridge_step(
        s.of_bridge, s.code, s.code_valid, x.codes_valid, x.clear_encoder, r.position_delay, r.bridge_max, position_bits
    )
    following = State(ssi, biss, endat, bridge, code, code_valid)
    return following, (
        serial_clock, data_out, data_drive, code_theta, code_done, position_valid, position_lost, bridged_count, alarm,
        warning,
    )  # fmt: skip


def stimuli(rng, config):
    """Frames of noise and of a line at rest, with samples after and before their end; the first of the master's."""
    rows = []
    row = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"serial_data": 1, "bridge_max": 3, "start_max": 60}
    row |= {"half_period": 1, "encoder_bits": 12, "turn_bits": 10, "mode_command": 7, "position_delay": 1 << 15}
    for turn in range(12):
        for k in range(250):
            noise = int(rng.integers(2)) if turn % 3 == 1 else int(k % 7 > turn % 5) if turn % 3 else 1
            now = {"sample_trigger": int(k == 5), "codes_valid": int(k == 200), "serial_data": noise}
            rows.append(row | now | {"clear_encoder": int(turn == 8 and k == 100)})
    return rows + patient_stimuli(rng, config)[:SOME]


def patient_stimuli(rng, config):
    """All frames of the master, with samples at any time; the delay and the longest bridge change now and then.

    Then an encoder that never answers, with longest times at which each of their lower bits counts.
    """
    rows, names = [], {"start": "sample_trigger", "word_bits": "encoder_bits"}
    master = {SSI: ssi_master, BISS: biss_master, ENDAT: endat_master}[config["ENCODER"]]
    regs = {"position_delay": 1 << 15, "bridge_max": 2}
    for row in master.stimuli(rng, {"POSITION_BITS": config["POSITION_BITS"]}):
        if rng.integers(2000) == 0:
            regs = {"position_delay": int(rng.integers(_BRIDGE["delay"].fmt.hi)), "bridge_max": int(rng.integers(5))}
        now = {names.get(name, name): value for name, value in row.items()}
        rows.append(now | regs | {"codes_valid": int(rng.integers(150) == 0), "clear_encoder": 0})
    for longest in sorted({(3 << bit >> 1) + off for bit in range(1, 11) for off in (-1, 0, 1)}):
        row = rows[0] | {"start_max": longest, "serial_data": 1, "half_period": 1}
        rows += [row | {"sample_trigger": int(k % 40 == 5)} for k in range(longest + 150)]
    return rows


_MASTERS = {p.name: p for m in (endat_master, biss_master, ssi_master) for p in m.BLOCK.registers + m.BLOCK.outputs}
_BRIDGE = {p.name: p for p in position_bridge.BLOCK.registers + position_bridge.BLOCK.outputs}
REGISTERS = (
    _MASTERS["half_period"],
    Port("encoder_bits", _MASTERS["word_bits"].fmt, doc="bits of the encoder's word"),
    *(_MASTERS[n] for n in ("turn_bits", "gray", "parity_on", "crc_on", "start_max", "mode_command", "two_errors")),
    Port("position_delay", _BRIDGE["delay"].fmt, doc="time from the encoder's latch to the currents', samples"),
    _BRIDGE["bridge_max"],
)

INPUTS = (
    Port("serial_data", BIT, doc="data line, asynchronous pin"),
    Port("sample_trigger", BIT, doc="1: read the position"),
    Port("codes_valid", BIT, doc="1: the codes of the converters are there"),
    Port("clear_encoder", BIT, doc="1: clear the encoder's faults and counters"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="serial_encoder",
    folder="encoders",
    paper="none: absolute encoders",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("serial_clock", BIT, doc="clock line, idle 1"),
        *(_MASTERS[n] for n in ("data_out", "data_drive")),
        *(_BRIDGE[n] for n in ("code_theta", "code_valid", "position_valid", "position_lost", "bridged_count")),
        *({p.name: p for p in biss_master.BLOCK.outputs}[n] for n in ("alarm", "warning")),
    ),
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"serial_clock": 1},
    configs=({"ENCODER": ENDAT, "POSITION_BITS": 16},),  # position_front has the others
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
