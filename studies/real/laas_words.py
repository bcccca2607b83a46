# SPDX-License-Identifier: BSD-3-Clause
"""What the LAAS logs cannot determine, as sentences, each with the bound that they give."""

from __future__ import annotations

SIGMAS = 2.0  # of an upper bound


def bound(line, name) -> float:
    """The largest size that a parameter may have."""
    return abs(line[name]) + SIGMAS * line.sigma(name)


def cannot_tell(hold, side, line, free, wide, still, moving) -> list[str]:
    """Sentences; arguments are the lines that laas.run fitted and the tables of two logs."""
    offset, loss = 1e3 * bound(hold, "u_0"), 1e3 * bound(hold, "v_loss")
    return [
        "The d axis is unknown: without i_d and u_d, so are L_d, cross-saturation and encoder offset.",
        "L_q: a sine of 2 Hz changes u_q by less than one digit; L_q is at most "
        f"{1e3 * bound(wide, 'inductance'):.2g} mH.",
        f"Inverter loss: insignificant; {1e3 * hold['v_loss']:.2g} mV at standstill, at most {loss:.2g} mV (in motion "
        f"at most {1e3 * bound(line, 'v_loss'):.2g} mV): compensated, or u_q is the command before compensation.",
        f"Offset of i_q: u_q at i_q = 0 is {1e3 * hold['u_0']:.2g} mV, at most {offset:.2g} mV, so it is at most "
        f"{offset / hold['resistance']:.2g} mA; an offset common to both channels is not visible.",
        f"Resistance in motion: {free['resistance']:.2g} +- {free.sigma('resistance'):.1g} ohm, "
        f"collinear with the delay of the speed ({free.collinearity:.0f}); the value at standstill is used.",
        f"An EMF that depends on the direction: at most {1e6 * bound(wide, 'even_emf'):.2g} uVs/rad.",
        f"Vsupply is scaled ({still['Vsupply'].min():.3g} to {moving['Vsupply'].max():.3g}) and affects no other "
        "signal: its scale and the inverter voltages are unknown.",
        "EMF harmonics, ripple, delay and sampling instants of a control at 40 kHz are not visible at 1 kHz.",
        "Inertia and friction in Nm depend on the torque constant, computed from the EMF; no torque was measured.",
        "A current scale would change resistance, friction and cogging by the same factor; static friction, "
        f"{side['direction']:.2g} A, is half the difference between both directions.",
    ]
