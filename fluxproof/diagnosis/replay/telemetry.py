# SPDX-License-Identifier: BSD-3-Clause
"""The core's telemetry dump: its inputs and outputs, sample by sample, bit for bit.

    8 bytes   MAGIC
    u32       length of the header
    header    JSON, UTF-8: see ``_header``
    samples   u32 sample counter, then one i32 per field in the header's order

All little-endian.  The fields are those of fluxproof.Sample (inputs of the core), then any of fluxproof.Observed
(its outputs); their names, formats and units come from the golden model and are therefore consistent with it.
telemetry_stream.py converts a capture of the core's AXI4-Stream to a dump with the fields of the packet; a simulation
can record every field.

``checksum`` covers what the replay cannot verify: scales, configuration, field list.  Registers and start state have
their own checksum.  If it fails, the dump is accepted and the change reported (``altered``), because the replay
(digital.py) finds a wrong register and names it.  The same applies to the samples.
"""

from __future__ import annotations

import json
import math
import struct
import zlib
from importlib import metadata
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.replay.telemetry_columns import columns_of
from fluxproof.files import write_bytes
from fluxproof.quote import shown
from golden_model import fluxproof
from golden_model.control.reference_table import BLANK
from golden_model.drive_checks import CARRIER_HALF_RANGE
from golden_model.formats import PU
from golden_model.io import sample_latch
from golden_model.kernel import CACHE_DIR
from golden_model.units import si_per_lsb, unit

MAGIC = b"FLUXDUMP"
VERSION = 1
INPUTS = dict(zip(fluxproof.Sample._fields, sample_latch.BLOCK.outputs, strict=True))
OBSERVED = fluxproof.OBSERVED
BASES = ("current_a", "voltage_v", "omega_me_rad_s", "flux_wb")
CONFIG = {
    "adc_bits": (12, 16), "position_bits": (8, 18), "carrier_half": CARRIER_HALF_RANGE, "estimators": (0, 1),
    "references": (0, 1), "position_loop": (0, 1), "residual": (0, 1), "modes": (0, 1),
    "overmodulation": (0, 1), "gearing": (0, 1),
}  # fmt: skip
JUDGED = ("registers", "first_state")  # verified by the replay
REQUIRED = {
    "sample_time_s": float, "config": dict, "registers": dict, "bases": dict, "fields": list, "samples": int,
    "checksum": dict,
}  # fmt: skip


