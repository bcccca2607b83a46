# SPDX-License-Identifier: BSD-3-Clause
"""Sheets of a dynamometer without a voltage of the control: speed, q current, torque at the shaft, bus current.

T = 3/2 p (psi + (L_d - L_q) i_d) i_q - dry sign(omega) - B omega_m,    i_q recorded at a scale
"""

from __future__ import annotations

import numpy as np

from studies.brought.drives import Made, case, drive_of, true_machine
from studies.scored.truth import Case, Cause, Truth

DRIVES = ("hub_36v", "servo_24v", "spindle_400v", "paper001")
SPEEDS = (0.15, 0.4, 0.7, 0.95, -0.5)  # of the rated speed
LOADS = (0.0, 0.25, 0.5, 0.75, 1.0, -0.4)  # of the rated current
TRANSDUCER = 2e-3  # of the rated torque, rms
SCALE, FLUX, DRY = 1.07, 0.92, 0.05  # of the currents, of psi, dry torque of the rated one
EITHER = ("magnet_flux", "current_scale")  # the torque per ampere is the product of both
KINDS = ("healthy", "flux", "scale", "friction", "flux and friction")
HEADER = "speed [rpm],i_q [A],torque [Nm],DC bus [A]"


def _sheet(kind: str, name: str, rng) -> Made:
    drive = drive_of(name)
    machine, causes = true_machine(drive, **({"magnet_flux_wb": FLUX} if "flux" in kind else {}))
    # The same ampere of torque: a cause that the flux is as well, so that both are an answer only together.
    causes = [Cause(c.names, c.sizes, ("current_scale",)) for c in causes]
    scale = SCALE if kind == "scale" else 1.0
    if kind == "scale":
        causes = [Cause(("current_scale",), {}, ("magnet_flux",))]
    pairs, rated_a = machine["pole_pairs"], machine["rated_current_a"]
    rated = 1.5 * pairs * machine["magnet_flux_wb"] * rated_a
    dry = machine.get("coulomb_friction_nm", 0.0)
    if "friction" in kind:
        dry += DRY * rated
        causes.append(Cause(("friction",), {"coulomb_friction_nm": (0.8 * dry, 1.2 * dry)}))
    omega, i_q = (x.ravel() for x in np.meshgrid(SPEEDS, LOADS, indexing="ij"))
    omega, i_q = omega * machine["rated_speed_rad_s"], i_q * rated_a
    drag = dry * np.sign(omega) + machine.get("viscous_friction_nms", 0.0) * omega
    torque = 1.5 * pairs * machine["magnet_flux_wb"] * i_q - drag
    power = (torque + drag) * omega + 1.5 * machine["resistance_ohm"] * i_q**2
    bus = power / drive["inverter"]["dc_bus_v"]
    torque = torque + TRANSDUCER * rated * rng.standard_normal(len(torque))
    rows = zip(omega * 30.0 / np.pi, scale * i_q, torque, bus, strict=True)
    text = "\n".join([HEADER, *(",".join(f"{x:.5g}" for x in row) for row in rows)]) + "\n"
    return Made(text, drive, Truth(tuple(causes)))


def cases() -> list[Case]:
    return [
        case("dyno", f"{drive}_{kind.replace(' ', '_')}", lambda rng, k=kind, d=drive: _sheet(k, d, rng))
        for drive in DRIVES
        for kind in KINDS
    ]
