# SPDX-License-Identifier: BSD-3-Clause
"""Names of effects for selected terms: the interpretation of a sparse model of the misfit by an engineer.

    u_d: d, u_q: q                  resistance          (times T: resistance_temperature)
    u_q: w                          magnet_flux         (times t: magnet_temperature)
    u_q: w d / u_d: w q             inductance_d / inductance_q
    u_q: w d2, w d3 / u_d: w q3     saturation; of it and the inductance of its axis a much smaller one is dropped
    u_q: w q2.. / u_d: w d q..      cross_saturation
    u_d: w                          encoder_offset
    u_d: w2, with u_q: w2 q         iron_loss, which takes friction with it; without the load term sampling_skew
    direction of the currents, 6    dead_time
    w cos6, w sin6, 12              emf_harmonics
    du                              delay
    w cos e, w sin e                encoder_eccentricity
    cos1, sin1; sum: 1              current_offset
    cos2, sin2 times d, q           phase_resistance_asymmetry; times w: current_gain; sum: alpha, beta
    torque: w, sgn_w / cos n, sin n friction / cogging

R, L_d and L_q off by about one factor are current_scale; with psi_m too, udc_gain.  Terms that nobody could
name (such as q in u_d) count for the fit, not for a name.
"""

from __future__ import annotations

import numpy as np

from studies.compare.data import Data
from studies.compare.dictionary import TORQUE_ORDERS, Equation

BESIDE = 0.4  # least ratio at which inductance and saturation of an axis count as two effects
ALIKE = 2.0  # largest ratio of relative changes that still count as one factor


def _table():
    out = {
        ("u_d", "d"): "resistance",
        ("u_q", "q"): "resistance",
        ("u_q", "w"): "magnet_flux",
        ("u_q", "t w"): "magnet_temperature",
        ("u_q", "w d"): "inductance_d",
        ("u_d", "w q"): "inductance_q",
        ("u_d", "w"): "encoder_offset",
        ("u_d", "w2"): "sampling_skew",
        ("sum", "1"): "current_offset",
        ("sum", "alpha"): "current_gain",
        ("sum", "beta"): "current_gain",
        ("torque", "w"): "friction",
        ("torque", "sgn_w"): "friction",
        ("torque", "w abs"): "friction",
        **{("u_q", f"w {x}"): "saturation" for x in ("d2", "d3")},
        **{("u_d", f"w {x}"): "saturation" for x in ("q3",)},
        **{("u_q", f"w {x}"): "cross_saturation" for x in ("q2", "dq2")},
        **{("u_d", f"w {x}"): "cross_saturation" for x in ("dq", "d2q")},
        **{("torque", f"{wave}{h}"): "cogging" for wave in ("cos", "sin") for h in TORQUE_ORDERS},
    }
    for target in ("u_d", "u_q"):
        out |= {(target, x): "dead_time" for x in ("sgn_d", "sgn_q", "cos6", "sin6", "cos12", "sin12")}
        out |= {(target, x): "delay" for x in ("du_d", "du_q")}
        out[target, "T d" if target == "u_d" else "T q"] = "resistance_temperature"
        for wave in ("cos", "sin"):
            out |= {(target, f"w {wave}{h}"): "emf_harmonics" for h in (6, 12)}
            out |= {(target, f"w {wave}{h}"): "encoder_eccentricity" for h in ("e", "2e")}
            out |= {(target, f"{x}{wave}1"): "current_offset" for x in ("", "w ")}
            out |= {(target, f"{x} {wave}2"): "phase_resistance_asymmetry" for x in "dq"}
            out |= {(target, f"w {x} {wave}2"): "current_gain" for x in "dq"}
    return out


NAMES = _table()


