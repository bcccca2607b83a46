# SPDX-License-Identifier: BSD-3-Clause
"""The registers and generics of fluxproof_board from drive.toml: what its front ends need beside the core's registers.

One function for the Python bus, `fluxproof registers`, the C header of `fluxproof project` and the commissioning.

    board_registers(drive)   every setting of core and front ends, by name
    board_generics(drive)    ENCODER, CURRENTS, SPI_LINES, MASTER
    board_set(drive)         the same as rows to print or to load

Times become whole clocks, rounded up where a shorter one would be wrong.  A register of a front end that the drive
does not have is 0, or the lowest value of its range.  docs/board.md says what each register does.
"""

import math

from golden_model.converters import sinc3, sinc_overcurrent
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError, needed
from golden_model.encoders import edge_timer, master_encoder, position_bridge, turn_counter
from golden_model.front_ends import frame_s
from golden_model.io import board_map, speed
from golden_model.io.sample_checks import JUMP
from golden_model.registers import RegisterSet, Row, registers

SECTORS = 6  # of Hall sensors in an electrical turn
HALL_JUMP = 1.5 / SECTORS  # turns: a sector is a step, two at once are a fault
CORRECTED = 5.0 / 360.0  # electrical turns: lost counts up to here are mended, more is another encoder or a wrong index
FILTER_S, OF_COUNT = 100e-9, 0.25  # of a pin, where none is given: of the time of a count at rated speed at most
OVER_BITS = 16  # oversampling of the fast overcurrent: noise of 1.6 % of full scale, 3.2 us at 20 MHz
NO_TRIP = sinc_overcurrent.TOTAL.hi
PAIRS = ((0x10, 0x18), (0x11, 0x19))  # XADC: VAUX0 with 8, VAUX1 with 9, each pair held at one instant
XADC_CONVERSION_S, XADC_READS = 1.3e-6, 64  # longest conversion; clocks of the reads of a frame
TO_BUSY = 2  # clocks of the synchroniser of BUSY

ENCODER = {"code": 0, "abz": 1, "hall": 2, "ssi": 4, "biss": 5, "endat": 6}
CURRENTS = {"codes": 0, "spi": 1, "xadc": 2, "delta_sigma": 3}
MODES = {"2.1": (0b000111, 0), "2.2": (0b111000, 1)}  # EnDat: mode command, whether its frame has a second error bit


def has_board(drive: Drive) -> bool:
    """Whether the drive file describes pins, so that fluxproof_board is the top and not fluxproof_axi."""
    return drive.encoder.kind != "code" or drive.converters.kind != "codes"


def board_generics(drive: Drive) -> dict[str, int]:
    """The generics that choose the front ends, by their registers' names."""
    return {
        "encoder": ENCODER[drive.encoder.kind],
        "currents": CURRENTS[drive.converters.kind],
        "spi_lines": spi_lines(drive),
        "master": int(drive.position.gear_master_counts is not None),
    }


def pin_generics(drive: Drive) -> dict[str, int]:
    """The generics of every top beside the core's: the ring, the levels of the pins, the filter of the trip."""
    names = ("ring_rows", "gate_active", "trip_active", "brake_active")
    return {name: getattr(drive.core, name) for name in names} | {"trip_filter": drive.core.trip_filter_clocks}


