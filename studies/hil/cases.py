# SPDX-License-Identifier: BSD-3-Clause
"""The effects that registers of the motor and its sensors can switch on, with their true sizes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from fluxproof.plant import Machine
from fluxproof.plant.pmsm import Harmonic

COLD_C, HOT_C, COPPER = 20.0, 80.0, 0.0039  # of the winding
DRIFT, LOSS, LOST_AT = -0.06, -0.08, 0.55  # of the magnets: by warming, at once; share of the recording
B_NMS, DRY_NM = 3e-3, 0.15
TEETH_NM, TEETH = 0.25, 24
Values = Mapping[str, float]


class Case(NamedTuple):
    """An effect, what it changes, and the true values of the parameters that are judged, from the rounded machine."""

    effect: str
    machine: Callable[[Machine], dict] = lambda _m: {}
    truth: Callable[[Machine], Values] = lambda _m: {}
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)
    offset_a: float = 0.0
    bus: float = 1.0
    angle_rad: float = 0.0  # electrical
    drops_v: float = 0.0
    # Factors on R and on the magnet flux over the share of the recording that has passed; the registers are written
    # while the motor runs, and the plan is gone through twice.
    resistance: Callable[[np.ndarray], np.ndarray] | None = None
    magnets: Callable[[np.ndarray], np.ndarray] | None = None
    free: bool = False  # the shaft turns freely under speed control

    @property
    def name(self) -> str:
        return self.effect or ("none, free shaft" if self.free else "none")

    @property
    def moves(self) -> bool:
        return self.resistance is not None or self.magnets is not None


def winding_c(share: np.ndarray) -> np.ndarray:
    """Temperature of the winding [degC], which the core is told."""
    return COLD_C + (HOT_C - COLD_C) * share


CASES = (
    Case(""),
    Case("", free=True),
    Case(
        "resistance", lambda m: {"resistance_ohm": 1.2 * m.resistance_ohm},
        lambda m: {"resistance_ohm": m.resistance_ohm},
    ),
    Case(
        "magnet_flux", lambda m: {"magnet_flux_wb": 0.92 * m.magnet_flux_wb},
        lambda m: {"magnet_flux_wb": m.magnet_flux_wb},
    ),
    Case(
        "inductance_d", lambda m: {"inductance_d_h": 1.15 * m.inductance_d_h},
        lambda m: {"inductance_d_h": m.inductance_d_h},
    ),
    Case(
        "inductance_q", lambda m: {"inductance_q_h": 0.85 * m.inductance_q_h},
        lambda m: {"inductance_q_h": m.inductance_q_h},
    ),
    Case("saturation", lambda _m: {"saturation_q_per_a2": 4e-3}),
    Case(
        "cross_saturation", lambda _m: {"cross_saturation_wb_per_a2": 3e-4},
        lambda m: {"cross_saturation_wb_per_a2": m.cross_saturation_wb_per_a2},
    ),
    Case(
        "phase_resistance_asymmetry", lambda _m: {"phase_resistance_asymmetry": (0.1, -0.05, -0.05)},
        lambda m: {f"asymmetry_{x}": relative(m, k) for k, x in enumerate("abc")},
    ),
    Case("emf_harmonics", lambda _m: {"emf_harmonics": (Harmonic(6, 0.02, 0.0, 0.3),)}),
    Case("dead_time", drops_v=3.0),
    Case("current_gain", gains=(1.03, 1.0, 1.0)),
    Case("current_offset", truth=lambda _m: {"offset_a_a": 0.08}, offset_a=0.08),
    Case("current_scale", truth=lambda _m: {"scale": 0.04}, gains=(1.04, 1.04, 1.04)),
    Case("udc_gain", truth=lambda _m: {"udc_gain": 0.03}, bus=1.03),
    Case(
        "resistance_temperature", truth=lambda _m: {"resistance_temp_coeff_per_k": COPPER},
        resistance=lambda share: 1.0 + COPPER * (winding_c(share) - COLD_C),
    ),
    Case(
        "magnet_temperature", truth=lambda m: {"magnet_flux_drift_wb": DRIFT * m.magnet_flux_wb},
        magnets=lambda share: 1.0 + DRIFT * share,
    ),
    Case(
        "demagnetisation", truth=lambda m: {"magnet_flux_step_wb": LOSS * m.magnet_flux_wb},
        magnets=lambda share: 1.0 + LOSS * (share >= LOST_AT),
    ),
    Case(
        "friction", lambda _m: {"viscous_friction_nms": B_NMS, "coulomb_friction_nm": DRY_NM},
        lambda m: {"viscous_friction_nms": m.viscous_friction_nms, "coulomb_friction_nm": m.coulomb_friction_nm},
        free=True,
    ),
    Case(
        "cogging", lambda _m: {"cogging_amplitude_nm": TEETH_NM, "cogging_order": TEETH},
        lambda m: {"cogging_nm": m.cogging_amplitude_nm}, free=True,
    ),
    Case("encoder_offset", truth=lambda _m: {"offset_rad": math.radians(2.0)}, angle_rad=math.radians(2.0)),
)  # fmt: skip


def relative(m: Machine, phase: int) -> float:
    """A phase's resistance over the mean of the three, minus one."""
    shares = [1.0 + x for x in m.phase_resistance_asymmetry]
    return 3.0 * shares[phase] / sum(shares) - 1.0