def effects(data: Data, models: list[tuple[Equation, np.ndarray]]) -> dict[str, float]:
    """Names with their sizes: rms of the sum of their terms, in per mille of bus, rated current or torque.

    models: equations with their coefficients (k,) of the scaled columns.
    """
    parts: dict[tuple[str, str], float] = {}
    plain: dict[tuple[str, str], float] = {}  # coefficient of the unscaled column
    for e, c in models:
        plain |= {(e.name, e.terms[k]): c[k] / e.scale[k] for k in np.flatnonzero(c)}
        owners = [NAMES.get((e.name, e.terms[k])) if c[k] else None for k in range(len(c))]
        for owner in {x for x in owners if x}:
            mine = [k for k, x in enumerate(owners) if x == owner]
            parts[e.name, owner] = float(np.sqrt(np.mean((e.x[:, mine] @ c[mine]) ** 2)))
    for equation, linear in (("u_d", "inductance_q"), ("u_q", "inductance_d")):
        pair = [(equation, linear), (equation, "saturation")]
        if all(key in parts for key in pair):
            small, large = sorted(pair, key=parts.get)
            if parts[small] < BESIDE * parts[large]:
                parts[large] += parts.pop(small)
    out: dict[str, float] = {}
    for (_, name), size in parts.items():
        out[name] = float(np.hypot(out.get(name, 0.0), size))
    if "sampling_skew" in out and ("u_q", "w2 q") in plain:
        out["iron_loss"] = out.pop("sampling_skew")
    if "iron_loss" in out and "friction" in out:
        del out["friction"]  # an iron loss also causes a drag torque
    return _one_factor(data, plain, out)


def _one_factor(data, plain, names):
    """R, L_d, L_q (and psi_m) wrong by one factor count as one scale instead of several parameters."""
    m, unit = data.view.machine, data.units["u"]
    top = float(np.abs(data.view.omega).max())
    nominal = {
        "resistance": (("u_q", "q"), m.resistance_ohm * m.rated_current_a),
        "inductance_d": (("u_q", "w d"), top * m.inductance_d_h * m.rated_current_a),
        "inductance_q": (("u_d", "w q"), -top * m.inductance_q_h * m.rated_current_a),
        "magnet_flux": (("u_q", "w"), top * m.magnet_flux_wb),
    }
    change = {n: plain[key] * unit / volts for n, (key, volts) in nominal.items() if n in names and key in plain}
    left = one_factor(list(names), change)
    merged = float(np.sqrt(sum(size**2 for name, size in names.items() if name not in left)))
    return {name: names.get(name, merged) for name in left}


def one_factor(names: list[str], change: dict[str, float]) -> list[str]:
    """Names with R, L_d, L_q and psi_m, if changed by about the same share, replaced by one scale or gain."""
    for name, needs in (
        ("udc_gain", ("inductance_d", "inductance_q", "magnet_flux")),
        ("current_scale", ("resistance", "inductance_d", "inductance_q")),
    ):
        shares = [change.get(n, 0.0) if n in names else 0.0 for n in needs]
        if min(shares) * max(shares) > 0.0 and max(map(abs, shares)) < ALIKE * min(map(abs, shares)):
            gone = {*needs, "resistance"}
            return [n for n in names if n not in gone] + [name]
    return names


MECHANICAL = ("friction", "cogging")
NAME_GRID = [
    {"least": x, "share": s, "mechanical": m}
    for x in (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.5, 3.0)
    for s in (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5)
    for m in (1.0, 3.0, 10.0, 30.0)
]


def dominant(sizes: dict[str, float], least: float, share: float, mechanical: float) -> list[str]:
    """Names of at least ``share`` of the largest of their kind and ``least`` (torque: ``mechanical``) per mille."""
    kinds = (
        ([n for n in sizes if n not in MECHANICAL], least),
        ([n for n in sizes if n in MECHANICAL], mechanical),
    )
    out = []
    for mine, floor in kinds:
        top = max((sizes[n] for n in mine), default=0.0)
        out += [n for n in mine if sizes[n] >= max(floor, share * top)]
    return sorted(out)