def is_dump(path) -> bool:
    """Whether the file begins with MAGIC."""
    try:
        with open(path, "rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False


def write_dump(path, drive, register_set, samples, observed, first_state=None, counter=None, changes=None) -> Path:
    """Write a dump atomically; returns the path.

    drive: golden_model.drive.Drive.  register_set: its registers and generics.
    samples: (n, 13) integers in the order of fluxproof.Sample, or {field: (n,)}.
    observed: {name of fluxproof.Observed: (n,) integers}, any of them.
    first_state: fluxproof.State before the first sample; None means the reset state if the counter starts at 0, else
    unknown.  counter: (n,) samples since reset, default 0, 1, ...; a jump means lost samples.
    changes: {number of a sample: {register: integer}}, what the host wrote while the drive ran; None: not known, so
    that a drive in position or voltage mode cannot be replayed.  The words of the torque table are register_set's.
    """
    if isinstance(samples, dict):
        samples = np.stack([samples[name] for name in fluxproof.Sample._fields], axis=1)
    samples = np.asarray(samples)
    names = [name for name in fluxproof.Observed._fields if name in observed]
    counter = np.arange(len(samples)) if counter is None else np.asarray(counter)
    rows = np.zeros(len(samples), _record([*fluxproof.Sample._fields, *names]))
    rows["counter"] = counter % 2**32
    for column, name in enumerate(fluxproof.Sample._fields):
        rows[name] = samples[:, column]
    for name in names:
        rows[name] = observed[name]
    header = _header(drive, register_set, names, len(samples), first_state, changes)
    text = json.dumps(header).encode()
    return write_bytes(Path(path), MAGIC + struct.pack("<I", len(text)) + text + rows.tobytes())


def read_dump(path) -> tuple[dict[str, np.ndarray], dict]:
    """(canonical columns in SI units, float64, (n,), meta); RecordingError names the defect of an invalid dump.

    meta: ``telemetry`` (the header), ``registers`` {name: integer}, ``config`` {generic: integer}, ``samples`` (n, 13)
    int64 in the order of fluxproof.Sample, ``observed`` {name: (n,) int64}, ``counter`` (n,) int64, ``start``
    ("reset", "state" or "unknown"), ``first_state`` (fluxproof.State or None), ``gaps`` [(row, samples lost before
    it)], ``table`` (words of the torque table, or None), ``changes`` ([(row, {register: integer})], or None),
    ``scales`` {field: SI per LSB}, ``altered`` [parts changed after writing], ``sample_time_s``.
    """
    path = Path(path)
    try:
        size = path.stat().st_size
        with open(path, "rb") as file:
            header, start = _read_header(path, file, size)
            names = [entry["name"] for entry in header["fields"]]
            record = _record(names)
            wanted = start + header["samples"] * record.itemsize
            if size != wanted:
                whole = (size - start) // record.itemsize
                raise RecordingError(
                    f"{path}: {header['samples']} samples of {record.itemsize} bytes are announced, the file contains "
                    f"{whole} and {(size - start) % record.itemsize} bytes: it was truncated or extended"
                )
            rows = np.fromfile(file, record)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None
    meta = _meta(header, rows, names)
    return columns_of(meta), meta


def _record(names):
    """NumPy record type of one sample."""
    return np.dtype([("counter", "<u4"), *((name, "<i4") for name in names)])


def _header(drive, register_set, names, count, first_state, changes) -> dict:
    """The header without the samples; ``si_per_lsb`` converts a field's integers to its unit."""
    ports = INPUTS | OBSERVED

    def described(name):
        signal = INPUTS[name].name if name in INPUTS else name
        return {
            "name": name,
            "format": str(ports[name].fmt),
            "unit": unit(signal),
            "si_per_lsb": float(si_per_lsb(signal, drive)),
        }

    header = {
        "format": "fluxproof telemetry",
        "version": VERSION,
        "core": {"version": core_version(), "golden_model": CACHE_DIR.name},
        "samples": count,
        "sample_time_s": drive.sample_time_s,
        "duty_applied_after_samples": drive.control.duty_applied_after_samples,
        "config": register_set.config._asdict(),
        "bases": {k: getattr(drive.bases, k) for k in ("current_a", "voltage_v", "omega_me_rad_s", "flux_wb")},
        "fields": [described(name) for name in (*fluxproof.Sample._fields, *names)],
        "registers": register_set.values._asdict(),
        "first_state": None if first_state is None else [list(p) if isinstance(p, tuple) else p for p in first_state],
    }
    if register_set.config.references and register_set.values.use_table:
        header["table"] = register_set.table.tolist()
    if changes is not None:
        header["changes"] = [[number, changes[number]] for number in sorted(changes)]
    header = json.loads(json.dumps(header, default=int))
    return header | {"checksum": _checksums(header)}


def core_version() -> str:
    """The version of the package, or "unknown" if it is not installed."""
    try:
        return metadata.version("fluxproof")
    except metadata.PackageNotFoundError:
        return "unknown"


def _checksums(header) -> dict:
    """CRC-32 of the header's fixed part and of the parts that the replay verifies."""
    parts = {"fixed": {}, "judged": {}}
    for key, value in header.items():
        if key != "checksum":
            parts["judged" if key in JUDGED else "fixed"][key] = value
    canonical = {name: json.dumps(part, sort_keys=True, separators=(",", ":")) for name, part in parts.items()}
    return {name: zlib.crc32(text.encode()) for name, text in canonical.items()}


def _read_header(path, file, size) -> tuple[dict, int]:
    """(header, byte offset of the samples)."""
    head = file.read(len(MAGIC) + 4)
    if head[: len(MAGIC)] != MAGIC:
        raise RecordingError(f"{path}: not a telemetry dump: it does not begin with {MAGIC.decode()}")
    if len(head) < len(MAGIC) + 4:
        raise RecordingError(f"{path}: byte {len(head)}: the file ends before its header's length")
    (length,) = struct.unpack("<I", head[len(MAGIC) :])
    start = len(head) + length
    if start > size:
        raise RecordingError(
            f"{path}: the header is {length} bytes long, the file ends after {size - len(head)} of them"
        )
    text = file.read(length)
    try:
        header = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path}: the header is not JSON: {error}") from None
    if not isinstance(header, dict) or header.get("format") != "fluxproof telemetry":
        raise RecordingError(f"{path}: the header does not identify fluxproof telemetry")
    if header.get("version") != VERSION:
        raise RecordingError(
            f"{path}: dump version {shown(header.get('version'))}: this reader knows version {VERSION}"
        )
    for key, kind in REQUIRED.items():
        if type(header.get(key)) is not kind:
            raise RecordingError(f"{path}: header: {key} is missing or not of type {kind.__name__}")
    if header["checksum"].get("fixed") != _checksums(header)["fixed"]:
        raise RecordingError(f"{path}: the header's checksum is wrong: the file was damaged or edited")
    _check_names(path, header)
    return header, start


