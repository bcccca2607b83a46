# SPDX-License-Identifier: BSD-3-Clause
"""What the real drive does differently from its drive file: sizes that a bench would notice, in physical terms.

A fault changes the real drive before its maker measures it (`MADE`) or afterwards (`LATER`: what wears, warms or is set
wrongly); `SHEET` are wrong constants of the drive file.  Each returns what of it may be called a true value.
"""

from __future__ import annotations

import numpy as np

from studies.blind.circuit.drives import wrong


def _sign(rng):
    return float(rng.choice((-1.0, 1.0)))


def _balanced(rng, size):
    """Three values with sum zero whose largest is ``size``."""
    x = np.cos(rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(3))
    return size * x / np.abs(x).max()


# -- made so: the maker's values without load already contain it


def _saturation(a, rng, s):
    """Rotor iron that each axis magnetises by itself comes to its knee."""
    m = a.machine
    l_q, psi = 1 / m.gap_q, m.psi
    tesla = 1.5 + 0.08 * s
    a.set("machine", bridge_q_t=tesla / (l_q * m.rated * 0.85))
    if m.gap_d / m.gap_q < 1.3:  # with little saliency the d axis has the same path
        a.set("machine", bridge_d_t=1.45 / (psi + 0.3 * m.rated / m.gap_d))


def _shared(a, rng, s):
    """Teeth that both axes magnetise come to their knee."""
    most = np.hypot(a.machine.psi, a.machine.rated / a.machine.gap_q)
    a.set("machine", tooth_t=(1.45 + 0.08 * s) / most, yoke_t=1.3 / most)


def _phase(a, rng, s):
    """One lead is longer, or thicker; the drive file has the mean of the phases."""
    x = _sign(rng) * 0.2 * s
    k = str(rng.choice(list("abc")))
    a.set("machine", **{f"r_{k}": max(-0.4, x)})


# -- later


def _emf(a, rng, s):
    a.set("machine", emf_6=0.02 * s, emf_12=0.007 * s * rng.uniform(0.0, 1.0), emf_q=_sign(rng) * rng.uniform(0.3, 1.0))


def _iron_loss(a, rng, s):
    """Of the loss at 0.42 of the bus a quarter to a third is hysteresis."""
    m, v = a.machine, 0.42 * a.inverter.bus
    omega_top = v / np.hypot(m.psi, m.rated / m.gap_q)
    total = 0.04 * s * m.rated
    share = rng.uniform(0.2, 0.35)
    a.set("machine", g_eddy=(1 - share) * total / v, g_hysteresis=share * total * omega_top / v)


def _dead(a, rng, s):
    v = a.inverter
    dead = 0.011 * s * v.period
    a.set(
        "inverter",
        dead=dead,
        t_on=0.15 * dead,
        t_off=0.1 * dead,
        c_leg=rng.uniform(0.03, 0.12) * dead * v.rated / v.bus,
    )
    a.set("inverter", v_switch=rng.uniform(5e-4, 2e-3) * v.bus, v_diode=rng.uniform(5e-4, 2e-3) * v.bus)


def _winding(a, rng, s):
    """Overload: the winding rises by tens of kelvins within the recording."""
    heavy = 1.5 * a.machine.r * a.machine.rated**2
    a.set("heat", c_winding=0.03 * heavy / s, k_winding=heavy / 250.0)


def _magnets(a, rng, s):
    """The rotor warms by tens of kelvins, through a hot shaft."""
    heavy = 1.5 * a.machine.r * a.machine.rated**2
    a.set("heat", c_magnet=0.01 * heavy, k_magnet=heavy / 1000.0, magnet_w=0.09 * s * heavy)


def _gain(a, rng, s):
    a.set("sensors", **dict(zip(("gain_a", "gain_b", "gain_c"), 1.0 + _balanced(rng, 0.035 * s), strict=True)))


def _offset(a, rng, s):
    names = ("offset_a", "offset_b", "offset_c")
    a.set("sensors", **dict(zip(names, _balanced(rng, 0.02 * s * a.machine.rated), strict=True)))


MADE = {"saturation": _saturation, "iron_teeth": _shared, "phase_resistance_asymmetry": _phase}
# the names of a fault, where they are not its own: teeth at their knee saturate each axis and couple both
NAMES = {"iron_teeth": ("saturation", "cross_saturation"), "angle_late": ("sampling_skew",)}
LATER = {
    "dead_time": _dead,
    "iron_loss": _iron_loss,
    "emf_harmonics": _emf,
    "resistance_temperature": _winding,
    "magnet_temperature": _magnets,
    "current_gain": _gain,
    "current_offset": _offset,
    "udc_gain": lambda a, rng, s: a.set("sensors", bus_gain=1.0 + _sign(rng) * 0.045 * s),
    "encoder_offset": lambda a, rng, s: a.set("sensors", angle=_sign(rng) * 0.07 * s),
    "angle_late": lambda a, rng, s: a.set("sensors", angle_late=0.25 * s * a.inverter.period),
}


def _sheet(name, key, share):
    def apply(drive, rng, s):
        factor = (1.0 + share * s) ** _sign(rng)
        true = getattr(drive, name)
        return wrong(drive, **{name: true / factor}), {key: true}

    return apply


SHEET = {
    "resistance": _sheet("r", "resistance_ohm", 0.28),
    "magnet_flux": _sheet("psi", "magnet_flux_wb", 0.06),
    "inductance_d": _sheet("l_d", "inductance_d_h", 0.2),
    "inductance_q": _sheet("l_q", "inductance_q_h", 0.2),
}
FAULTS = (*MADE, *LATER, *SHEET)


# -- what a list of causes hardly has


def _short(a, rng, s):
    """Some turns of phase a touch through a resistance of the size of the winding's share."""
    m = a.machine
    share = 0.06 * s
    a.set("machine", short_share=share, short_r=share * m.r * rng.uniform(3.0, 6.0), short_l=share**2 / m.gap_q)
    a.set("machine", short_l=max(a.machine.short_l, 0.6 * a.inverter.period * a.machine.short_r))


def _loose(a, rng, s):
    a.set("machine", loose_r=0.7 * s * a.machine.r, loose_hz=rng.uniform(23.0, 61.0))


def _slow_driver(a, rng, s):
    """The driver of one leg switches on later; a wide dead time of all legs is not there."""
    a.set("inverter", **{f"late_{rng.choice(list('abc'))}": 0.012 * s * a.inverter.period})


def _old_bus(a, rng, s):
    """A bus message of every fifth millisecond, on a supply whose bus moves."""
    v = a.inverter
    every = int(0.005 / v.period)
    a.set("sensors", bus_every=every, bus_late=every // 2)
    a.set("inverter", rectifier=True, bus=v.bus / 0.98, r_bus=0.06 * s * v.bus / v.rated, c_bus=0.4 * v.c_bus)


UNKNOWN = {"shorted_turns": _short, "loose_connector": _loose, "slow_driver": _slow_driver, "old_bus_message": _old_bus}
