# SPDX-License-Identifier: BSD-3-Clause
"""Dead-time voltage, compensation, magnets' flux, winding resistance: findings, word lengths, fallbacks."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fluxproof.checkout import ROOT
from fluxproof.plant import Inverter
from golden_model import drive as drives
from golden_model.drive_keys import DriveError
from golden_model.estimators import psi_adaline, v_dead_adaline, winding_resistance
from golden_model.registers import registers
from studies.papers.flux_bench import scaled
from studies.papers.vsi_bench import DRIVE, FAST, I_Q, NOMINAL, held_at, last, leg_loss, run, without

# A sample in which nothing holds the Adalines
CALM = v_dead_adaline.Inputs(
    u_pi_d=0, d_d=0, i_d=0, i_q=0, sat_d=0, sat_q=0, current_at_rail=0, voltage_known=1, run=1
)  # fmt: skip


def real_v_dead(rows: np.ndarray, gains: dict[str, float]) -> tuple[float, float]:
    """The Adaline of V_dead in real numbers over recorded u_pi_d, d_d: (v_dead, v_comp) at the end."""
    lp_u = lp_d = v_dead = v_sum = 0.0
    for u_pi_d, d_d in rows:
        u_h, d_h = u_pi_d - lp_u, d_d - lp_d
        lp_u, lp_d = lp_u + gains["k_lp"] * u_h, lp_d + gains["k_lp"] * d_h
        v_dead += gains["eta_v"] * d_h * (u_h - v_dead * d_h)
        if abs(v_dead) > gains["v_thr"]:
            v_sum = min(max(v_sum + gains["zeta"] * v_dead, 0.0), gains["v_comp_max"])
    return v_dead, min(max(v_sum + gains["gamma"] * v_dead, 0.0), gains["v_comp_max"])


def test_one_lsb_of_v_dead():
    """The paper's own step of 1e-5 on a recorded saw-tooth: bit-exact and real-number Adaline end within one LSB."""
    view = run(held_at(300, 0.0, I_Q, 12.0), scaled(NOMINAL, compensate=0))
    seen, values = view.result.observed, NOMINAL.values._replace(zeta=0, i_learn=0)
    u_pi_d = seen["u_d"] - seen["u_dec_d"]
    block = v_dead_adaline.BLOCK
    gains = {p.name: p.fmt.to_float(getattr(values, p.name)) for p in block.registers}
    state, out = v_dead_adaline.State(), None
    for u, d in zip(u_pi_d, seen["d_d"], strict=True):
        state, out = v_dead_adaline.step(state, CALM._replace(u_pi_d=int(u), d_d=int(d)), values)
    rows = np.stack([u_pi_d, seen["d_d"]], axis=1) * 2.0**-16
    v_dead, v_comp = real_v_dead(rows, gains)
    lsb = 2.0**-18
    assert v_dead > 50 * lsb, "nothing was learnt"
    # The low-pass hands on values rounded to PU, whose mean is right and whose LSB is four of these.
    assert abs(out[0] * lsb - v_dead) <= lsb and abs(out[1] * lsb - v_comp) <= lsb


@pytest.mark.parametrize("eta", [2.0**-19, 1e-5, 1e-3])
def test_v_dead_never_stalls(eta):
    """A constant error of a quarter of an LSB of PU still moves the estimate, at the smallest step of the register."""
    eta_v = max(1, round(18 * eta * 2**19)) if eta > 2.0**-19 else 1
    regs = {"k_lp": 0, "eta_v": eta_v, "gamma": 0, "zeta": 0, "v_thr": 0, "v_comp_max": 131071, "v_start": 0}
    regs |= {"i_learn": 0, "compensate": 0}
    state = v_dead_adaline.State()
    for _ in range(2000):
        state, _out = v_dead_adaline.step(state, CALM._replace(u_pi_d=1, d_d=43690), v_dead_adaline.Registers(**regs))
    assert state.v_dead > 0


