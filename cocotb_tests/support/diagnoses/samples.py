# SPDX-License-Identifier: BSD-3-Clause
"""Synthetic diagnoses, one per verdict, with the misfit of a dead time; and a function that writes their outputs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cocotb_tests.support.drives import PLAIN
from fluxproof.diagnosis.ground import result
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import Problem
from fluxproof.diagnosis.ground.result import (
    Diagnosis,
    Estimate,
    Evidence,
    Fit,
    Location,
    NamedEffect,
    OrderLine,
    Region,
    Request,
)
from fluxproof.diagnosis.report import write_outputs
from fluxproof.plant import FluxMap

HOSTILE = "i_a</code><script>document.title='taken'</script><img src=x onerror=alert(1)>$\\frac{$\u202e\x00"


def evidence(effect: float = 0.9, noise: float = 0.08, after: bool = True) -> Evidence:
    """Block means at a grid of speeds and currents; the misfit is ``effect`` volts along the phase currents' signs."""
    rng = np.random.default_rng(5)
    omega, i_q = (a.ravel() for a in np.meshgrid(np.linspace(-300, 600, 25), np.linspace(-5, 5, 20)))
    omega, i_q = np.repeat(omega, 8), np.repeat(i_q, 8)
    theta = rng.uniform(0, 2 * np.pi, len(omega))
    i_d = -0.15 * np.abs(i_q)
    before = effect * six_step(theta, i_d + 1j * i_q) + noise * noise_of(rng, len(omega))
    left = noise * noise_of(rng, len(omega))
    orders = np.array([0, 0.25, 0.5, 1, 2, 3, 4, 6, 12])
    arrays = dict(t=np.arange(len(omega)) * 0.01, theta_e=theta, omega_e=omega, i_d=i_d, i_q=i_q)
    arrays |= dict(before_d=before.real, before_q=before.imag, holdout=(np.arange(len(omega)) // 320) % 4 == 3)
    arrays |= dict(noise=np.array(noise))
    arrays |= dict(orders=orders, spectrum_before=effect * np.array([1.27, *6 * [0.0], 0.25, 0.09]) + 0.003)
    if after:
        arrays |= dict(after_d=left.real, after_q=left.imag, spectrum_after=0.003 + 0.002 * rng.random(9))
    return Evidence(arrays)


def noise_of(rng, n: int) -> np.ndarray:
    return rng.normal(size=n) + 1j * rng.normal(size=n)


def six_step(theta, i_dq) -> np.ndarray:
    """The signs of the phase currents as a vector in dq: (2/3) sum_k sign(i_k) a^k e^(-j theta)."""
    a = np.exp(2j * np.pi * np.arange(3) / 3)[:, None]
    phase = np.real(i_dq * np.exp(1j * theta) * np.conj(a))
    return 2 / 3 * np.sum(np.sign(phase) * a, axis=0) * np.exp(-1j * theta)


def overlay(n: int = 5000) -> dict:
    t = np.arange(n) * 1e-4
    step = 4.0 * (1 - np.exp(-t / 0.01))
    wave = 0.25 * np.sin(6 * 300 * t)
    recorded = dict(i_q=step + wave, i_d=0.6 * wave)
    simulated = dict(i_q=step, i_d=0 * t)
    return dict(t=t, recorded=recorded, simulated_before=simulated, simulated_after=recorded)


FIT = Fit("u_dq", "V", 1.18, 0.118, 1.21, 0.121, 0.113)
WHERE = Location(
    "u_q",
    (OrderLine(0, 1.14, "V"), OrderLine(6, 0.225, "V"), OrderLine(12, 0.08, "V")),
    (Region("i_q", 0.2, 5.0, "A", 1.32, 0.41), Region("omega_e", -math.inf, 120.0, "rad/s", 1.2, 0.9)),
)
DEAD_TIME = NamedEffect(
    "dead_time", 0.998, {"v_dead_v": Estimate(0.9013, 0.0107, "V")}, 0.93, {"inverter.dead_time_s": 1.6e-6}
)
OFFSET = NamedEffect(
    "encoder_offset",
    0.97,
    {"offset_rad": Estimate(0.0351, 0.0004, "rad")},
    0.05,
    {"sensors.position_offset_rad": 0.0351},
)
AXES = np.linspace(-6, 0, 4), np.linspace(-6, 6, 7)
FLUX_MAP = FluxMap(*AXES, *np.meshgrid(0.165 + 0.016 * AXES[0], 0.015 * AXES[1], indexing="ij"))
SATURATION = NamedEffect(
    "saturation",
    0.991,
    {"inductance_q_slope": Estimate(-4.1e-4, 0.2e-4, "H"), "knee_a": Estimate(3.4, math.nan, "A")},
    0.44,
    {"machine.inductance_q_h": 0.0151, "machine.flux_map": FLUX_MAP},
)
ASKED = (
    Request(314.0, -2.0, 0.0, ("encoder_offset", "inductance_q"), "an offset stays on d at i_q = 0, L_q does not"),
    Request(-314.0, -2.0, 0.0, ("encoder_offset",), "the offset's voltage turns with the speed", 563.0, 80.0),
)
UNKNOWN = result.UnknownTerm("u_d", "c * omega_e * abs(i_q) * cos(2*theta_e)", 2.31e-3, 4e-5, "V s/(rad A)", 0.88)
PROBLEMS = (
    Problem("gap", "three samples are missing after 1.2044 s", "t", 12044, 3, "the balance is not taken across it"),
    Problem(
        "clipped",
        "the current stays at its largest value, 8.19 A",
        HOSTILE,
        20113,
        41,
        "those rows are left out",
    ),
)
FATAL = (
    Problem("current_sum", "the phase currents sum to 3.9 A rms, 0.1 A was expected", "i_c", 0, 200000, fatal=True),
    *PROBLEMS,
)
DIFFERENCE = dict(block="current_pi", sample=4711, signal="u_q", bit=7, recorded="0x01A4", golden="0x0124")


def made_up() -> dict[str, Diagnosis]:
    """One diagnosis for each verdict."""
    healthy = replace(FIT, train_before=0.114, train_after=0.114, holdout_before=0.115, holdout_after=0.115)
    unexplained = replace(FIT, train_after=0.41, holdout_after=0.44)
    common = dict(rows=200000, notes=("Friction was not looked at: the recording holds no torque.",))
    found = dict(location=WHERE, fit=FIT, evidence=evidence(), **common)
    return {
        "explained": Diagnosis(
            "explained",
            "Dead time of 0.90 V, q-axis saturation and an encoder offset of 2.0° explain the recording.",
            (DEAD_TIME, SATURATION, OFFSET),
            problems=PROBLEMS,
            digital=result.Digital(True, 200000),
            **found,
        ),
        "ambiguous": Diagnosis(
            "ambiguous",
            "Either the encoder is 2.0° off or L_q is 3 % too high: at one load this recording cannot tell.",
            (DEAD_TIME,),
            (("encoder_offset", "inductance_q"),),
            ASKED,
            **found,
        ),
        "partly_explained": Diagnosis(
            "partly_explained",
            "Dead time of 0.90 V explains 88 % of the misfit's power; the rest is mostly in u_dq at order 2 (0.41 V).",
            (DEAD_TIME,),
            **found | dict(fit=unexplained),
            explained_share=0.88,
            remainder=(result.Remainder("u_dq", 2.0, 0.41, "V", 0.12),),
            unknown_term=UNKNOWN,
        ),
        "unexplained": Diagnosis(
            "unexplained",
            "A second-order ripple on u_d that grows with speed and load is none of the known effects.",
            **found | dict(fit=unexplained),
            unknown_term=UNKNOWN,
        ),
        "no_mismatch": Diagnosis(
            "no_mismatch",
            "Recording and simulation agree to 0.12 V, the noise floor.",
            fit=healthy,
            evidence=evidence(0.0, after=False),
            **common,
        ),
        "digital_mismatch": Diagnosis(
            "digital_mismatch",
            "The core's current controller differs from its golden model from sample 4711 on, first in bit 7 of u_q.",
            digital=result.Digital(True, 200000, DIFFERENCE),
            **common,
        ),
        "bad_recording": Diagnosis(
            "bad_recording", "The phase currents do not sum to zero: phase c is not what it claims to be.",
            problems=FATAL, **common,
        ),
    }  # fmt: skip


def write_all(folder) -> dict:
    """Write every diagnosis under ``folder``: {verdict: its own folder}."""
    drive = folder / "drive.toml"
    drive.write_text(PLAIN)
    for verdict, diagnosis in made_up().items():
        laid_over = overlay() if verdict == "explained" else None
        write_outputs(diagnosis, folder / verdict, load_nominal(drive), laid_over)
    return {verdict: folder / verdict for verdict in result.VERDICTS}


def html_of(folder) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")
