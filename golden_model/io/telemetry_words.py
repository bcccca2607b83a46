# SPDX-License-Identifier: BSD-3-Clause
"""The telemetry packet: the layout of its words; one word per clock, read from the core's live values.

``WORDS`` is the only definition of the packet.  The VHDL twin is generated from it; the reader of a capture and
``fluxproof diagnose`` import it.  A word contains

* one field, extended to 32 bits by its sign or with zeros, or
* two of at most 16 bits, each extended to 16, the first in the low half, or
* several, packed from bit 0 on, zeros above (a signed one has its sign in its own top bit).

The packet is not copied before it is sent: the values of a sample stay until those of the next one replace them, and
each word is read in between (``window``).  The core's values are delayed by one clock, because they pass a register on
their way across the chip.  The order of the words and ``START`` follow from that; if a changed latency no longer fits,
the import fails with the name of the word.
"""

from typing import NamedTuple

from golden_model import fluxproof
from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.io import sample_latch

VERSION = 2
MAGIC = 0x4650  # "FP"
HEADER, COUNTER = "header", "counter"
WORDS = (
    (HEADER,),
    (COUNTER,),
    ("adc_a", "adc_b"),
    ("adc_c", "adc_u_dc"),
    ("position_code",),
    ("omega_ref",),
    ("i_d_ref",),
    ("i_q_ext",),
    ("theta_me",),
    ("omega_me",),
    ("u_dc",),
    ("i_d",),
    ("i_q",),
    ("i_q_ref",),
    ("lambda_d",),
    ("lambda_q",),
    ("u_d",),
    ("u_q",),
    ("compare_a", "compare_b"),
    ("compare_c", "temp_winding"),
    ("psi_m",),
    ("run", "speed_mode", "temp_valid", "clear_faults", "current_at_rail", "temp_lost", "sat_d", "sat_q",
     "psi_held", "flux_faults", "speed_was_given", "position_restarted"),
    ("v_dead",),
    ("v_comp",),
)  # fmt: skip
COUNT = len(WORDS)
HEADER_WORD = MAGIC << 16 | VERSION << 8 | COUNT
# A note of the host between two packets, as long as a packet: why the gates went off, which no sample contains
NOTE = 0x80  # in the place of the version
NOTE_WORD = MAGIC << 16 | NOTE << 8 | COUNT
NOTE_FAULT = 2  # its word with the register first_fault; word 1 is the number of the first sample without gates
WORD = Format(0, 32, 0)
INDEX = Format(0, (COUNT - 1).bit_length(), 0)


class Field(NamedTuple):
    """The place of a field: ``width`` bits of word ``word`` from bit ``lsb`` on; ``port`` has format and meaning."""

    word: int
    lsb: int
    width: int
    port: Port

    @property
    def signed(self) -> bool:
        return bool(self.port.fmt.signed)


# The width of a code is a generic; the packet has space for the widest.
_WIDEST = {"code_theta": Format(0, 0, 18)}
INPUTS = {
    name: Port(name, _WIDEST.get(port.name, port.fmt), doc=port.doc)
    for name, port in zip(fluxproof.Sample._fields, sample_latch.BLOCK.outputs, strict=True)
}
PORTS = INPUTS | fluxproof.OBSERVED


def _layout() -> dict[str, Field]:
    """{field: Field} of WORDS, in their order; ValueError if the fields do not fit into their word."""
    layout = {}
    for number, names in enumerate(WORDS):
        widths = [WORD.width if n in (HEADER, COUNTER) else PORTS[n].fmt.width for n in names]
        if len(names) <= 2:
            room = WORD.width // len(names)
            if max(widths) > room:
                raise ValueError(f"telemetry: {' and '.join(names)} do not fit into word {number}")
            widths = [room] * len(names)
        if sum(widths) > WORD.width:
            raise ValueError(f"telemetry: word {number} would have {sum(widths)} bits: {', '.join(names)}")
        lsb = 0
        for name, width in zip(names, widths, strict=True):
            port = PORTS.get(name, Port(name, WORD))
            layout[name] = Field(number, lsb, width, port)
            lsb += width
    return layout


