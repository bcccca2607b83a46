"""What the LAAS logs do not tell, in words, each with the bound that they do give."""

from __future__ import annotations

SIGMAS = 2.0  # of an upper bound


def bound(line, name) -> float:
    """The largest size that a parameter may have."""
    return abs(line[name]) + SIGMAS * line.sigma(name)


def cannot_tell(hold, side, line, free, wide, still, moving) -> list[str]:
    """Sentences; arguments are the lines that laas.run fitted and the tables of two logs."""
    offset, loss = 1e3 * bound(hold, "u_0"), 1e3 * bound(hold, "v_loss")
    return [
        "Nothing of the d axis: no i_d, no u_d, so nothing of L_d, cross-saturation or an angle's offset.",
        "L_q: a sine of 2 Hz moves u_q by less than a digit; no more than "
        f"{1e3 * bound(wide, 'inductance'):.2g} mH is all that can be said.",
        f"Inverter loss: none seen; {1e3 * hold['v_loss']:.2g} mV at standstill, at most {loss:.2g} mV (in motion at "
        f"most {1e3 * bound(line, 'v_loss'):.2g} mV): compensated, or u_q is the request before compensation.",
        f"Offset of i_q: u_q at i_q = 0 is {1e3 * hold['u_0']:.2g} mV, at most {offset:.2g} mV, so it is at most "
        f"{offset / hold['resistance']:.2g} mA; one that both channels share cannot be seen.",
        f"Resistance in motion: {free['resistance']:.2g} +- {free.sigma('resistance'):.1g} ohm, "
        f"as the speed's delay looks just like it (collinearity {free.collinearity:.0f}); standstill gives it.",
        f"An EMF that depends on the direction: at most {1e6 * bound(wide, 'even_emf'):.2g} uVs/rad.",
        f"Vsupply is scaled ({still['Vsupply'].min():.3g} to {moving['Vsupply'].max():.3g}) and moves nothing else: "
        "its scale and the inverter's voltages cannot be had.",
        "Harmonics of the EMF, ripple, delay and sampling instants: 1 kHz sees none of a control at 40 kHz.",
        "Inertia and friction in Nm hang on the torque constant, which is that of the EMF; no torque was measured.",
        "A current scale would scale resistance, friction and cogging alike; friction held still, "
        f"{side['direction']:.2g} A, is half the gap between both directions.",
    ]