def _check_names(path, header):
    """Check the parts outside the main checksum; RecordingError also for a dump of another core."""
    try:
        names = [entry["name"] for entry in header["fields"]]
        numbers = [entry["si_per_lsb"] for entry in header["fields"]]
        numbers += [header["sample_time_s"], *(header["bases"][k] for k in BASES)]
        header["config"].setdefault("estimators", 1)  # dumps before the core could leave them out
        header["config"].setdefault("references", 0)  # dumps before the core had them
        header["config"].setdefault("position_loop", 0)
        header["config"].setdefault("residual", 0)
        header["config"].setdefault("modes", 0)
        header["config"].setdefault("overmodulation", 0)
        header["config"].setdefault("gearing", 0)
        legal = {name: lo <= header["config"][name] <= hi for name, (lo, hi) in CONFIG.items()}
        sane = all(isinstance(x, float) and math.isfinite(x) and x > 0.0 for x in numbers)
    except (KeyError, TypeError) as error:
        raise RecordingError(f"{path}: header: bases, config or fields are incomplete: {shown(error)}") from None
    if not sane or not all(legal.values()):
        raise RecordingError(f"{path}: header: a scale or a generic of the core is out of its range")
    known = set(fluxproof.Observed._fields)
    inputs, answers = names[: len(INPUTS)], names[len(INPUTS) :]
    strangers = [name for name in answers if name not in known]
    if inputs != list(INPUTS) or strangers or len(set(answers)) != len(answers):
        which = shown(", ".join(map(str, strangers or inputs)), 200)
        raise RecordingError(f"{path}: header: fields {which} are not those of this core")
    for name, value in header["registers"].items():
        if name not in fluxproof.REGISTERS:
            raise RecordingError(f"{path}: header: register {shown(name)} is unknown to this core")
        if type(value) is not int or not -(2**31) <= value < 2**31:
            raise RecordingError(f"{path}: header: register {name} = {str(value)[:40]} must be a 32-bit integer")
    missing = [name for name in fluxproof.REGISTERS if name not in header["registers"]]
    if missing:
        raise RecordingError(f"{path}: header: register {missing[0]} is missing")
    _check_written(path, header)
    if header["samples"] < 1:
        raise RecordingError(f"{path}: the dump contains no samples")
    try:
        _state(header.get("first_state"))
    except (TypeError, ValueError):
        raise RecordingError(f"{path}: header: first_state is not a state of the core") from None


def _check_written(path, header):
    """The torque table and the changes of registers, which a dump may have."""
    if (table := header.get("table")) is not None:
        try:
            words = np.array(table)
        except ValueError:  # of unequal lengths
            words = np.zeros(0)
        if words.shape != BLANK.shape or words.dtype.kind != "i" or words.min() < PU.lo or words.max() > PU.hi:
            raise RecordingError(f"{path}: header: table is not one of {BLANK.shape[0]} x {BLANK.shape[1]} words")
    changes = header.get("changes", [])
    if type(changes) is not list or not all(_is_change(change) for change in changes):
        raise RecordingError(f"{path}: header: changes are not pairs of a sample's number and registers")


def _is_change(change) -> bool:
    """Whether it is [number, {register: 32-bit integer}]."""
    if type(change) is not list or [type(part) for part in change] != [int, dict] or change[0] < 0:
        return False
    whole = all(type(v) is int and -(2**31) <= v < 2**31 for v in change[1].values())
    return whole and set(change[1]) <= set(fluxproof.REGISTERS)


def _integers(values: list) -> list:
    """The values; ValueError if one is no integer of a state."""
    if not all(type(v) is int and -(2**62) < v < 2**62 for v in values):
        raise ValueError("a state consists of integers")
    return values


def _state(nested):
    """fluxproof.State from nested lists of integers; None stays None."""
    if nested is None:
        return None
    defaults = fluxproof.State()
    parts = []
    for value, default in zip([*nested, *defaults[len(nested) :]], defaults, strict=True):  # of an older core: shorter
        if isinstance(default, tuple):
            inner: list = list(value)  # pyright: ignore[reportArgumentType]
            inner += default[len(inner) :]
            if len(inner) != len(default):
                raise ValueError("wrong number of integers")
            parts.append(type(default)(*_integers(inner)))
        else:
            parts += _integers([value])
    return fluxproof.State(*parts)


def _number(change) -> int:
    """The sample's number of a change."""
    return change[0]


def _meta(header, rows, names) -> dict:
    """The ``meta`` of read_dump."""
    counter = rows["counter"].astype(np.int64)
    step = (np.diff(counter) + 2**31) % 2**32 - 2**31  # the counter wraps after five days at 10 kHz
    counter = counter[0] + np.concatenate(([0], np.cumsum(step)))
    first_state = _state(header.get("first_state"))
    start = "state" if first_state is not None else "reset" if counter[0] == 0 else "unknown"
    changes = header.get("changes")
    if changes is not None:
        changes = [(int(np.searchsorted(counter, number)), dict(new)) for number, new in sorted(changes, key=_number)]
    same = header["checksum"].get("judged") == _checksums(header)["judged"]
    return {
        "telemetry": header,
        "registers": dict(header["registers"]),
        "config": dict(header["config"]),
        "samples": np.stack([rows[name] for name in names[: len(INPUTS)]], axis=1).astype(np.int64),
        "observed": {name: rows[name].astype(np.int64) for name in names[len(INPUTS) :]},
        "counter": counter,
        "start": start,
        "first_state": first_state,
        "table": None if "table" not in header else np.array(header["table"], np.int64),
        "changes": changes,
        "gaps": [(int(k) + 1, int(step[k]) - 1) for k in np.flatnonzero(step != 1)],
        "scales": {entry["name"]: entry["si_per_lsb"] for entry in header["fields"]},
        "altered": [] if same else ["the checksum of registers or start state is wrong"],
        "sample_time_s": header["sample_time_s"],
    }
