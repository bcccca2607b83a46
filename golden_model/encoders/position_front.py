# SPDX-License-Identifier: BSD-3-Clause
"""The position of a board from its pins: the front end of one kind of encoder, and what the core needs of it.

    encoder   0  external code    1  A/B/Z    2  Hall    3  A/B/Z started by Hall    4  SSI    5  BiSS-C    6  EnDat

``sample_trigger`` latches code and count, or starts a frame; ``position_done`` says that code and speed are there.  The
speed is that between edges where there are edges, else ``omega_set``, the register.  ``encoder_restart``: the count has
moved to the first index or to a start since the trigger before, so this code has nothing to do with the last one.
Encoder 3: the count starts from the Hall sensors when they are valid and the settings are good, once, and again after
``clear_encoder``; the first index refers it.
``angle_unknown``: A/B/Z before the index is believed, unless started.  ``hall_wrong``: where the angle is that of Hall
sensors, an illegal code or a change by more than one sector.
``encoder_flags``: bit 0 referenced, 1 moving, 2 index_lost, 3 index_wrong, 4 setting_refused, 5 hall_valid,
6 position_valid, 7 position_lost, 8 alarm, 9 warning, 10 forward.
Formats: those of the blocks.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders import hall_decoder, hall_front, incremental_encoder, serial_encoder
from golden_model.encoders.quadrature_decoder import EVENTS
from golden_model.encoders.turn_counter import COUNT
from golden_model.fixed import Format
from golden_model.formats import BIT, PU
from golden_model.io.position import code_format
from golden_model.kernel import kernel

EXTERNAL, ABZ, HALL, HALL_ABZ = range(4)
KINDS = ("external", "abz", "hall", "hall_abz", "ssi", "biss", "endat")
FLAGS = Format(0, 11, 0)
abz_step, hall_step, serial_step = incremental_encoder.step, hall_front.step, serial_encoder.step


class State(NamedTuple):
    of_abz: incremental_encoder.State = incremental_encoder.State()
    of_hall: hall_front.State = hall_front.State()
    of_serial: serial_encoder.State = serial_encoder.State()
    code: int = 0
    count: int = 0  # latched
    moved: int = 0  # 1: the count was on its way since the last trigger
    restart: int = 0
    started: int = 0  # 1: the start of the count has been given
    # Outputs that the next clock reads
    abz_count: int = 0
    moving: int = 0
    refused: int = 0
    start_count: int = 0
    start_valid: int = 0
    referenced: int = 0
    hall_valid: int = 0
    skipped: int = 0
    angle_unknown: int = 0
    hall_wrong: int = 0


@kernel
def step(state, inputs, regs, encoder, position_bits):
    x, r = inputs, regs
    s = state
    trigger = x.sample_trigger
    abz, hall, serial = s.of_abz, s.of_hall, s.of_serial
    code, omega, done, count, moving, refused = s.code, x.omega_set, 0, 0, 0, 0
    forward, referenced, index_count, illegals, lost, index_lost, index_wrong = 0, 0, 0, 0, 0, 0, 0
    hall_code, hall_omega, hall_done, hall_valid, start_count, start_valid, hall_illegals = 0, 0, 0, 0, 0, 0, 0
    skipped = 0
    serial_clock, data_out, data_drive, position_valid, position_lost, bridged, alarm, warning = 1, 0, 0, 0, 0, 0, 0, 0
    start = 1 if s.start_valid and not s.refused and not s.started else 0

    if encoder == HALL or encoder == HALL_ABZ:
        hall, (
            hall_code, hall_omega, hall_done, hall_valid, start_count, start_valid, hall_illegals, _, skipped
        ) = hall_step(
            s.of_hall,
            x,
            hall_front.Registers(
                filter_clocks=r.filter_clocks, hall_reverse=r.hall_reverse, hall_offset=r.hall_offset,
                start_first=r.start_first, sector_counts=r.sector_counts, reverse=x.reverse, k_edge=r.k_edge,
            ),
            position_bits,
        )  # fmt: skip
    if encoder == ABZ or encoder == HALL_ABZ:
        abz, (
            code, omega, done, count, forward, referenced, moving, index_count, illegals, lost, index_lost, index_wrong,
            refused,
        ) = abz_step(
            s.of_abz,
            incremental_encoder.Inputs(
                pin_a=x.pin_a, pin_b=x.pin_b, pin_z=x.pin_z, sample=trigger, start=start, start_count=s.start_count,
                clear_faults=x.clear_encoder,
            ),
            incremental_encoder.Registers(
                filter_clocks=r.filter_clocks, index_phase=r.index_phase, counts=r.counts, code_step=r.code_step,
                code_rest=r.code_rest, correct_max=r.correct_max, index_once=r.index_once, reverse=x.reverse,
                k_edge=r.k_edge, whole_lines=r.whole_lines,
            ),
            position_bits,
        )  # fmt: skip
    elif encoder == HALL:
        code, omega, done, illegals = hall_code, hall_omega, hall_done, hall_illegals
    elif encoder == EXTERNAL:
        code, done = x.position_in if trigger else s.code, trigger
    else:
        serial, out = serial_step(s.of_serial, x, r, encoder, position_bits)
        serial_clock, data_out, data_drive, code, done, position_valid, position_lost, bridged, alarm, warning = out

    on_the_way = 1 if s.moved or s.moving else 0
    unknown = (encoder == ABZ or encoder == HALL_ABZ) and not (s.referenced or s.started)
    wrong = (encoder == HALL or encoder == HALL_ABZ) and (s.skipped or not s.hall_valid) and not s.referenced
    angle_unknown, hall_wrong = 1 if unknown else 0, 1 if wrong else 0
    latched = s.abz_count if trigger else s.count
    moved, restart = 0 if trigger else on_the_way, on_the_way if trigger else s.restart
    started = 0 if s.refused or x.clear_encoder else (1 if s.started or start else 0)
    following = State(
        of_abz=abz,
        of_hall=hall,
        of_serial=serial,
        code=code,
        count=latched,
        moved=moved,
        restart=restart,
        started=started,
        abz_count=count,
        moving=moving,
        refused=refused,
        start_count=start_count,
        start_valid=start_valid,
        referenced=referenced,
        hall_valid=hall_valid,
        skipped=skipped,
        angle_unknown=angle_unknown,
        hall_wrong=hall_wrong,
    )
    flags = (
        referenced + (moving << 1) + (index_lost << 2) + (index_wrong << 3) + (refused << 4) + (hall_valid << 5)
        + (position_valid << 6) + (position_lost << 7) + (alarm << 8) + (warning << 9) + (forward << 10)
    )  # fmt: skip
    f = following
    return following, Outputs(
        encoder_code=code,
        encoder_restart=f.restart,
        omega_now=omega,
        position_done=done,
        encoder_count=f.count,
        encoder_flags=flags,
        index_count=index_count,
        illegal_count=illegals,
        lost_counts=lost,
        bridged_count=bridged,
        index_wrong=index_wrong,
        position_lost=position_lost,
        angle_unknown=f.angle_unknown,
        hall_wrong=f.hall_wrong,
        serial_clock=serial_clock,
        serial_out=data_out,
        serial_drive=data_drive,
    )


def stimuli(rng, config):
    """The stimuli of the encoder that is built, each with its own settings."""
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    encoder, rows = config["ENCODER"], []
    if encoder in (ABZ, HALL_ABZ):
        rows = _with_edges(incremental_encoder.stimuli(rng, config))
    elif encoder == HALL:
        rows = [still | row for row in hall_front.stimuli(rng, config)]
    elif encoder == EXTERNAL:
        rows = [still | {"position_in": int(rng.integers(256)), "sample_trigger": int(k % 5 == 0)} for k in range(300)]
    else:
        rows = [still | row for row in serial_encoder.stimuli(rng, config)]
    return rows


def _with_edges(given):
    """Rows of incremental_encoder as rows of the front end, with Hall sensors that turn slowly."""
    rows, names = [], {"sample": "sample_trigger", "clear_faults": "clear_encoder"}
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"sector_counts": 160}
    for k, row in enumerate(given):
        row = {names.get(name, name): value for name, value in row.items()}
        hall = dict(zip(("hall_a", "hall_b", "hall_c"), hall_decoder.lines(k // 97), strict=True))
        rows.append(still | {n: v for n, v in row.items() if n in still} | hall)
    return rows


def patient_stimuli(rng, config):
    """All frames of a serial encoder, slow turns of Hall sensors, a shaft that slips."""
    if config["ENCODER"] in (ABZ, HALL_ABZ):
        return _with_edges(incremental_encoder.patient_stimuli(rng, config))
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    if config["ENCODER"] == HALL:
        return [still | row for row in hall_front.patient_stimuli(rng, config)]
    serial = config["ENCODER"] in (serial_encoder.SSI, serial_encoder.BISS, serial_encoder.ENDAT)
    return [still | row for row in serial_encoder.patient_stimuli(rng, config)] if serial else []


_PORTS = {
    p.name: p
    for module in (hall_front, serial_encoder, incremental_encoder)
    for p in module.BLOCK.inputs + module.BLOCK.registers + module.BLOCK.outputs
}

INPUTS = (
    *(_PORTS[n] for n in ("pin_a", "pin_b", "pin_z")),
    *(Port(f"hall_{x}", BIT, doc=f"Hall sensor {x}, asynchronous pin") for x in "abc"),
    _PORTS["serial_data"],
    Port("position_in", Format(0, 0, 16), doc="position code from elsewhere, latched by the trigger"),
    *(_PORTS[n] for n in ("sample_trigger", "codes_valid", "clear_encoder")),
    Port("omega_set", PU, doc="electrical speed, where the encoder has no edges"),
    _PORTS["reverse"],
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
_INCREMENTAL = (
    "filter_clocks",
    "index_phase",
    "counts",
    "code_step",
    "code_rest",
    "correct_max",
    "index_once",
    "k_edge",
    "whole_lines",
)
_HALL = ("hall_reverse", "hall_offset", "start_first", "sector_counts")
REGISTERS = (*(_PORTS[n] for n in (*_INCREMENTAL, *_HALL)), *serial_encoder.REGISTERS)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
OUTPUTS = (
    Port("encoder_code", Format(0, 0, 16), doc="position code of the encoder, latched by the trigger"),
    Port("encoder_restart", BIT, doc="1: it has nothing to do with the one before"),
    Port("omega_now", PU, doc="electrical speed between edges"),
    Port("position_done", BIT, doc="1: position and speed are there"),
    Port("encoder_count", COUNT, doc="count of the encoder, latched by the trigger"),
    Port("encoder_flags", FLAGS, doc="flags of the encoder, see position_front"),
    _PORTS["index_count"],
    _PORTS["illegal_count"],
    _PORTS["lost_counts"],
    Port("bridged_count", EVENTS, doc="samples without a good frame, saturates"),
    _PORTS["index_wrong"],
    _PORTS["position_lost"],
    Port("angle_unknown", BIT, doc="1: the index has not been believed, and no start given"),
    Port("hall_wrong", BIT, doc="1: an illegal code of the Hall sensors, or more than one sector at once"),
    Port("serial_clock", BIT, doc="clock line of a serial encoder, idle 1"),
    Port("serial_out", BIT, doc="its data line as driven"),
    Port("serial_drive", BIT, doc="1: drive its data line"),
)
Outputs = namedtuple("Outputs", [p.name for p in OUTPUTS])

BLOCK = Block(
    name="position_front",
    folder="encoders",
    paper="none: front end of a board",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=OUTPUTS,
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"serial_clock": 1},
    configs=tuple({"ENCODER": encoder, "POSITION_BITS": 16} for encoder in range(len(KINDS))),
    width_from={"position_in": code_format, "encoder_code": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
