# SPDX-License-Identifier: BSD-3-Clause
"""Changes in the core that follow from named effects: keys of drive.toml and the resulting registers.

A sensor error becomes the trim that cancels it.  With a reading  i' = (1 + e) i + o  that includes the trims in force,
the new trims are

    current_gain' = current_gain / (1 + e)      current_offset_code' = current_offset_code + o / (current_gain * lsb)
    u_dc_gain'    = u_dc_gain / (1 + e)         theta_offset' = theta_offset - pole_pairs * position_offset

The dead time is never written to [inverter]: there it is a command to the gates, and a shorter one could cause a
shoot-through.  The loss of the legs is given to the compensation instead, which is limited to three times that value.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.plant_section import merged
from fluxproof.diagnosis.ground.result import NamedEffect
from golden_model import drive as drives
from golden_model.drive_keys import DriveError, key_of
from golden_model.registers import registers
from golden_model.scaling import LOSS_MARGIN, LOSS_SPARE_V

ORDERS = ("inverter.dead_time_s",)  # keys of drive.toml that command the hardware instead of describing it
DESCRIBED = ("machine", "inverter")  # sections whose keys mean the same to the core and to the plant
LOSSES = ("dead_time_s", "v_switch_v", "v_diode_v")


class CoreValue(NamedTuple):
    """A new value for the core: a key of drive.toml, a register or a start value."""

    key: str  # "[machine] resistance_ohm", "register r_s", ...
    value: float
    unit: str
    why: str


class Change(NamedTuple):
    """A key of one of the core's sections with its new value and the effect that changes it."""

    section: str
    key: str
    value: float | tuple[float, ...]
    why: str


def core_changes(nominal: Nominal, effects: list[NamedEffect]) -> list[Change]:
    """Changes of keys in the core's sections, without those that contradict the rest of the drive file."""
    wanted = list(_wanted(nominal, merged(effects)))
    drive = core_drive(nominal)
    if drive is None:
        return wanted
    kept = []
    for change in wanted:
        try:
            changed = _with(drive, change)
            registers(changed)
        except DriveError:
            continue
        drive, kept = changed, [*kept, change]
    return kept


def core_values(nominal: Nominal, effects: list[NamedEffect]) -> list[CoreValue]:
    """New values for the core; also register integers if the drive file has the core's sections."""
    values, changes = [], core_changes(nominal, effects)
    for change in changes:
        fields = dataclasses.fields(drives.SECTIONS[change.section])
        unit = key_of(next(f for f in fields if f.name == change.key)).unit
        several = change.value if isinstance(change.value, tuple) else (change.value,)
        for k, value in enumerate(several):
            phase = f" phase {'abc'[k]}" if len(several) > 1 else ""
            values.append(CoreValue(f"[{change.section}] {change.key}{phase}", value, unit, change.why))
    loss = found_loss_v(nominal, merged(effects))
    if loss is not None:
        why = "voltage loss of a leg at the nominal bus voltage: the value to which the core's estimate should converge"
        values.append(CoreValue("V_dead", loss, "V", why))
    return values + _registers(core_drive(nominal), changes)


def core_drive(nominal: Nominal):
    """The nominal drive as the core's Drive, or None if the file does not describe the core."""
    try:
        parts = [kind(**_given(getattr(nominal, name), kind)) for name, kind in drives.SECTIONS.items()]
        return drives.Drive(*parts)
    except (DriveError, TypeError):
        return None


def _given(part, kind) -> dict:
    """The section's values; a missing required one is omitted, so that the dataclass raises the error."""
    needed = {f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING}
    return {k: v for k, v in vars(part).items() if not (k in needed and v is None)}


def _with(drive, change: Change):
    """The drive with one key changed; DriveError as for a file."""
    section = dataclasses.replace(getattr(drive, change.section), **{change.key: change.value})
    return dataclasses.replace(drive, **{change.section: section})


