# SPDX-License-Identifier: BSD-3-Clause
"""The VHDL of the register map, from the compiled SystemRDL alone: register_map_pkg.vhd and the register files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import jinja2

from golden_model.io import board_map, motor_map
from golden_model.records import RECORDS
from scripts.registers.compiled import Part, Word

TEMPLATES = Path(__file__).resolve().parent
ADDRESS_BITS = 12
GENERICS = {
    "ADC_BITS": 16,
    "POSITION_BITS": 16,
    "CARRIER_HALF": 10000,
    "CLOCK_HZ": 200000000,
    "ESTIMATORS": 1,
    "REFERENCES": 0,
    "POSITION_LOOP": 0,
    "RESIDUAL": 0,
    "MODES": 0,
    "OVERMODULATION": 0,
    "GEARING": 0,
}  # as in the core
BOARD_GENERICS = {"ENCODER": 1, "CURRENTS": 1, "SPI_LINES": 4, "MASTER": 0}
BETWEEN, STILL, AT_ONCE = ("setting", "sample pulse"), ("still setting",), ("command", "pulse")
BUS = (
    ("s_axi_awaddr", "in", 12),
    ("s_axi_awvalid", "in", 1),
    ("s_axi_awready", "out", 1),
    ("s_axi_wdata", "in", 32),
    ("s_axi_wstrb", "in", 4),
    ("s_axi_wvalid", "in", 1),
    ("s_axi_wready", "out", 1),
    ("s_axi_bresp", "out", 2),
    ("s_axi_bvalid", "out", 1),
    ("s_axi_bready", "in", 1),
    ("s_axi_araddr", "in", 12),
    ("s_axi_arvalid", "in", 1),
    ("s_axi_arready", "out", 1),
    ("s_axi_rdata", "out", 32),
    ("s_axi_rresp", "out", 2),
    ("s_axi_rvalid", "out", 1),
    ("s_axi_rready", "in", 1),
)


def place(port: str) -> str:
    """The VHDL name of a value: a field of one of the core's records, or a port of its own."""
    for record in ("settings", "observed", "estimated"):
        if port in RECORDS[f"{record}_t"]:
            return f"{record}.{port}"
    return port


def writable(word: Word) -> bool:
    """Whether software can write the register."""
    return word.kind in BETWEEN + STILL + AT_ONCE


def word_bits(words: list[Word]) -> int:
    """Address bits of a word: enough for the last register."""
    return max(word.index for word in words).bit_length()


def package(words: list[Word]) -> str:
    """rtl/generated/register_map_pkg.vhd."""
    bits = limit_bits(words)

    def limit(end: int) -> str:
        return f"to_signed({end}, REGISTER_LIMIT_W)"

    def access(word: Word) -> str:
        names = {**dict.fromkeys(BETWEEN, "REGISTER_BETWEEN"), **dict.fromkeys(AT_ONCE, "REGISTER_AT_ONCE")}
        names |= dict.fromkeys(STILL, "REGISTER_STILL")
        return names.get(word.kind, "REGISTER_READ_ONLY")

    stored, shown = [w for w in words if writable(w)], [w for w in words if w.kind == "status"]
    # Ranges from zero last: they need the smallest selection logic
    ranges = sorted({(w.parts[0].low, w.parts[0].high) for w in stored}, key=lambda r: (r[0] == 0, r))
    bits_of_range = (len(ranges) - 1).bit_length()

    def range_of(word: Word) -> str:
        number = ranges.index((word.parts[0].low, word.parts[0].high))
        return f"to_unsigned({number}, REGISTER_RANGE_W)"

    def limits_of(end: int) -> list[tuple[str, str]]:
        return _arms([(k, limit(both[end])) for k, both in enumerate(ranges)], limit(0), 1 << bits_of_range)

    def of_words(chosen: list[Word], value_of: Callable[[Word], str], default: str) -> list[tuple[str, str]]:
        return _arms([(word.index, value_of(word)) for word in chosen], default, 1 << word_bits(words))

    by_word, by_range = ("word", "REGISTER_WORD_W"), ("number", "REGISTER_RANGE_W")
    signed, none = of_words(shown, lambda w: f"'{int(w.parts[0].signed)}'", "'0'"), "REGISTER_NONE"
    numbers, limits = "unsigned(REGISTER_RANGE_W - 1 downto 0)", "signed(REGISTER_LIMIT_W - 1 downto 0)"
    first = "to_unsigned(0, REGISTER_RANGE_W)"
    tables = [
        ("access", *by_word, "unsigned(2 downto 0)", "unsigned", of_words(words, access, none)),
        ("range", *by_word, numbers, "unsigned", of_words(stored, range_of, first)),
        ("signed", *by_word, "std_logic", "std_logic", signed),
        ("low", *by_range, limits, "signed", limits_of(0)),
        ("high", *by_range, limits, "signed", limits_of(1)),
    ]
    return _render(
        "register_map_pkg.vhd.j2",
        address_bits=ADDRESS_BITS,
        word_bits=word_bits(words),
        limit_bits=bits,
        range_bits=bits_of_range,
        tables=tables,
    )


