# SPDX-License-Identifier: BSD-3-Clause
"""The plant that a drive file describes: drive.toml with its [plant.*] sections.

The core's own sections describe the machine and the inverter.  [sensors] describes the sensors as the core assumes
them; without [plant.sensors] they are exactly that: an offset code of 32800 means a sensor offset of 32 codes.
A key in [plant.machine], [plant.inverter] or [plant.sensors] replaces the value from the core's sections; the names are
those of plant.Machine, plant.Inverter and plant.Sensors (plant_keys.py).  Three of them have a special form in TOML:

    emf_harmonics = [[order, amplitude_d, amplitude_q, phase_rad], ...]
    flux_map      = a table of i_d_a (n), i_q_a (m), psi_d_wb (n x m), psi_q_wb (n x m), or the name of a CSV file with
                    these columns beside the drive file, such as flux_map.csv of a diagnosis
    lists of three for the phases a, b, c
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from fluxproof.diagnosis.ground.nominal import Nominal, flux_map_path, load_nominal
from fluxproof.diagnosis.ground.plant_keys import HARMONICS, Hil, Timing, plain, plant_given, read_flux_map
from fluxproof.diagnosis.ground.result import NamedEffect
from fluxproof.plant import Inverter, Machine, Sensors
from golden_model.drive_keys import DriveError

FINE_BITS = 24  # resolution of undescribed sensors: fine enough to be negligible


class Plant(NamedTuple):
    """The hardware of a drive in the types of the float plant."""

    machine: Machine
    inverter: Inverter
    sensors: Sensors
    timing: Timing
    hil: Hil


# Keys that an effect gives in addition to those of the drive file; the others it gives as a whole.
ADDS = {
    "machine.saturation_d_per_a2", "machine.saturation_q_per_a2", "machine.cross_saturation_wb_per_a2",
    "machine.iron_conductance_s", "machine.phase_resistance_asymmetry", HARMONICS,
    "machine.resistance_temp_coeff_per_k", "inverter.dead_time_s", "timing.sampling_skew_s",
}  # fmt: skip
ORDERED = ("inverter.dead_time_s",)
# Keys for which the plant rejects negative values; a noisy estimate of zero may be negative and is clipped.
NOT_NEGATIVE = {f"inverter.{f.name}" for f in dataclasses.fields(Inverter)} | {
    f"machine.{name}"
    for name in ("saturation_d_per_a2", "saturation_q_per_a2", "iron_conductance_s", "viscous_friction_nms",
                 "coulomb_friction_nm")
}  # fmt: skip


def merged(effects: list[NamedEffect]) -> dict:
    """{plant key: (value, names of the effects)}.  If several effects change one key, gains multiply, offsets add and
    harmonics are concatenated; for other keys the last value is used, since effects that were estimated together agree.
    """
    found: dict = {}
    for effect in effects:
        for key, value in effect.plant.items():
            value = plain(key, value)
            value = max(value, 0.0) if key in NOT_NEGATIVE else value
            before, names = found.get(key, (None, ()))
            if before is not None and key == "sensors.current_gain_error":
                value = tuple((1.0 + a) * (1.0 + b) - 1.0 for a, b in zip(before, value, strict=True))
            elif before is not None and key == "sensors.current_offset_a":
                value = tuple(a + b for a, b in zip(before, value, strict=True))
            elif before is not None and key == HARMONICS:
                value = before + value
            found[key] = (value, (*names, effect.name))
    return found


def in_addition(found: dict, nominal: Nominal) -> dict:
    """The plant keys of an effect that was found beside what the drive file describes of it: both together."""
    out, plant = dict(found), None
    for key in ADDS & set(found):
        plant = plant or plant_of(nominal)
        section, name = key.split(".", 1)
        given, value = getattr(getattr(plant, section), name), plain(key, found[key])
        if key in ORDERED and name not in nominal.plant.get(section, {}):
            continue  # in the core's own section it is a command to the gates
        several = isinstance(value, tuple) and key != HARMONICS
        out[key] = [a + b for a, b in zip(given, value, strict=True)] if several else given + value
    return out


def plant_of(source) -> Plant:
    """(Machine, Inverter, Sensors, Timing, Hil) of a drive file's path or of a Nominal; errors as in load_nominal."""
    nominal = source if isinstance(source, Nominal) else load_nominal(source)
    given, chart = plant_given(nominal), flux_map_path(nominal)
    usual: dict[str, Any] = {"inertia_kgm2": 1e-3}
    try:
        if chart is not None:
            given["machine"]["flux_map"] = read_flux_map(chart)
        return Plant(
            Machine(**(usual | _described(nominal.machine, Machine) | given["machine"])),
            Inverter(**(_described(nominal.inverter, Inverter) | given["inverter"])),
            Sensors(**(described_sensors(nominal) | given["sensors"])),
            Timing(**given["timing"]),
            Hil(**given["hil"]),
        )
    except (TypeError, ValueError) as error:
        raise DriveError(f"{nominal.path}: section [plant]: {error}") from None


def _described(section, kind) -> dict[str, Any]:
    """The section's values under the plant's names; None selects the plant's default."""
    known = {f.name for f in dataclasses.fields(kind)}
    return {k: v for k, v in vars(section).items() if k in known and v is not None}


def described_sensors(nominal: Nominal) -> dict:
    """Fields of plant.Sensors as [sensors] describes them; fine and unlimited if it does not."""
    s, reach = nominal.sensors, 10.0 * nominal.machine.rated_current_a
    bits, full = s.adc_bits or FINE_BITS, s.current_range_a or reach
    volts = s.u_dc_range_v or 4.0 * nominal.inverter.dc_bus_v
    mid, turning = 2 ** (bits - 1), -1 if s.position_reverse else 1
    return {
        "current_bits": bits,
        "current_full_scale_a": full,
        "current_gain_error": tuple(1.0 / trim - 1.0 for trim in s.current_gain),
        "current_offset_a": tuple((code - mid) * full / mid for code in s.current_offset_code or (mid,) * 3),
        "u_dc_bits": bits,
        "u_dc_full_scale_v": volts,
        "u_dc_gain_error": 1.0 / s.u_dc_gain - 1.0,
        "u_dc_offset_v": s.u_dc_offset_code * volts / 2**bits,
        "position_bits": s.position_bits or FINE_BITS,
        "position_pole_pairs": s.position_pole_pairs,
        "position_offset_rad": -turning * s.theta_offset_rad / nominal.machine.pole_pairs,
        "position_direction": turning,
    }


def errors_beyond(sensors: Sensors, nominal: Nominal) -> dict:
    """Errors of the readings after the core has applied its nominal trims.

    current_gain (3,), current_offset [A] (3,): reading = current * gain + offset; u_dc_gain;
    theta_offset [rad]: electrical angle read minus the true one.
    """
    s, assumed = nominal.sensors, described_sensors(nominal)
    trims, p = np.array(s.current_gain), nominal.machine.pole_pairs
    beyond = np.subtract(sensors.current_offset_a, assumed["current_offset_a"])
    turned = sensors.position_offset_rad - assumed["position_offset_rad"]
    return {
        "current_gain": trims * (1.0 + np.array(sensors.current_gain_error)),
        "current_offset_a": trims * beyond,
        "u_dc_gain": s.u_dc_gain * (1.0 + sensors.u_dc_gain_error),
        "theta_offset": p * assumed["position_direction"] * turned,
    }
