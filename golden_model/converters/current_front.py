# SPDX-License-Identifier: BSD-3-Clause
"""The converters of a board from their pins to the four codes of a sample, of the kind that is built.

    currents  0  codes from elsewhere    1  SPI    2  XADC    3  delta-sigma

``channel_x`` is the code of the converter that becomes ``adc_x``: 0 to 7 of SPI (line, and 4 more for the second word),
0 to 3 of the XADC; modulators have their places.  A trigger is answered by ``codes_done`` with all four, or the answer
is an error: it is counted, the sample stays away and the core's watchdog acts.
Formats: codes.  The codes change a clock after those of the converter, with ``codes_done``.  The counter saturates.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.converters import delta_sigma, spi_converter, xadc_reader
from golden_model.converters.delta_sigma import renamed
from golden_model.fixed import Format
from golden_model.formats import BIT, CODE
from golden_model.io.current_conditioning import code_format
from golden_model.kernel import kernel

EXTERNAL, SPI, XADC, DELTA_SIGMA = range(4)
KINDS = ("external", "spi", "xadc", "delta_sigma")
EVENTS = Format(0, 12, 0)
EVENTS_MAX = EVENTS.hi
spi_step, xadc_step, sigma_step = spi_converter.step, xadc_reader.step, delta_sigma.step


class State(NamedTuple):
    of_spi: spi_converter.State = spi_converter.State()
    of_xadc: xadc_reader.State = xadc_reader.State()
    of_sigma: delta_sigma.State = delta_sigma.State()
    adc_a: int = 0
    adc_b: int = 0
    adc_c: int = 0
    adc_u_dc: int = 0
    done: int = 0
    errors: int = 0
    # Outputs that the next clock reads
    codes: tuple[int, int, int, int, int, int, int, int] = (0, 0, 0, 0, 0, 0, 0, 0)
    codes_valid: int = 0
    error: int = 0


@kernel
def step(state, inputs, regs, currents, adc_bits, spi_lines):
    x, r = inputs, regs
    s = state
    spi, xadc, sigma = s.of_spi, s.of_xadc, s.of_sigma
    c0, c1, c2, c3, c4, c5, c6, c7 = 0, 0, 0, 0, 0, 0, 0, 0
    convst, cs_n, sclk, den, daddr, mod_clock, refused, over, valid, error = 0, 1, 0, 0, 0, 0, 0, 0, 0, 0
    new, wrong = s.codes_valid, s.error
    if currents == SPI:
        spi, (convst, cs_n, sclk, valid, error, refused, c0, c1, c2, c3, c4, c5, c6, c7) = spi_step(
            s.of_spi,
            spi_converter.Inputs(sample_trigger=x.sample_trigger, miso=x.miso, busy=x.busy),
            spi_converter.Registers(
                clock_ratio=r.clock_ratio, word_bits=r.spi_bits, skip_bits=r.spi_skip, sample_delay=r.spi_delay,
                wait_clocks=r.wait_clocks, busy_timeout=r.busy_timeout, two_words=r.two_words,
                use_convst=r.use_convst, clock_idle=r.clock_idle, second_edge=r.second_edge,
                signed_code=r.signed_code,
            ),
            adc_bits,
            spi_lines,
        )  # fmt: skip
    elif currents == XADC:
        xadc, (convst, den, daddr, valid, error, c0, c1, c2, c3) = xadc_step(
            s.of_xadc,
            xadc_reader.Inputs(
                sample_trigger=x.sample_trigger, busy=x.busy, eoc=x.eoc, drdy=x.drdy, drp_do=x.drp_do
            ),
            xadc_reader.Registers(
                conversions=r.conversions, channels=r.xadc_channels, address_0=r.address_0, address_1=r.address_1,
                address_2=r.address_2, address_3=r.address_3, timeout=r.xadc_timeout, signed_code=r.signed_code,
            ),
            adc_bits,
        )  # fmt: skip
    elif currents == DELTA_SIGMA:
        sigma, (mod_clock, c0, c1, c2, c3, valid, error, over) = sigma_step(
            s.of_sigma,
            delta_sigma.Inputs(mod_data=x.mod_data, mod_clock_in=x.mod_clock_in, sample_trigger=x.sample_trigger),
            r,
            adc_bits,
        )

    if currents == SPI:
        a, b, c, u_dc = s.codes[r.channel_a], s.codes[r.channel_b], s.codes[r.channel_c], s.codes[r.channel_u_dc]
    elif currents == XADC:
        a, b, c, u_dc = (
            s.codes[r.channel_a & 3], s.codes[r.channel_b & 3], s.codes[r.channel_c & 3], s.codes[r.channel_u_dc & 3]
        )  # fmt: skip
    elif currents == DELTA_SIGMA:
        a, b, c, u_dc = s.codes[0], s.codes[1], s.codes[2], s.codes[3]
    else:
        a, b, c, u_dc, new = x.code_a_in, x.code_b_in, x.code_c_in, x.code_u_dc_in, x.codes_valid_in
    errors = 0 if x.clear_encoder else s.errors
    following = State(
        of_spi=spi,
        of_xadc=xadc,
        of_sigma=sigma,
        adc_a=a if new else s.adc_a,
        adc_b=b if new else s.adc_b,
        adc_c=c if new else s.adc_c,
        adc_u_dc=u_dc if new else s.adc_u_dc,
        done=new,
        errors=min(errors + (1 if wrong else 0), EVENTS_MAX),
        codes=(c0, c1, c2, c3, c4, c5, c6, c7),
        codes_valid=valid,
        error=error,
    )
    f = following
    return following, Outputs(
        adc_a=f.adc_a,
        adc_b=f.adc_b,
        adc_c=f.adc_c,
        adc_u_dc=f.adc_u_dc,
        codes_done=f.done,
        converter_errors=f.errors,
        converter_refused=refused,
        converter_over=over,
        convst=convst,
        cs_n=cs_n,
        sclk=sclk,
        den=den,
        daddr=daddr,
        mod_clock=mod_clock,
    )


SOURCES = {SPI: spi_converter, XADC: xadc_reader, DELTA_SIGMA: delta_sigma}
ON_A_BOARD = {
    "word_bits": "spi_bits",
    "skip_bits": "spi_skip",
    "sample_delay": "spi_delay",
    "channels": "xadc_channels",
    "timeout": "xadc_timeout",
}


def stimuli(rng, config):
    """The stimuli of the converter that is built, with channels in every order."""
    ports = {p.name: p for p in BLOCK.ports(config)}
    still = {name: p.low for name, p in ports.items()}
    if config["CURRENTS"] == EXTERNAL:
        return [
            still | {f"code_{x}_in": int(rng.integers(4096)) for x in ("a", "b", "c", "u_dc")}
            | {"codes_valid_in": int(k % 3 == 0)}
            for k in range(200)
        ]  # fmt: skip
    given = SOURCES[config["CURRENTS"]].stimuli(rng, {"ADC_BITS": config["ADC_BITS"], "LINES": config["SPI_LINES"]})
    return _on_channels(given[:9000], rng, still, 500)


def patient_stimuli(rng, config):
    """More of the converter's frames, with other channels for every few of them; errors until their counter is full."""
    if config["CURRENTS"] == EXTERNAL:
        return []
    still = {p.name: p.low for p in BLOCK.ports(config)}
    given = SOURCES[config["CURRENTS"]].stimuli(rng, {"ADC_BITS": config["ADC_BITS"], "LINES": config["SPI_LINES"]})
    # A trigger in every clock: settings that are refused, a frame still in work, or a window that has not begun.
    failing = still | {"sample_trigger": 1, "start_clocks": 9}
    failing = [failing] * (2 * EVENTS.hi) + [still] * 9 + [still | {"clear_encoder": 1}] * 9
    return _on_channels(given[-12000:], rng, still, 160) + failing


