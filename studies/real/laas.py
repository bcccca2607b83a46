# SPDX-License-Identifier: BSD-3-Clause
"""The LAAS logs of an MN4004: what a q-axis log at 1 kHz reveals about a drive with 40 kHz sampling, and its limits.

Three logs: held still at many angles, a torque sine of 2 Hz, speed control.  The first gives the resistance, cogging
and the friction of a shaft that does not move; with it the second gives the EMF constant, how late the speed is, and
the friction of one that does.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.result import Diagnosis, Estimate, Evidence, Fit, Location, NamedEffect
from fluxproof.diagnosis.loading.load import load_recording
from studies.real import q_axis
from studies.real.laas_words import cannot_tell
from studies.real.outputs import write

FOLDER = Path("laas_mn4004")
FILE = FOLDER / "acc_current.txt"
DRIVE = Path(__file__).with_name("mn4004.toml")
HOLD_ROWS = 25  # that a point of the pictures stands for


def run(folder: Path, out: Path, progress=lambda text: None) -> dict:
    """Fit both lines and write the outputs; returns the entry of result.json."""
    started, nominal = time.perf_counter(), load_nominal(DRIVE)
    progress("q axis at standstill")
    still, moving, control = (
        _table(folder / FOLDER / name) for name in ("stopped_data.txt", "acc_current.txt", "speed_test.txt")
    )
    hold = q_axis.fit(
        still["Uq"],
        {
            "resistance": still["Iq"],
            "u_0": np.ones_like(still["Iq"]),
            "v_loss": np.tanh(still["Iq"] / q_axis.KNEE_A),
        },
        groups=q_axis.mixed_blocks(len(still["Iq"]), 400),
    )
    rising = np.gradient(_slow(still["Position"], 2001)) > 0
    side, cogging = q_axis.orders(still["Position"], still["Iq"], rising)
    progress("q axis in motion")
    log = q_axis.evenly(moving)
    line = q_axis.electrical(log, hold["resistance"])
    free = q_axis.electrical(log)
    wide = q_axis.electrical(log, hold["resistance"], ("inductance", "even_emf"))
    late, torque = q_axis.speed_delay(log), q_axis.mechanical(log)
    before, after = _misfit(log, nominal, hold, line)
    answer = _answer(nominal, log, hold, side, cogging, line, torque, before, after)
    recording = load_recording(folder / FILE, nominal)
    answer = replace(answer, rows=len(recording), problems=tuple(recording.problems))
    p = nominal.machine.pole_pairs
    more = {
        "held_out": {"q": {k: _rms(x[_last(x)]) for k, x in (("before", before), ("after", after))}},
        "there": {
            "resistance_ohm": _pair(hold, "resistance"),
            "emf_constant_vs_per_rad": _pair(line, "k_e"),
            "magnet_flux_wb": [line["k_e"] / p, line.sigma("k_e") / p],
            "speed_is_late_by_s": {
                "from_the_voltage": [line["k_e_tau"] / line["k_e"], line.sigma("k_e_tau") / line["k_e"]],
                "from_the_angle": _pair(late, "tau"),
            },
            "friction_a": {"moving": _pair(torque, "coulomb"), "held_still": _pair(side, "direction")},
            "viscous_a_s_per_rad": _pair(torque, "viscous"),
            "inertia_a_s2_per_rad": _pair(torque, "inertia"),
            "cogging_a_of_order": {str(n): float(cogging[n - 1]) for n in np.argsort(-cogging)[:6] + 1},
            "speed_control": _control(control),
        },
        "current_line": {"held_out_a_rms": torque.holdout, "of": _rms(log.i_q)},
        "cannot_tell": cannot_tell(hold, side, line, free, wide, still, moving),
    }  # fmt: skip
    entry = write("laas_mn4004", answer, nominal, recording, out, more)
    entry["seconds"]["fit"] = time.perf_counter() - started
    return entry


def _table(file: Path) -> dict:
    """{column: (n,)} of a log."""
    table = np.genfromtxt(file, delimiter=",", names=True, autostrip=True)
    return {name: table[name] for name in table.dtype.names}


def _slow(x, rows):
    return np.convolve(np.pad(x, rows // 2, mode="edge"), np.ones(rows) / rows, mode="valid")


def _rms(x) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def _last(x):
    return slice(int((1.0 - q_axis.HELD_OUT) * len(x)), None)


def _pair(line, name) -> list[float]:
    return [line[name], line.sigma(name)]


def _misfit(log, nominal, hold, line):
    """(misfit of u_q with the nominal model, with the improved one), each (n,) [V]."""
    m = nominal.machine
    before = log.u_q - m.resistance_ohm * log.i_q - m.pole_pairs * m.magnet_flux_wb * log.omega
    after = log.u_q - hold["resistance"] * log.i_q - line["k_e"] * log.omega - line["k_e_tau"] * log.slope(log.omega)
    return before, after - line["v_loss"] * np.tanh(log.i_q / q_axis.KNEE_A) - line["u_0"]


def _answer(nominal, log, hold, side, cogging, line, torque, before, after) -> Diagnosis:
    """The results as a Diagnosis, so that report and drive file are written as for any other recording."""
    m = nominal.machine
    p, k_t = m.pole_pairs, 1.5 * line["k_e"]
    order = int(np.argmax(cogging)) + 1
    psi = Estimate(line["k_e"] / p, line.sigma("k_e") / p, "Wb")
    coulomb = Estimate(k_t * torque["coulomb"], k_t * torque.sigma("coulomb"), "Nm")
    viscous = Estimate(k_t * torque["viscous"], k_t * torque.sigma("viscous"), "Nms")
    amplitude = Estimate(k_t * float(cogging[order - 1]), k_t * side.train / np.sqrt(len(cogging)), "Nm")
    resistance = Estimate(*_pair(hold, "resistance"), "ohm")
    shaft = {
        "machine.coulomb_friction_nm": coulomb.value,
        "machine.viscous_friction_nms": viscous.value,
        "machine.inertia_kgm2": k_t * torque["inertia"],
    }
    waves = {"cogging_nm": amplitude, "cogging_order": Estimate(float(order), 0.0, "per turn")}
    cogs = {"machine.cogging_amplitude_nm": amplitude.value, "machine.cogging_order": order}
    found = {
        "resistance": ({"resistance_ohm": resistance}, {"machine.resistance_ohm": resistance.value}),
        "magnet_flux": ({"magnet_flux_wb": psi}, {"machine.magnet_flux_wb": psi.value}),
        "friction": ({"coulomb_nm": coulomb, "viscous_nms": viscous}, shaft),
        "cogging": (waves, cogs),
    }
    part = _last(before)
    rest = slice(0, part.start)
    floor = _rms(log.u_q - log.smooth(log.u_q))
    fit = Fit("u_q", "V", _rms(before[rest]), _rms(after[rest]), _rms(before[part]), _rms(after[part]), floor)
    share = float(np.clip(1.0 - (fit.holdout_after / fit.holdout_before) ** 2, 0.0, 1.0))
    shares = dict.fromkeys(list(found)[:2], share)  # those that act on the voltage
    sentence = (
        f"On the q axis, the only one recorded: resistance {resistance.value:.3g} ohm, magnet flux "
        f"{1e3 * psi.value:.3g} mWb, friction and cogging of order {order}; the misfit of held-out rows falls from "
        f"{1e3 * fit.holdout_before:.3g} mV to {1e3 * fit.holdout_after:.3g} mV."
    )
    notes = (
        "Torques are 1.5 k_e i_q, which assumes peak values and an amplitude-invariant transformation.",
        "The nominal resistance is an assumed value; its difference from the measured one is no finding.",
    )
    return Diagnosis(
        "explained",
        sentence,
        effects=tuple(NamedEffect(n, 0.999, v, shares.get(n, 0.0), plant) for n, (v, plant) in found.items()),
        location=Location("u_q"),
        fit=fit,
        notes=notes,
        evidence=_evidence(log, p, before, after),
    )


def _evidence(log, p, before, after) -> Evidence:
    n = len(before) // HOLD_ROWS * HOLD_ROWS
    mean = lambda x: x[:n].reshape(-1, HOLD_ROWS).mean(axis=1)  # noqa: E731
    held = np.zeros(len(before))
    held[_last(before)] = 1.0
    nothing = np.zeros(n // HOLD_ROWS)
    return Evidence(
        {
            "t": mean(log.t), "omega_e": p * mean(log.omega), "i_d": nothing, "i_q": mean(log.i_q),
            "theta_e": np.mod(p * mean(log.angle), 2 * np.pi), "before_d": nothing, "after_d": nothing,
            "before_q": mean(before), "after_q": mean(after), "holdout": mean(held) > 0.5,
        }
    )  # fmt: skip


def _control(log) -> dict:
    """Speed control with and without the driver's function: ripple of the speed, and of order 72 in the current."""
    out = {}
    for name, value in (("function_off", 0), ("function_on", 1)):
        mine = log["Function_Activated"] == value
        wave = np.exp(-72j * log["Position"][mine])
        line = {"speed_rms_error_rad_s": _rms(log["Velocity"][mine] - log["Reference_Velocity"][mine])}
        out[name] = line | {"order_72_of_i_q_a": float(2.0 * np.abs(np.mean(log["Iq"][mine] * wave)))}
    return out
