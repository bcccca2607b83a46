# SPDX-License-Identifier: BSD-3-Clause
"""The scale of the currents, which no step can measure: what the file's own values say of it, and an ammeter.

Where the true current is f times the one that [sensors] current_range_a gives, every equation of the machine holds with

    R -> f*R;  L_d -> f*L_d;  L_q -> f*L_q;  J -> J/f;  psi -> psi

so no voltage, speed or residual shows f.  Only values from elsewhere do: start values from a data sheet are then off by
one factor, the inertia by its inverse, the flux linkage by none.  Else a clamp around a phase has to decide, for which
``hold`` lets a direct current flow.
"""

from __future__ import annotations

import math

from fluxproof.commission import alignment
from fluxproof.commission.session import Session, Step, Value
from golden_model.drive import Drive

ONE_FACTOR = 1.15  # largest ratio of the factors of R, L_d, L_q and 1/J that are still one: tolerances, warm copper
NOTABLE = 1.1  # a factor nearer to one is within the tolerance of a data sheet
SAME_FLUX = 1.1  # psi of the file over the measured one: more is another machine
# Full scale over linear range of isolated modulators, see docs/board.md: 250 mV and 312.5 or 320 mV, 200 and 320 mV
CLIPPING = (1.24, 1.30), (1.55, 1.65)
HOLD_S, RAMP_S = 10.0, 1.0


def compare(given: Drive, found: Drive) -> Step:
    """How the measured values compare with those of the file, and what that says of the currents' scale."""
    before, after = given.machine, found.machine
    ratios = {
        "R": after.resistance_ohm / before.resistance_ohm,
        "L_d": after.inductance_d_h / before.inductance_d_h,
        "L_q": after.inductance_q_h / before.inductance_q_h,
    }
    if before.inertia_kgm2 > 0.0:
        ratios["1/J"] = before.inertia_kgm2 / after.inertia_kgm2
    factor = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
    spread = max(ratios.values()) / min(ratios.values())
    flux = max(after.magnet_flux_wb / before.magnet_flux_wb, before.magnet_flux_wb / after.magnet_flux_wb)
    told = ", ".join(f"{name} {ratio:.2f}" for name, ratio in ratios.items())
    meter = "compare a phase with an ammeter: --hold, docs/commissioning.md"
    notes: dict = {"ratios": list(ratios.values()), "decided": False}
    if spread > ONE_FACTOR or flux > SAME_FLUX:
        said = f"not measured, and the file's values do not tell it ({told} times the file's); {meter}"
        return Step("current scale", {}, said, notes)
    value = {"current_scale": Value(factor, factor * math.log(spread) / 2.0, "1")}
    if 1.0 / NOTABLE < factor < NOTABLE:
        said = (
            f"R and L as in the file ({told} times), so [sensors] current_range_a is right as far as they are; {meter}"
        )
        return Step("current scale", value, said, notes)
    times = f"{max(factor, 1.0 / factor):.2f} times too {'small' if factor > 1.0 else 'large'}"
    usual = ""
    if any(low <= max(factor, 1.0 / factor) <= high for low, high in CLIPPING):
        usual = "; that is the clipping level of a modulator over its linear range"
    said = (
        f"warning: {told} times the file's and psi as there: all currents look {times}, "
        f"as with a wrong [sensors] current_range_a{usual}. Or all of these start values are wrong: {meter}"
    )
    return Step("current scale", value, said, notes | {"warned": True})


def hold(session: Session, amperes: float) -> Step:
    """A direct current for an ammeter: out of phase a, half of it back through b and c each; then the gates are off."""
    s = session
    s.gates_off()
    kp, ki = alignment.gains(s)
    s.load(kp, ki, reverse=0, theta_offset=0)
    s.force(0.0)
    s.gates_on()
    s.ramp(RAMP_S, i_d_ref=(0.0, amperes))
    s.settle(RAMP_S)
    s.progress(f"{amperes:.4g} A in phase a for {HOLD_S:.0f} s: read the ammeter")
    seen = s.look(round(HOLD_S / 0.05), 0.05)
    s.ramp(RAMP_S, i_d_ref=(amperes, 0.0))
    s.gates_off()
    value, span = float(seen.i_d.mean()), s.drive.sensors.current_range_a
    said = (
        f"{value:.4g} A in phase a, {-value / 2.0:.3g} A in b and c, for {HOLD_S:g} s, by [sensors] current_range_a "
        f"= {span:g} A; the right one is that times the ammeter over {value:.4g} A"
    )
    return Step("hold", {"held": Value(value, float(seen.i_d.std()), "A")}, said)
