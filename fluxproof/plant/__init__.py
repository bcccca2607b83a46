# SPDX-License-Identifier: BSD-3-Clause
"""Float physics of the drive: machine, shaft, inverter and sensors, in SI units.

Amplitude-invariant Clarke, d axis at the electrical angle theta, motor
convention, phase order a, b, c.  This package imports nothing else of the
project: it models the hardware.
"""

from fluxproof.plant import layout
from fluxproof.plant.averaged import advance_averaged, skewed_currents
from fluxproof.plant.bus import Bus, advance_bus
from fluxproof.plant.drive_plant import AveragedPlant, SwitchingPlant, initial_state, plant_params
from fluxproof.plant.flux_map import FluxMap
from fluxproof.plant.inverter import Inverter, averaged_leg_voltage
from fluxproof.plant.kernel import PlantParams, refresh
from fluxproof.plant.layout import STATE_SIZE, empty_state, state_names
from fluxproof.plant.mechanics import FREE, IMPOSED_SPEED, Profile, profile, profile_at
from fluxproof.plant.modulation import FALLING, RISING, centred_gates, half_gates
from fluxproof.plant.pmsm import Harmonic, Machine, flux_from_currents, machine_params
from fluxproof.plant.sensors import (
    Sensors,
    current_code,
    hash_normal,
    position_code,
    sensor_params,
    u_dc_code,
)
from fluxproof.plant.switching import advance_switching

__all__ = [
    "FALLING",
    "FREE",
    "IMPOSED_SPEED",
    "RISING",
    "STATE_SIZE",
    "AveragedPlant",
    "Bus",
    "FluxMap",
    "Harmonic",
    "Inverter",
    "Machine",
    "PlantParams",
    "Profile",
    "Sensors",
    "SwitchingPlant",
    "advance_averaged",
    "advance_bus",
    "advance_switching",
    "averaged_leg_voltage",
    "centred_gates",
    "current_code",
    "empty_state",
    "flux_from_currents",
    "half_gates",
    "hash_normal",
    "initial_state",
    "layout",
    "machine_params",
    "plant_params",
    "position_code",
    "profile",
    "profile_at",
    "refresh",
    "sensor_params",
    "skewed_currents",
    "state_names",
    "u_dc_code",
]