def spi_lines(drive: Drive) -> int:
    """Data lines: one for each current and the bus, or for two of them."""
    if drive.converters.kind != "spi":
        return 1
    channels = drive.current_sensors + 1
    return -(-channels // 2) if drive.converters.two_words else channels


def core_changes(drive: Drive) -> dict[str, int]:
    """Registers of the core that a front end makes other ones than registers(drive) has them."""
    kind = drive.encoder.kind
    if kind == "hall":  # theta_hall is an electrical angle already
        jump = JUMP.to_int(HALL_JUMP) if drive.protection.position_jump_rad is None else None
        per_turn = 2.0 * math.pi / drive.sample_time_s / drive.bases.omega_me_rad_s
        changes = {"speed_given": 1, "pole_pairs": 1, "k_speed": speed.K_SPEED.to_int(per_turn)}
        return changes if jump is None else changes | {"jump_max": jump}
    return {"speed_given": 1} if kind == "abz" else {}


def front_end_registers(drive: Drive) -> dict[str, int]:
    """Every setting of the front ends by name; DriveError names register and key of a value that does not fit."""
    ports = {name: port for name, port in board_map.settings().items() if name in board_map.SETTINGS}
    values = {name: max(port.low, 0) for name, port in ports.items()}
    for part in (_master(drive) | _encoder(drive), _converters(drive)):
        for name, (value, key) in part.items():
            low, high = ports[name].low, ports[name].high
            if not low <= value <= high:
                raise DriveError(f"register {name} from {key}: {value} is out of range: allowed is {low} to {high}")
            values[name] = value
    return values


def board_registers(drive: Drive) -> dict[str, int]:
    """Every setting of fluxproof_board by name: the core's and the front ends'."""
    return registers(drive).values._asdict() | core_changes(drive) | front_end_registers(drive)


def board_set(drive: Drive, flux=None) -> RegisterSet:
    """``registers(drive, flux)``, with the rows of the front ends where there are some; ``values`` are the core's."""
    core = registers(drive, flux)
    if not has_board(drive):
        return core
    changes, ports = core_changes(drive), board_map.settings()
    rows = [
        row if row.name not in changes else _row(row.name, changes[row.name], row.low, row.high) for row in core.rows
    ]
    rows += [_row(n, value, ports[n].low, ports[n].high) for n, value in front_end_registers(drive).items()]
    return core._replace(values=core.values._replace(**changes), rows=tuple(rows))


def _row(name: str, value: int, low: int, high: int) -> Row:
    """A register that is a number without unit."""
    return Row(name, float(value), "1", value, float(value), 0.0, 0.0 if value else None, low, high)


def _up(seconds: float, drive: Drive) -> int:
    """Clocks that are at least ``seconds``; a part of 1e-9 of a clock is the rounding of the division."""
    return math.ceil(seconds * drive.core.clock_hz - 1e-9 * max(seconds * drive.core.clock_hz, 1.0))


# ---------------------------------------------------------------- position


def _encoder(drive: Drive) -> dict:
    """{register: (value, key)} of the encoder's kind."""
    kind = drive.encoder.kind
    if kind == "abz":
        return _edges(drive, needed(drive.encoder.counts)) | _incremental(drive)
    if kind == "hall":
        return _edges(drive, SECTORS * drive.machine.pole_pairs)
    return {} if kind == "code" else _serial(drive)


def _edges(drive: Drive, counts: int) -> dict:
    """Filter of the pins and the speed between edges; ``counts`` edges a turn of the shaft."""
    m, given = drive.machine, drive.encoder.filter_s
    count_s = 2.0 * math.pi / m.rated_speed_rad_s / counts
    filter_clocks = _up(min(FILTER_S, OF_COUNT * count_s) if given is None else given, drive)
    key = "[encoder] counts, [machine] pole_pairs, rated_speed_rad_s, [core] clock_hz"
    try:
        k_edge = edge_timer.setting(counts, m.pole_pairs, drive.core.clock_hz, drive.bases.omega_me_rad_s)
    except ValueError as error:
        raise DriveError(f"register k_edge from {key}: {error}") from None
    return {"filter_clocks": (filter_clocks, "[encoder] filter_s, [core] clock_hz"), "k_edge": (k_edge, key)}


def _incremental(drive: Drive) -> dict:
    """Counts to codes, and the index."""
    e, counts = drive.encoder, needed(drive.encoder.counts)
    correct = max(2, int(CORRECTED * counts / drive.machine.pole_pairs))
    found = {n: (v, "[encoder] counts") for n, v in turn_counter.setting(counts, drive.sensors.position_bits).items()}
    found["correct_max"] = (correct, "[encoder] counts, [machine] pole_pairs")
    found["index_once"] = (int(e.index_passes == 1), "[encoder] index_passes")
    found["whole_lines"] = (int(e.whole_lines), "[encoder] whole_lines")
    found["index_phase"] = (e.index_phase or 0, "[encoder] index_phase")
    return found


def _master(drive: Drive) -> dict:
    """The gear's second encoder at A/B pins; its filter is the other encoder's where that has edges."""
    counts = drive.position.gear_master_counts
    if counts is None:
        return {}
    given = drive.encoder.filter_s
    found = {name: (value, "[position] gear_master_counts") for name, value in master_encoder.setting(counts).items()}
    clocks = _up(FILTER_S if given is None else given, drive)
    return found | {"filter_clocks": (clocks, "[encoder] filter_s, [core] clock_hz")}


def _serial(drive: Drive) -> dict:
    """Frame, its check, and the time from the encoder's latch to the sampling instant."""
    e, clock, bits = drive.encoder, drive.core.clock_hz, needed(drive.encoder.bits)
    check = int(e.crc is not False)
    half = _up(0.5 / needed(e.clock_hz), drive) - 1
    period = 2 * (half + 1)
    found = {
        "half_period": (half, "[encoder] clock_hz, [core] clock_hz"),
        "encoder_bits": (bits + e.turns_bits, "[encoder] bits, turns_bits"),
        "turn_bits": (bits, "[encoder] bits"),
        "bridge_max": (e.bridge_samples, "[encoder] bridge_samples"),
    }
    if e.kind == "ssi":
        found |= {"gray": (int(e.gray), "[encoder] gray"), "parity_on": (check, "[encoder] crc")}
    else:
        # Half a period above the time the encoder needs: a start bit that is lost is noticed too
        found["start_max"] = (_up(e.start_s, drive) + period // 2, "[encoder] start_s")
        found["crc_on"] = (check, "[encoder] crc")
    if e.kind == "endat":
        command, two = MODES[e.version]
        found |= {"mode_command": (command, "[encoder] version"), "two_errors": (two, "[encoder] version")}
    # A frame that ends behind the converters' codes belongs to the next sample
    late = 1.0 if frame_s(drive, period / clock) > codes_s(drive) else 0.0
    delay = late + sampled_s(drive) / drive.sample_time_s
    scaled = math.floor(delay / position_bridge.DELAY.lsb + 0.5)
    found["position_delay"] = (scaled, "[encoder] bits, clock_hz; [converters]; [sampling] delay_s")
    return found


# ---------------------------------------------------------------- currents


def sampled_s(drive: Drive) -> float:
    """From the trigger, which latches the position, to the sampling instant of the currents [s], modulo a sample."""
    return max(drive.sampling.delay_s, 0.0)


def codes_s(drive: Drive) -> float:
    """From the trigger to the converters' codes [s]."""
    c, clock = drive.converters, drive.core.clock_hz
    if c.kind == "spi":
        return (c.conversion_s or 0.0) + (spi_bits(drive) * (2 if c.two_words else 1) + 3) / needed(c.clock_hz)
    if c.kind == "xadc":
        return _conversions(drive) * XADC_CONVERSION_S + XADC_READS / clock
    if c.kind == "delta_sigma":
        return 1.5 * needed(c.oversampling) / needed(c.clock_hz)
    return 0.0


def spi_bits(drive: Drive) -> int:
    """Bits of a word."""
    return drive.converters.bits or drive.sensors.adc_bits


def _converters(drive: Drive) -> dict:
    """{register: (value, key)} of the converters' kind."""
    kinds = {"codes": lambda drive: {}, "spi": _spi, "xadc": _xadc, "delta_sigma": _delta_sigma}
    return kinds[drive.converters.kind](drive)


def _channels(drive: Drive, order: list[int]) -> dict:
    """Which code of the converter is which: the currents that have a sensor, then the bus."""
    names = [*("bc" if drive.current_sensors == 2 else "abc"), "u_dc"]
    found = {f"channel_{x}": (order[k], "[converters] currents, two_words") for k, x in enumerate(names)}
    return {"channel_a": (order[0], "[converters] currents")} | found


def _spi(drive: Drive) -> dict:
    c, clock = drive.converters, drive.core.clock_hz
    ratio = round(clock / needed(c.clock_hz))
    started = c.conversion_s is not None
    mode = c.mode if c.mode is not None else 0 if started else 2
    wait = _up(c.conversion_s or 0.0, drive) + TO_BUSY
    # Mode 2 with chip select: converters that launch a bit at the edge at which the one before is taken
    lead = ratio if mode == 2 and not started else ratio // 2
    delay = max(_up(c.round_trip_s, drive) - lead, 0)
    order = [line + 4 * word for line in range(spi_lines(drive)) for word in range(2 if c.two_words else 1)]
    return _channels(drive, order) | {
        "clock_ratio": (ratio, "[converters] clock_hz, [core] clock_hz"),
        "spi_bits": (spi_bits(drive), "[converters] bits"),
        "spi_skip": (c.skip_bits, "[converters] skip_bits"),
        "spi_delay": (delay, "[converters] round_trip_s, [core] clock_hz"),
        "wait_clocks": (wait if started else 0, "[converters] conversion_s, [core] clock_hz"),
        "busy_timeout": (2 * wait + 60, "[converters] conversion_s, [core] clock_hz"),
        "use_convst": (int(started), "[converters] conversion_s"),
        "two_words": (int(c.two_words), "[converters] two_words"),
        "clock_idle": (mode >> 1, "[converters] mode"),
        "second_edge": (mode & 1, "[converters] mode"),
        "signed_code": (int(c.signed_codes), "[converters] signed_codes"),
    }


def _conversions(drive: Drive) -> int:
    """Conversions of the XADC in a frame: pairs that hold what is needed."""
    return -(-(drive.current_sensors + 1) // 2)


def _xadc(drive: Drive) -> dict:
    """The two currents in the first pair; with three the third and the bus in the second."""
    addresses = [address for pair in PAIRS for address in pair]
    key = "[converters] currents, [core] clock_hz"
    timeout = _up(2.0 * _conversions(drive) * XADC_CONVERSION_S, drive) + 2 * XADC_READS
    found = _channels(drive, [0, 1, 2, 3]) | {f"address_{k}": (a, key) for k, a in enumerate(addresses)}
    return found | {
        "conversions": (_conversions(drive), key),
        "xadc_channels": (drive.current_sensors + 1, key),
        "xadc_timeout": (timeout, key),
        "signed_code": (int(drive.converters.signed_codes), "[converters] signed_codes"),
    }


def _delta_sigma(drive: Drive) -> dict:
    c, clock, oversampling = drive.converters, drive.core.clock_hz, needed(drive.converters.oversampling)
    ratio = round(clock / needed(c.clock_hz))
    delay = min(_up(c.round_trip_s, drive), ratio - 1)
    key = "[converters] clock_hz, oversampling; [core] clock_hz"
    try:
        # From the middle of a bit's time to its strobe: half a bit, the round trip, two registers
        late = ratio / 2 + delay + 2
        start = sinc3.centred(round(drive.sample_time_s * clock), oversampling, ratio, late)
    except ValueError as error:
        raise DriveError(f"register start_clocks from {key}: {error}") from None
    high, low = over_limits(drive)
    return {
        "mod_ratio": (ratio, key),
        "mod_delay": (delay, "[converters] round_trip_s, [core] clock_hz"),
        "oversampling": (oversampling, "[converters] oversampling"),
        "sinc_gain": (sinc3.gain_of(oversampling), "[converters] oversampling"),
        "start_clocks": (start, key),
        "trip_oversampling": (OVER_BITS, key),
        "limit_high": (high, "[protection] current_trip_a, [sensors] current_range_a"),
        "limit_low": (low, "[protection] current_trip_a, [sensors] current_range_a"),
    }


def over_limits(drive: Drive) -> tuple[int, int]:
    """Totals of the fast overcurrent: at the trip level of the core, or out of reach where that does not trip."""
    if not drive.protection.trip_overcurrent:
        return NO_TRIP, 0
    full = OVER_BITS**3
    trip = registers(drive).values.i_trip / 256.0 * drive.bases.current_a / drive.sensors.current_range_a
    away = min(math.floor(trip * full / 2.0 + 0.5), full // 2 - 1)
    return full // 2 + away, full // 2 - away


__all__ = ["board_generics", "board_registers", "board_set", "core_changes", "front_end_registers", "has_board"]