LAYOUT = _layout()
FIELDS = tuple(name for name in LAYOUT if name not in (HEADER, COUNTER))
PACKET = tuple(name for name in FIELDS if name not in INPUTS)  # results of the core
_MISSING = set(INPUTS) - set(FIELDS)
if _MISSING:
    raise ValueError(f"telemetry: the golden model cannot replay a packet without {', '.join(sorted(_MISSING))}")


def owner(name: str) -> str:
    """The instance of the top that calculates a field."""
    return "latch" if name in INPUTS else next(i for i in fluxproof.WIRING if name in fluxproof.outputs_of(i))


def window(names) -> tuple[int, int]:
    """(first, last) clock edge after the raw sample at which all these fields belong to this sample.

    First: the last of the results is valid.  Last: the next sample, at the shortest distance, enters the first of the
    blocks; outputs change after that edge at the earliest.  Results of the core are read one clock late.
    """
    starts, ends = [], []
    for name in names:
        first, last = fluxproof.schedule()[owner(name)]
        old = 0 if name in INPUTS else 1
        starts.append(first + old)
        ends.append(last + old)
    return max(ends), fluxproof.SAMPLE_INTERVAL + min(starts)


def _start() -> int:
    """The earliest edge for word 0, with one word per edge, such that every word is inside its window."""
    windows = [window(names) if names[0] in LAYOUT and names[0] in PORTS else (1, 10**6) for names in WORDS]
    start = max(first - number for number, (first, _) in enumerate(windows))
    for number, (first, last) in enumerate(windows):
        if not first <= start + number <= last:
            raise ValueError(
                f"telemetry: word {number} ({', '.join(WORDS[number])}) would be read {start + number} clocks after "
                f"the sample, its fields are valid from {first} to {last}: move the word"
            )
    if COUNT > fluxproof.SAMPLE_INTERVAL:
        raise ValueError(f"telemetry: {COUNT} words do not fit between two samples")
    return start


START = _start()


def pack(counter: int, values) -> tuple[int, ...]:
    """The words of one packet from {field: integer}; unknown names are ignored."""
    known = {HEADER: HEADER_WORD, COUNTER: counter, **values}
    words = [0] * COUNT
    for name, field in LAYOUT.items():
        words[field.word] |= (int(known[name]) & ((1 << field.width) - 1)) << field.lsb
    return tuple(words)


def step(index, counter, *values):
    """Word ``index`` of the packet; ``values`` in the order of FIELDS, then the generics."""
    return (pack(counter, dict(zip(FIELDS, values, strict=False)))[index],)


def stimuli(rng, config):
    """Every word with all fields at their minimum, at their maximum, and random."""
    ports = [p for p in BLOCK.ports(config) if p.name != "index"]
    rows = []
    for index in range(COUNT):
        for choose in (lambda p: p.low, lambda p: p.high, lambda p: int(rng.integers(p.low, p.high + 1))):
            rows += [{p.name: choose(p) for p in ports} | {"index": index}]
    return rows


def sized(name):
    """The function config -> Format of a code port, whose width is a generic, or None."""
    return sample_latch.sized(dict(zip(INPUTS, (p.name for p in sample_latch.BLOCK.outputs), strict=True))[name])


BLOCK = Block(
    name="telemetry_words",
    folder="io",
    generated=True,
    paper="none: recording of samples",
    step=step,
    inputs=(
        Port("index", INDEX, hi=COUNT - 1, doc="which word"),
        Port("counter", WORD, doc="number of the sample"),
        *(PORTS[name] for name in FIELDS),
    ),
    outputs=(Port("word", WORD, doc="the packet's word"),),
    latency=2,
    constants={"COUNT": COUNT, "START": START, "INDEX_W": INDEX.width},
    configs=({"ADC_BITS": 16, "POSITION_BITS": 16}, {"ADC_BITS": 12, "POSITION_BITS": 18}),
    width_from={name: size for name in INPUTS if (size := sized(name))},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
