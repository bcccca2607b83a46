# SPDX-License-Identifier: BSD-3-Clause
"""Wrong units that the magnitude of the values reveals: duties in percent, milliamps, millivolts, kelvin.

Values are compared with the rated values of drive.toml, with a margin of a factor of 20.  If they exceed it and no
single unit explains it, the recording is rejected, since a wrong guess would give a wrong diagnosis.  A column whose
unit is documented (in the file, in [columns] or by the logger's map) is never converted, as the nameplate may be wrong.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.conventions.units import IN_A_DUTY, KELVIN, OF_BUS_VOLTAGE, OF_CURRENT, OF_VOLTAGE
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "units"
AFTER = ("codes",)
MUCH = 20.0  # times the rated value: more than any overload
PLAUSIBLE = 4.0  # times the rated value, after the conversion
ROUNDING = 0.005
LARGEST_INDEX = 1.3  # 4 / pi, of the six-step operation, relative to half the bus voltage
AXES = (("i_q", "u_q_ref"), ("i_d", "u_d_ref"))
CURRENTS = ("i_a", "i_b", "i_c", "i_d", "i_q", "i_d_ref", "i_q_ref")


def check(recording, nominal) -> None:
    _currents(recording, nominal.machine)
    _duties(recording)
    _bus(recording, nominal.inverter.dc_bus_v)
    _voltages(recording, nominal)
    _winding(recording)


def _size(values) -> float:
    """A robust maximum of the magnitude, without spikes; of long arrays every 16th value is used."""
    return float(np.percentile(np.abs(values[:: max(1, len(values) // 65536)]), 99.5))


def _convert(recording, names, factor, unit, offset=0.0) -> None:
    """Convert columns; meta "column_scales" tells it to a drive file that describes these columns."""
    scales = dict(recording.meta.get("column_scales", {}))
    for name in names:
        recording.columns[name] = recording[name] * factor + offset
        before, start = scales.get(name, (1.0, 0.0))
        scales[name] = before * factor, start * factor + offset
    recording.meta["column_scales"] = scales
    recording.meta["rescaled"] = [*recording.meta.get("rescaled", ()), *names]
    recording.problems.append(
        Problem("unit", f"{', '.join(names)} in {unit}", names[0], 0, len(recording), "converted")
    )


def _documented(recording, *names) -> bool:
    """Whether the unit of any of these columns is written down."""
    return bool(set(names) & set(recording.meta.get("documented_units", ())))


def _refuse(recording, name, message, names=()) -> None:
    """Reject a recording because of a column; names: all columns that a conversion would have changed."""
    if _documented(recording, name, *names):
        message += "; its documented unit was not changed: correct the unit in [columns], or the drive file"
    recording.problems.append(Problem("unit", message, name, 0, len(recording), fatal=True))


def _winding(recording) -> None:
    """Kelvin becomes degC; a documented temperature that no winding survives is not used."""
    temp = recording.columns.get("temp_winding")
    if temp is None or not 250.0 < np.median(temp) < 500.0:
        return
    if not _documented(recording, "temp_winding"):
        _convert(recording, ("temp_winding",), 1.0, "kelvin", KELVIN)
        return
    message = f"the median of temp_winding is {np.median(temp):.0f} degC as documented, which looks like kelvin"
    recording.problems.append(Problem("unit", message, "temp_winding", 0, len(recording), "not used"))
    del recording.columns["temp_winding"]


def _currents(recording, machine) -> None:
    rated = machine.rated_current_a
    large = {
        name: size for name in CURRENTS if name in recording.columns and (size := _size(recording[name])) > MUCH * rated
    }
    if not large:
        return
    exchanged = next((pair for pair in AXES if pair[0] in large and _is_exchanged(recording, pair, machine)), None)
    if exchanged:
        current, voltage = exchanged
        message = f"reaches {large[current]:.4g} A and {voltage} {_size(recording[voltage]):.3g} V: they look swapped"
        _refuse(recording, current, f"{message}; exchange their names in [columns]")
        return
    for unit, factor in OF_CURRENT.items():
        if max(large.values()) * factor <= PLAUSIBLE * rated and not _documented(recording, *large):
            # A unit applies to a sensor board: to all currents of a frame, unless the others differ in magnitude.
            _convert(recording, tuple(large), factor, unit)
            return
    name = max(large, key=large.__getitem__)
    times = f"{large[name] / rated:.0f} times rated_current_a = {rated:g} A"
    _refuse(recording, name, f"reaches {large[name]:.4g} A, {times}", large)


def _is_exchanged(recording, pair, machine) -> bool:
    """Whether a current is as large as the voltage that the speed needs, and its voltage no larger than a current."""
    current, voltage = pair
    if not recording.has(*pair, "omega_e"):
        return False
    needed = _size(recording["omega_e"]) * machine.magnet_flux_wb
    as_voltage = needed / PLAUSIBLE < _size(recording[current]) < needed * PLAUSIBLE
    return as_voltage and _size(recording[voltage]) < min(PLAUSIBLE * machine.rated_current_a, needed / PLAUSIBLE)


def _duties(recording) -> None:
    names = tuple(name for name in ("d_a", "d_b", "d_c") if name in recording.columns)
    if len(names) < 3:
        return
    low = min(float(np.min(recording[name])) for name in names)
    high = max(float(np.max(recording[name])) for name in names)
    mean = float(np.mean([np.mean(recording[name]) for name in names]))
    for unit, factor in IN_A_DUTY.items():
        if (
            low >= -ROUNDING * factor
            and 0.1 * factor < high <= factor * (1 + ROUNDING)
            and 0.2 * factor < mean < 0.8 * factor
            and not _documented(recording, *names)
        ):
            _convert(recording, names, 1.0 / factor, unit)
            return
    if low < -0.1 and high <= 1.0 + ROUNDING and low >= -1.0 - ROUNDING and abs(mean) < 0.2:
        _refuse(
            recording,
            "d_a",
            f"duties range from {low:.3g} to {high:.3g}: give their factor and offset in [columns]",
        )
    elif high > 1.5 or low < -0.5:
        worst = max(names, key=lambda name: float(np.max(np.abs(recording[name]))))
        out = (recording[worst] > 1.0 + ROUNDING) | (recording[worst] < -ROUNDING)
        if np.count_nonzero(out) > 0.01 * len(out):
            message = f"duties range from {low:.4g} to {high:.4g}; 0 to 1, or percent, is expected"
            _refuse(recording, worst, message, names)


def _bus(recording, nominal_v) -> None:
    if "u_dc" not in recording.columns:
        return
    ratio = float(np.median(recording["u_dc"])) / nominal_v
    for unit, factor in OF_BUS_VOLTAGE.items():
        if abs(ratio * factor - 1.0) < 0.3 and not _documented(recording, "u_dc"):
            _convert(recording, ("u_dc",), factor, unit)
            return
    if not 0.02 < ratio < MUCH:
        message = f"the median of u_dc is {ratio * nominal_v:.4g} V, but dc_bus_v = {nominal_v:g} V"
        _refuse(recording, "u_dc", message)


def _voltages(recording, nominal) -> None:
    nominal_v = nominal.inverter.dc_bus_v
    names = tuple(name for name in ("u_d_ref", "u_q_ref") if name in recording.columns)
    size = max((_size(recording[name]) for name in names), default=0.0)
    if size > MUCH * nominal_v:
        unit, factor = next(((u, f) for u, f in OF_VOLTAGE.items() if size * f < nominal_v), (None, 1.0))
        if unit and not _documented(recording, *names):
            _convert(recording, names, factor, unit)
        else:
            _refuse(recording, names[0], f"voltages reach {size:.4g} V with a bus of {nominal_v:g} V", names)
    if names and not set(names) & set(recording.meta.get("of_bus", ())):
        _modulation_index(recording, names, size, nominal)


def _modulation_index(recording, names, size, nominal) -> None:
    """Refuse voltages that are no larger than a modulation index, where the speed needs many times as much."""
    if not 0.0 < size < LARGEST_INDEX or not recording.has("omega_e"):
        return
    needed = _size(recording["omega_e"]) * nominal.machine.magnet_flux_wb
    as_index = size * nominal.inverter.dc_bus_v
    if needed > MUCH * size and needed / PLAUSIBLE < as_index < needed * PLAUSIBLE:
        message = (
            f"{', '.join(names)} reach {size:.3g} V, but the recorded speed needs about {needed:.3g} V; if they are a "
            f"modulation index, name its unit in [columns]: {names[0]} = {{name = '{names[0]}', unit = 'u_dc/2'}}"
        )
        recording.problems.append(Problem("unit", message, names[0], 0, len(recording), fatal=True))