def _on_channels(given, rng, still, often):
    """The converter's rows with the names that the board has, and other channels after so many of them."""
    rows, channels = [], {}
    for k, row in enumerate(given):
        if k % often == 0:
            channels = {f"channel_{x}": int(rng.integers(8)) for x in ("a", "b", "c", "u_dc")}
        row = {ON_A_BOARD.get(name, name): value for name, value in row.items()}
        rows.append(still | row | channels | {"clear_encoder": int(k % 3000 == 2999)})
    return rows


_SPI = {p.name: p for p in spi_converter.BLOCK.inputs + spi_converter.BLOCK.registers + spi_converter.BLOCK.outputs}
_XADC = {p.name: p for p in xadc_reader.BLOCK.inputs + xadc_reader.BLOCK.registers + xadc_reader.BLOCK.outputs}
_SIGMA = {p.name: p for p in delta_sigma.BLOCK.inputs}
CHANNEL = Format(0, 3, 0)
CODES = ("a", "b", "c", "u_dc")

INPUTS = (
    _SPI["miso"],
    Port("busy", BIT, doc="1: the converter converts, not synchronous"),
    *(_XADC[n] for n in ("eoc", "drdy", "drp_do")),
    *(_SIGMA[n] for n in ("mod_data", "mod_clock_in")),
    *(Port(f"code_{x}_in", CODE, doc=f"code from elsewhere, {x}") for x in CODES),
    Port("codes_valid_in", BIT, doc="1: the codes from elsewhere are there"),
    Port("sample_trigger", BIT, doc="1: take a sample"),
    Port("clear_encoder", BIT, doc="1: clear the counter of errors"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    *(renamed(p, ON_A_BOARD.get(p.name, p.name)) for p in spi_converter.BLOCK.registers),
    *(Port(f"channel_{x}", CHANNEL, doc=f"code of the converter that is {x}") for x in CODES),
    *(renamed(p, ON_A_BOARD.get(p.name, p.name)) for p in xadc_reader.BLOCK.registers[:-1]),
    *delta_sigma.REGISTERS,
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
OUTPUTS = (
    *(Port(f"adc_{x}", CODE, doc=f"ADC code, {x}") for x in CODES),
    Port("codes_done", BIT, doc="1: the four codes are new"),
    Port("converter_errors", EVENTS, doc="triggers without codes, saturates"),
    Port("converter_refused", BIT, doc="1: the registers of the SPI converters contradict each other"),
    Port("converter_over", BIT, doc="1: fast overcurrent of a modulator"),
    *(_SPI[n] for n in ("convst", "cs_n", "sclk")),
    *(_XADC[n] for n in ("den", "daddr")),
    Port("mod_clock", BIT, doc="clock for the modulators"),
)
Outputs = namedtuple("Outputs", [p.name for p in OUTPUTS])

BLOCK = Block(
    name="current_front",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=OUTPUTS,
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"cs_n": 1},
    configs=(
        {"CURRENTS": 0, "ADC_BITS": 16, "SPI_LINES": 4},
        {"CURRENTS": 1, "ADC_BITS": 16, "SPI_LINES": 4},
        {"CURRENTS": 2, "ADC_BITS": 12, "SPI_LINES": 4},
        {"CURRENTS": 3, "ADC_BITS": 16, "SPI_LINES": 4},
    ),
    width_from={
        "miso": lambda config: Format(0, config["SPI_LINES"], 0),
        **{f"code_{x}_in": code_format for x in CODES},
        **{f"adc_{x}": code_format for x in CODES},
    },
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
