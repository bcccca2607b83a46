# SPDX-License-Identifier: BSD-3-Clause
"""[encoder] and [converters] of drive.toml, both optional: what the board puts between its pins and the core.

The front ends of docs/board.md are set from these keys; without a section the core gets ready-made codes.
"""

import math
from dataclasses import dataclass

from golden_model.drive_keys import DriveError, choice, flag, not_negative, positive, refuse, whole

# kind -> (keys it needs, keys it may have besides)
ENCODERS = {
    "code": ((), ()),
    "abz": (("counts",), ("filter_s", "index_phase", "index_passes", "whole_lines")),
    "hall": ((), ("filter_s",)),
    "ssi": (("bits", "clock_hz"), ("turns_bits", "crc", "gray", "pause_s", "bridge_samples")),
    "biss": (("bits", "clock_hz"), ("turns_bits", "crc", "start_s", "pause_s", "bridge_samples")),
    "endat": (("bits", "clock_hz"), ("turns_bits", "crc", "version", "start_s", "pause_s", "bridge_samples")),
}
CONVERTERS = {
    "codes": ((), ("currents",)),
    "spi": (
        ("clock_hz",),
        ("currents", "bits", "skip_bits", "conversion_s", "two_words", "mode", "round_trip_s", "signed_codes"),
    ),
    "xadc": ((), ("currents", "signed_codes")),
    "delta_sigma": (("clock_hz", "oversampling"), ("currents", "round_trip_s")),
}
# Periods of the serial clock in a frame beside the word, see docs/board.md; BiSS-C and EnDat need start_s besides
FRAME_PERIODS = {"ssi": 3, "biss": 11, "endat": 18}
# Rest of the clock that an encoder wants before the next frame, where the drive file gives none: monoflop of SSI and
# timeout of BiSS-C, 20 us as most data sheets; recovery of EnDat 2.1, at most 30 us, and of 2.2, 3.75 us
PAUSE_S = {"ssi": 20e-6, "biss": 20e-6, "endat": 30e-6}
PAUSE_2_2_S = 3.75e-6
SPI_RATIO = (4, 16)  # clocks of the core in one of the converter, see converters/spi_converter


@dataclass(frozen=True)
class Encoder:
    """[encoder]; keys that do not belong to the kind are refused."""

    kind: str = choice(tuple(ENCODERS), "code: a position code that is ready for the core", "code")
    counts: int | None = whole(4, 1 << 18, "abz: counts a turn, four times the lines", None)
    bits: int | None = whole(8, 32, "ssi, biss, endat: bits of the place within a turn", None)
    turns_bits: int = whole(0, 24, "ssi, biss, endat: bits of whole turns, left out", 0)
    clock_hz: float | None = positive("Hz", "ssi, biss, endat: clock of a frame", None, most=20e6)
    crc: bool | None = flag("check bits of a frame: CRC of biss and endat, even parity of ssi; true if none", None)
    gray: bool = flag("ssi: the word is in Gray code", False)
    version: str = choice(("2.1", "2.2"), "endat: mode command of 2.1, or 2.2 with two error bits", "2.2")
    start_s: float = positive("s", "biss, endat: longest time to the start bit", 5e-6)
    pause_s: float | None = not_negative("s", "ssi, biss, endat: rest of the clock after a frame, data sheet", None)
    bridge_samples: int = whole(0, 255, "ssi, biss, endat: samples without a good frame that are bridged", 3)
    filter_s: float | None = not_negative("s", "abz, hall: shorter pulses on a pin have no effect", None)
    index_passes: int = whole(
        1, 2, "abz: passes of the index until it is believed; 1 where the shaft cannot turn on", 2
    )
    whole_lines: bool = flag("abz: speed over whole lines of four counts, for a disc whose counts are uneven", False)
    index_phase: int | None = whole(0, 3, "abz: quarter of a line in which Z counts; A, B = 00, 10, 11, 01", None)


@dataclass(frozen=True)
class Converters:
    """[converters]; keys that do not belong to the kind are refused."""

    kind: str = choice(tuple(CONVERTERS), "codes: codes that are ready for the core", "codes")
    currents: int = whole(2, 3, "current sensors; with 2 the third current is computed", 3)
    bits: int | None = whole(12, 32, "spi: bits of a word; adc_bits if none", None)
    skip_bits: int = whole(0, 20, "spi: bits before the code in a word", 0)
    clock_hz: float | None = positive("Hz", "spi: clock of a frame; delta_sigma: clock of the bits", None)
    conversion_s: float | None = not_negative("s", "spi: from the start of a conversion to its code", None)
    two_words: bool = flag("spi: two channels on a line", False)
    mode: int | None = whole(0, 3, "spi: mode; none: 2 with chip select, 0 with conversion_s", None)
    round_trip_s: float = not_negative("s", "spi, delta_sigma: from a clock's edge to stable data at the pin", 15e-9)
    signed_codes: bool = flag("spi, xadc: two's complement, zero is the middle of the range", False)
    oversampling: int | None = whole(32, 256, "delta_sigma: bits of a sinc3 window's third", None)


