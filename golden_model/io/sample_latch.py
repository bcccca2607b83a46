# SPDX-License-Identifier: BSD-3-Clause
"""Latches one raw sample, the references and the run state, so that they are constant while it is processed.

Everything that may change at any clock (converter codes, position, references, the gates' running
state) enters the core here; the blocks after it have constant inputs until the next sample.
Formats: unchanged; nothing is computed.
"""

from collections import namedtuple

from golden_model.block import Block, Port
from golden_model.estimators import winding_resistance
from golden_model.formats import BIT, PU
from golden_model.io import current_conditioning, position, u_dc_conditioning
from golden_model.kernel import kernel


@kernel
def step(inputs, *_widths):
    return inputs


NAMES = {
    "adc_a": "code_a",
    "adc_b": "code_b",
    "adc_c": "code_c",
    "adc_u_dc": "code_u_dc",
    "position_code": "code_theta",
    "omega_ref_in": "omega_ref",
    "i_d_ref_in": "i_d_ref",
    "i_q_ext_in": "i_q_ext",
    "speed_mode_in": "speed_mode",
    "temp_winding_in": "temp_winding",
    "temp_valid_in": "temp_valid",
    "clear_faults_in": "clear_faults",
    "run_in": "run",
}
_CODES = {p.name: p for b in (current_conditioning, position, u_dc_conditioning) for p in b.BLOCK.inputs}
_REFERENCES = {
    "omega_ref": Port("omega_ref", PU, doc="speed reference"),
    "i_d_ref": Port("i_d_ref", PU, doc="current reference, d axis"),
    "i_q_ext": Port("i_q_ext", PU, doc="current reference of torque mode, q axis"),
    "speed_mode": Port("speed_mode", BIT, doc="1: speed control, 0: torque control"),
    "temp_winding": winding_resistance.BLOCK.inputs[0],
    "temp_valid": winding_resistance.BLOCK.inputs[1],
    "clear_faults": Port("clear_faults", BIT, doc="1: clear the flags whose cause is gone"),
    "run": Port("run", BIT, doc="1: the gates are switching"),
}
_PORTS = _CODES | _REFERENCES


def sized(name):
    """The function config -> Format of a code port, whose width is a generic, or None."""
    width = {
        **current_conditioning.BLOCK.width_from,
        **u_dc_conditioning.BLOCK.width_from,
        **position.BLOCK.width_from,
    }
    return width.get(name)


def reference(v, _state):
    return {out: v[name] for name, out in NAMES.items()}


def bound(_v, _state):
    return dict.fromkeys(NAMES.values(), 0.0)


INPUTS = tuple(Port(name, _PORTS[out].fmt, doc=_PORTS[out].doc) for name, out in NAMES.items())
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])

BLOCK = Block(
    name="sample_latch",
    folder="io",
    paper="001, Fig. 5: acquisition",
    step=step,
    takes=(Inputs,),
    inputs=INPUTS,
    outputs=tuple(_PORTS[out] for out in NAMES.values()),
    latency=1,
    configs=({"ADC_BITS": 16, "POSITION_BITS": 16}, {"ADC_BITS": 12, "POSITION_BITS": 18}),
    width_from={k: size for name, out in NAMES.items() for k in (name, out) if (size := sized(out))},
    reference=reference,
    bound=bound,
)