def _arms(table: list[tuple[int, str]], default: str, size: int) -> list[tuple[str, str]]:
    """(value, choices) of an aggregate: each value once, runs of neighbours as ranges, the keys between as given."""
    of_value: dict[str, list[int]] = {}
    for key, value in (dict.fromkeys(range(size), default) | dict(table)).items():
        of_value.setdefault(value, []).append(key)
    chosen = {value: _choices(keys) for value, keys in of_value.items()}
    width = max(map(len, chosen.values()))
    return [(value, choices.ljust(width)) for value, choices in chosen.items()]


def _choices(indices: list[int]) -> str:
    runs: list[list[int]] = []
    for index in indices:
        if runs and runs[-1][1] == index - 1:
            runs[-1][1] = index
        else:
            runs.append([index, index])
    return " | ".join(str(a) if a == b else f"{a} to {b}" for a, b in runs)


def of_core(words: list[Word]) -> list[Word]:
    """The registers of the core alone: those below the board's block of addresses."""
    return [word for word in words if word.address < board_map.BASE]


def of_board(words: list[Word]) -> list[Word]:
    """The registers of core and board: those below the motor's block of addresses."""
    return [word for word in words if word.address < motor_map.BASE]


def limit_bits(words: list[Word]) -> int:
    """Bits of a signed number that holds every range of the registers."""
    ends = [end for word in words if writable(word) for end in (word.parts[0].low, word.parts[0].high)]
    return max((end if end >= 0 else ~end).bit_length() + 1 for end in ends)


def register_file(words: list[Word], name: str = "register_file") -> str:
    """rtl/generated/register_file.vhd, or that of a board or a motor: the same with further blocks of addresses."""
    generics = {n: v for n, v in (GENERICS | BOARD_GENERICS).items() if n.lower() in {w.name for w in words}}
    stored = [(word, word.parts[0]) for word in words if writable(word)]
    reads = _reads(words)
    reads_width = max(len(f"shown({choice})") for choice, _ in reads)
    ports = [("clk", "in", "std_logic", ""), ("rst", "in", "std_logic", "synchronous, active high")]
    ports += [(name, mode, _vector(width), "") for name, mode, width in BUS]
    ports.append(("sample_busy", "in", "std_logic", "a sample is in flight"))
    ports.append(("host_write", "out", "std_logic", "a write was accepted"))
    ports.append(("settings", "out", "settings_t", "registers of the blocks"))
    ports += [("observed", "in", "observed_t", ""), ("estimated", "in", "estimated_t", "")]
    alone = [(w, p, "out") for w, p in stored] + [(w, p, "in") for w in words if w.kind == "status" for p in w.parts]
    ports += [
        (p.port, mode, p.vhdl_type, f"{w.address:03x} {p.doc}") for w, p, mode in alone if place(p.port) == p.port
    ]
    names = [name for name, *_ in ports]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"register file: two registers with the port {', '.join(twice)}")
    return _render(
        "register_file.vhd.j2",
        name=name,
        word_bits=word_bits(words),
        limit_bits=limit_bits(words),
        generics=generics,
        generic_width=max(map(len, generics)),
        ports=ports,
        port_width=max(map(len, names)),
        bus=[name for name, *_ in BUS],
        pulses=[(p.port, _zero(p)) for w, p in stored if w.kind == "pulse"],
        sample_pulses=[p.port for w, p in stored if w.kind == "sample pulse"],
        stores=[(w.index, place(p.port), _from_word(p), w.needs.upper()) for w, p in stored],
        resets=[(place(p.port), _reset(w, p)) for w, p in stored],
        output_width=max(len(place(part.port)) for _, part in stored),
        kept={w.index: "pulse" not in w.kind for w, _ in stored},
        at_once={w.index: w.kind in AT_ONCE for w, _ in stored},
        reads=[(choice, _wrapped(value, reads_width + len("   <= "))) for choice, value in reads],
        sign=_sign(words),
        reads_width=reads_width,
    )