def check_encoder(drive):
    """The keys belong to the kind, and the encoder suits the core's position code and the rated speed."""
    e, bits = drive.encoder, drive.sensors.position_bits
    _belong("encoder", e, ENCODERS)
    if e.counts is not None and e.counts > 1 << bits:
        refuse("[encoder] counts", e.counts, f"up to {1 << bits}, codes of [sensors] position_bits = {bits}")
    if e.kind == "abz" and e.filter_s:
        # Two counts lie between two edges of one channel; a filter of half that time still lets every level through.
        edge_s = 6.283185307179586 / drive.machine.rated_speed_rad_s * 2.0 / e.counts
        if not e.filter_s < edge_s / 2.0:
            allowed = f"below {edge_s / 2.0:.4g} s, half the time between two edges of a channel at rated speed"
            refuse("[encoder] filter_s", e.filter_s, allowed)
    if e.kind in ("ssi", "biss", "endat"):
        waits = 0.0 if e.kind == "ssi" else e.start_s
        if not frame_s(drive) < drive.sample_time_s:
            left = drive.sample_time_s - waits - pause_s(drive)
            least = (frame_s(drive) - waits) * e.clock_hz / left if left > 0.0 else float("inf")
            allowed = f"above {least:.6g} Hz: a frame and a pause of {pause_s(drive):g} s must end within a PWM period"
            refuse("[encoder] clock_hz", e.clock_hz, allowed)
        rest, wanted = drive.sample_time_s - frame_s(drive), pause_s(drive)
        if rest < wanted:
            given = "" if e.pause_s is not None else f", ordinary for {e.kind},"
            raise DriveError(
                f"[encoder] pause_s = {wanted:g} s{given} is out of range: allowed is up to {rest:.4g} s, "
                f"which a frame of {frame_s(drive):.4g} s leaves between two samples; in a shorter one the encoder is "
                "not ready and answers every second frame only: give the pause of its data sheet, a faster clock_hz "
                "or a slower PWM"
            )
        if not e.clock_hz <= drive.core.clock_hz / 4.0:
            refuse("[encoder] clock_hz", e.clock_hz, f"up to {drive.core.clock_hz / 4.0:g} Hz, a quarter of clock_hz")


def pause_s(drive):
    """How long the clock of a serial encoder must rest between two frames [s]."""
    e = drive.encoder
    ordinary = PAUSE_2_2_S if e.kind == "endat" and e.version == "2.2" else PAUSE_S[e.kind]
    return ordinary if e.pause_s is None else e.pause_s


def frame_s(drive, period_s=None):
    """Time of a frame of a serial encoder [s], check bits included; ``period_s``: of its clock, clock_hz if none."""
    e = drive.encoder
    period_s = 1.0 / e.clock_hz if period_s is None else period_s
    waits = 0.0 if e.kind == "ssi" else e.start_s
    return (e.bits + e.turns_bits + FRAME_PERIODS[e.kind]) * period_s + waits


def check_converters(drive):
    """The keys belong to the kind, and the conversion fits the clock and the PWM period."""
    c, clock = drive.converters, drive.core.clock_hz
    _belong("converters", c, CONVERTERS)
    if c.kind == "spi":
        ratio, (lo, hi) = clock / c.clock_hz, SPI_RATIO
        if not lo <= ratio <= hi or abs(ratio / round(ratio) - 1.0) > 1e-6:
            around = {min(max(n, lo), hi) for n in (math.floor(min(ratio, hi)), math.ceil(min(ratio, hi)))}
            nearest = " and ".join(f"{clock / n:.7g} Hz" for n in sorted(around, reverse=True))
            allowed = f"[core] clock_hz = {clock:g} Hz over a whole number from {lo} to {hi}; nearest: {nearest}"
            refuse("[converters] clock_hz", c.clock_hz, allowed)
        least = drive.sensors.adc_bits + c.skip_bits
        if (c.bits or drive.sensors.adc_bits) < least:
            allowed = f"at least {least}, [sensors] adc_bits and skip_bits: the word must hold the code"
            refuse("[converters] bits", c.bits or drive.sensors.adc_bits, allowed)
    if c.kind == "delta_sigma":
        window_s, period_s = (3 * c.oversampling + 1) / c.clock_hz, drive.sample_time_s
        if not window_s <= period_s:
            allowed = f"up to {int((period_s * c.clock_hz - 1) / 3)}: the window must fit a PWM period"
            refuse("[converters] oversampling", c.oversampling, allowed)


def _belong(section, given, kinds):
    """What the kind needs is there, and nothing else is given."""
    needed, optional = kinds[given.kind]
    for key in needed:
        if getattr(given, key) is None:
            kind = f'[{section}] kind = "{given.kind}"'
            raise DriveError(f"[{section}] {key} is missing: {kind} needs {', '.join(needed)}")
    for key, field in given.__dataclass_fields__.items():
        if key != "kind" and key not in (*needed, *optional) and getattr(given, key) != field.default:
            may = ", ".join((*needed, *optional)) or "no further key"
            allowed = f'a key of another kind; kind = "{given.kind}" takes {may}'
            raise DriveError(f"[{section}] {key} = {getattr(given, key)} is {allowed}")
