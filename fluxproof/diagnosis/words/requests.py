# SPDX-License-Identifier: BSD-3-Clause
"""Planned operating points as requests: why each one separates what is ambiguous."""

from __future__ import annotations

from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.ground.result import Request
from fluxproof.diagnosis.plan.planned import NO_CURRENT, OTHER_AXIS, OTHER_SPEED, Difference, Planned
from fluxproof.diagnosis.words.phrases import SIGNALS, joined, title_of

BESIDE_ONE_POINT = {
    NO_CURRENT: "without current, only errors of magnet flux, iron loss and angle remain",
    OTHER_SPEED: "at another speed, errors of the flux change the voltage and errors of R do not",
    OTHER_AXIS: "with another i_d, winding and magnets act on different axes",
}
COLD = ", once the machine has cooled down (record temp_winding)"


def requested(planned: tuple[Planned, ...], effects) -> tuple[Request, ...]:
    """The requests for planned points; effects: the catalogue with the causes beyond it."""
    return tuple(_request(point, effects) for point in planned)


def _request(point: Planned, effects) -> Request:
    why = BESIDE_ONE_POINT[point.why] if isinstance(point.why, str) else _differs(point.why, effects)
    cold = COLD if point.temp_winding is not None else ""
    i = point.i_dq
    return Request(point.omega_e, i.real, i.imag, point.separates, why + cold, point.u_dc, point.temp_winding)


def _differs(d: Difference, effects) -> str:
    """What differs between what is ambiguous: the effects that only one of the two sets contains."""
    titles = (sorted(title_of(n, effects) for n in names) for names in d.only)
    a, b = (f"'{joined(each)}'" if each else "nothing in its place" for each in titles)
    order = f"order {d.order:.4g} of the " if d.order else ""
    size = f" by {ascii_of(quantity(d.size, 'V', 2))}" if d.size is not None else ""
    return f"the {order}{SIGNALS['u_' + 'dq'[d.axis]]} differs{size} between {a} and {b}"