def _vector(width: int) -> str:
    return "std_logic" if width == 1 else f"std_logic_vector({width - 1} downto 0)"


def _from_word(part: Part) -> str:
    if part.vhdl_type == "std_logic":
        return "held(0)"
    return f"{'signed' if part.signed else 'unsigned'}(held({part.port_width - 1} downto 0))"


def _zero(part: Part) -> str:
    return "'0'" if part.vhdl_type == "std_logic" else "(others => '0')"


def _reset(word: Word, part: Part) -> str:
    if part.vhdl_type == "std_logic":
        return f"'{word.reset}'"
    if word.reset == 0:
        return "(others => '0')"
    value = word.reset - (1 << 32) if part.signed and word.reset >> 31 else word.reset
    return f"to_{'signed' if part.signed else 'unsigned'}({value}, {part.port_width})"


def _sign(words: list[Word]) -> int:
    """The bit from which every signed word is extended: the sign of the widest."""
    return max(part.port_width for word in words for part in word.parts if part.signed) - 1


def _reads(words: list[Word]) -> list[tuple[str, str]]:
    """(index or range, value) of every word and of the zeros between; stored words: their reset value."""
    rows: list[tuple[str, str]] = []
    following = 0
    for word in words:
        if writable(word) and "pulse" not in word.kind and not word.reset:
            continue
        rows += _gap(following, word.index)
        rows.append((str(word.index), _read(word, _sign(words))))
        following = word.index + 1
    return rows + _gap(following, 1 << word_bits(words))


def _gap(start: int, end: int) -> list[tuple[str, str]]:
    return [(f"{start} to {end - 1}", "(others => (others => '0'))")] if start < end else []


def _read(word: Word, sign: int) -> str:
    if word.kind in ("constant", "setting", "still setting", "command"):
        return f'x"{word.reset:08X}"'
    if word.kind == "generic":
        return f"std_logic_vector(to_unsigned({word.name.upper()}, 32))"
    if word.parts[0].signed:
        return f"{_zeros(31 - sign)} & std_logic_vector(resize({place(word.parts[0].port)}, {sign + 1}))"
    if len(word.parts) == 1 and word.parts[0].vhdl_type != "std_logic":
        return f"std_logic_vector(resize({place(word.parts[0].port)}, 32))"
    bits: list[str] = []  # from bit 31 down
    free = 32
    for part in sorted(word.parts, key=lambda p: -p.bit):
        top = part.bit + part.width
        bits += [_zeros(free - top)] if free > top else []
        name = place(part.port)
        bits.append(name if part.vhdl_type == "std_logic" else f"std_logic_vector({name})")
        free = part.bit
    bits += [_zeros(free)] if free else []
    return " & ".join(bits)


def _wrapped(value: str, indent: int) -> str:
    """A long concatenation in lines of up to 118 characters."""
    lines = [""]
    for piece in value.split(" & "):
        if indent + len(lines[-1]) + len(piece) + 3 > 118:
            lines.append("")
        lines[-1] += f"{piece} & "
    return ("\n" + " " * indent).join(line.rstrip() for line in lines).removesuffix(" &")


def _zeros(count: int) -> str:
    return '"' + "0" * count + '"'


def _render(template: str, **context) -> str:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**context)