def test_one_lsb_of_psi():
    """Adaline of psi_m, bit-exact against real numbers on a recorded run: within one LSB at the end."""
    view = run(held_at(300, 0.0, I_Q, 3.0), scaled(NOMINAL, FAST))
    seen, values = view.result.observed, NOMINAL.values
    v_leg = np.concatenate([[0], (seen["v_dead"] + seen["v_comp"])[:-1]])
    r, _rho, _minus_rho, _lost = winding_resistance.step(
        0, 0, values.r_s, values.tcr, values.t_0, values.t_min, values.t_max, values.t_s
    )
    state, real, psi = psi_adaline.State(), 0.0, 0
    eta = values.eta_psi * 2.0**-19
    for k in range(len(v_leg)):
        u_q, d_q, i_d, i_q, omega = (int(seen[n][k]) for n in ("u_q", "d_q", "i_d", "i_q", "omega_chord"))
        inputs = psi_adaline.Inputs(
            u_q=u_q, d_q=d_q, v_leg=int(v_leg[k]), i_d=i_d, i_q=i_q, r=r, omega_chord=omega, sat_d=0, sat_q=0,
            current_at_rail=0, voltage_known=1, run=1,
        )  # fmt: skip
        state, (psi, held) = psi_adaline.step(state, inputs, values)
        if not held:
            w = omega * 2.0**-16
            known = v_leg[k] * 2.0**-18 * d_q * 2.0**-16 + r * 2.0**-24 * i_q * 2.0**-16
            own = values.l_d * 2.0**-20 * i_d * 2.0**-16
            real += eta * w * (u_q * 2.0**-16 - known - w * (own + real))
    assert abs(psi * 2.0**-16 - real) <= 2.0**-16
    assert real * DRIVE.bases.flux_wb == pytest.approx(0.068, rel=0.02)


def test_invalid_winding_temperature():
    """R falls back to R_0 with a flag; a valid reading takes effect; the result is never negative."""
    v = NOMINAL.values
    regs = (v.r_s, v.tcr, v.t_0, v.t_min, v.t_max, v.t_s)
    for celsius, valid, lost in ((90, 1, 0), (90, 0, 1), (250, 1, 1), (-60, 1, 1), (200, 1, 0), (-40, 1, 0)):
        r, rho, minus_rho, flag = winding_resistance.step(celsius * 64, valid, *regs)
        assert flag == lost
        wanted = DRIVE.machine.resistance_ohm * (1 if lost else 1 + 0.0039 * (celsius - 25))
        assert r * 2.0**-24 * DRIVE.bases.voltage_v / DRIVE.bases.current_a == pytest.approx(wanted, rel=1e-4)
        assert rho > 0 and minus_rho == -rho


def test_psi_is_held_and_reported_at_low_speed():
    view = run(held_at(300, 0.0, I_Q, 2.0), scaled(NOMINAL, FAST))
    slow = run(held_at(30, 0.0, I_Q, 0.5), scaled(NOMINAL, FAST), state=view.result.state)
    assert slow.result.observed["psi_held"][200:].all()
    assert np.ptp(slow.psi_m[200:]) == 0 and slow.psi_m[-1] == pytest.approx(view.psi_m[-1], rel=0.05)


def test_v_dead_is_held_at_zero_current():
    """Oscillation around zero current gives no negative loss; the estimate is held and damps the oscillation."""
    learnt = run(held_at(300, 0.0, I_Q, 4.0), scaled(NOMINAL, FAST))
    idle = run(held_at(300, 0.0, 0.0, 1.5), scaled(NOMINAL, FAST), state=learnt.result.state)
    raw = run(held_at(300, 0.0, 0.0, 1.5), without(NOMINAL))
    z = last(0.5)
    assert (idle.v_dead + idle.v_comp)[z].mean() == pytest.approx(leg_loss(), rel=0.05)
    assert idle.i_q[z].std() < 0.3 * raw.i_q[z].std()


def test_ideal_inverter_gets_no_compensation():
    """No dead time, no drops: estimate and compensation stay within the effect of the ripple."""
    view = run(held_at(300, 0.0, I_Q, 4.0), scaled(NOMINAL, FAST), dead_time_s=0.0, inverter=Inverter())
    assert np.abs(view.v_comp[last(1.0)]).max() < 0.03 and np.abs(view.i_d[last(1.0)]).max() < 0.02


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("v_dead_eta", 0.125, r"below 0\.125: eq\. \(B\.3\)"),
        ("psi_eta", 1.2e-5, r"below 1\.14e-05 s2/rad2: eq\. \(B\.3\)"),
        ("winding_temp_min_c", 300.0, "below winding_temp_max_c"),
    ],
)
def test_refusals(key, value, words):
    with pytest.raises(DriveError, match=words):
        dataclasses.replace(DRIVE, control=dataclasses.replace(DRIVE.control, **{key: value}))


def test_every_drive_has_legal_registers():
    for path in sorted((ROOT / "docs" / "drives").glob("*.toml")):
        registers(drives.load(path))
