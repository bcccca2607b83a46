# SPDX-License-Identifier: BSD-3-Clause
"""What the voltage, torque and speed constants of data sheets mean, as the flux linkage psi of a phase in star, peak.

With p pole pairs, the shaft at omega_m [rad/s] and sinusoidal EMF (peak of a phase: p*psi*omega_m):

    between lines      sqrt(3) times a phase;  rms = peak/sqrt(2)
    torque             T = 1.5*p*psi*I with the peak I of a phase;  I_peak = sqrt(2)*I_rms
    Kv [rpm/V]         the speed at which the peak between lines is the bus voltage; Kt = 8.27/Kv per peak ampere
    V/Hz               2*pi*psi, per electrical hertz

A motor in delta is one in star to its terminals: all of this is measured there.  Only numbers of a single winding
of a delta differ: a third of R and L, psi over sqrt(3).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

RPM = 2.0 * math.pi / 60.0
ROOT2, ROOT3 = math.sqrt(2.0), math.sqrt(3.0)


class Meaning(NamedTuple):
    """A convention: its name, what it says, and psi [Wb] from the number and the pole pairs."""

    name: str
    says: str
    psi: Callable[[float, int], float]


def _emf(per_rad: float) -> tuple[Meaning, ...]:
    """Of a voltage constant whose unit is ``per_rad`` V s/rad of the shaft."""
    of = (
        ("line-rms", "rms between lines", ROOT2 / ROOT3),
        ("line-peak", "peak between lines", 1.0 / ROOT3),
        ("phase-rms", "rms of a phase", ROOT2),
        ("phase-peak", "peak of a phase", 1.0),
    )
    return tuple(Meaning(name, says, lambda k, p, f=factor: k * per_rad * f / p) for name, says, factor in of)


# kind of number -> (unit, usual meanings, the most usual first)
NUMBERS: dict[str, tuple[str, tuple[Meaning, ...]]] = {
    "ke": ("V/krpm", _emf(1.0 / (1000.0 * RPM))),
    "ke_rad": ("V s/rad", _emf(1.0)),
    "kt": (
        "Nm/A",
        (
            Meaning("rms", "per rms ampere of a phase", lambda k, p: k / (1.5 * ROOT2 * p)),
            Meaning("peak", "per peak ampere of a phase", lambda k, p: k / (1.5 * p)),
        ),
    ),
    "kv": (
        "rpm/V",
        (
            Meaning("line-peak", "bus voltage is the peak between lines", lambda k, p: 1.0 / (k * RPM * ROOT3 * p)),
            Meaning("line-rms", "volts rms between lines", lambda k, p: ROOT2 / (k * RPM * ROOT3 * p)),
        ),
    ),
    "v_per_hz": (
        "V/Hz",
        (
            Meaning("phase-peak", "peak of a phase per electrical hertz", lambda k, p: k / (2.0 * math.pi)),
            Meaning("phase-rms", "rms of a phase per electrical hertz", lambda k, p: ROOT2 * k / (2.0 * math.pi)),
            Meaning(
                "line-rms", "rms between lines per electrical hertz", lambda k, p: ROOT2 / ROOT3 * k / (2.0 * math.pi)
            ),
        ),
    ),
}