def _registers(drive, changes) -> list[CoreValue]:
    """The registers that change, as integers; an empty list without the core."""
    if drive is None:
        return []
    before, changed = registers(drive).values, drive
    for change in changes:
        changed = _with(changed, change)
    after = registers(changed).values
    return [
        CoreValue(f"register {name}", new, "integer", f"was {old}")
        for name, old, new in zip(before._fields, before, after, strict=True)
        if old != new
    ]


def _wanted(nominal: Nominal, found: dict):
    """The changes of the core's keys that follow from the plant's keys."""
    for name, (value, effects) in found.items():
        section, key = name.split(".", 1)
        fields = {f.name: f for f in dataclasses.fields(drives.SECTIONS[section])} if section in DESCRIBED else {}
        if key in fields and name not in ORDERS:
            yield Change(section, key, _within(key_of(fields[key]), value), " and ".join(effects))
    yield from _trims(nominal, found)
    loss = found_loss_v(nominal, found)
    if loss is not None:
        usual = nominal_loss_v(nominal)
        given = nominal.control.v_dead_limit_v
        limit = LOSS_MARGIN * usual + LOSS_SPARE_V if given is None else given
        if LOSS_MARGIN * loss + LOSS_SPARE_V > limit:
            why = " and ".join(dict.fromkeys(n for k in LOSSES for n in found.get(f"inverter.{k}", (0, ()))[1]))
            yield Change("control", "v_dead_limit_v", LOSS_MARGIN * loss + LOSS_SPARE_V, why)
    if "timing.delay_s" in found:
        late, effects = found["timing.delay_s"]
        samples = nominal.control.delay_samples + late / nominal.sample_time_s
        yield Change("control", "delay_samples", max(0.0, samples), " and ".join(effects))


def _within(key, value):
    """An estimate clipped to the key's range: the estimate of a zero coefficient may be slightly negative."""
    return min(max(float(value), key.lo), key.hi) if key.kind == "float" else value


def _trims(nominal: Nominal, found: dict):
    """Trims of the sensors; none if [sensors] does not describe them."""
    s = nominal.sensors

    def error(key):
        value, effects = found.get(f"sensors.{key}", (None, ()))
        return value, " and ".join(effects)

    if s.adc_bits is not None and s.current_range_a is not None:
        mid = 2.0 ** (s.adc_bits - 1)
        offset, why = error("current_offset_a")
        if offset is not None:
            zero = zip(s.current_offset_code or (mid,) * 3, offset, s.current_gain, strict=True)
            codes = tuple(code + o / trim * mid / s.current_range_a for code, o, trim in zero)
            yield Change("sensors", "current_offset_code", codes, why)
        gain, why = error("current_gain_error")
        if gain is not None:
            trims = tuple(trim / (1.0 + e) for trim, e in zip(s.current_gain, gain, strict=True))
            yield Change("sensors", "current_gain", trims, why)
    gain, why = error("u_dc_gain_error")
    if gain is not None and s.u_dc_range_v is not None:
        yield Change("sensors", "u_dc_gain", s.u_dc_gain / (1.0 + gain), why)
    turned, why = error("position_offset_rad")
    if turned is not None and s.position_bits is not None:
        yield Change("sensors", "theta_offset_rad", s.theta_offset_rad - nominal.machine.pole_pairs * turned, why)


def nominal_loss_v(nominal: Nominal) -> float:
    """Voltage loss of a leg of the nominal drive [V]."""
    return _loss_v(nominal, {})


def found_loss_v(nominal: Nominal, found: dict) -> float | None:
    """Voltage loss of a leg with the identified dead time and drops [V]; None if none were identified."""
    values = {k: found[f"inverter.{k}"][0] for k in LOSSES if f"inverter.{k}" in found}
    return _loss_v(nominal, values) if values else None


def _loss_v(nominal, values):
    """scaling.leg_loss_v for a partly described drive."""
    i = nominal.inverter
    v = {k: getattr(i, k) or 0.0 for k in LOSSES} | values
    return v["dead_time_s"] * i.pwm_frequency_hz * i.dc_bus_v + (v["v_switch_v"] + v["v_diode_v"]) / 2.0
