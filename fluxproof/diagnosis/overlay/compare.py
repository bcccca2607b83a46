# SPDX-License-Identifier: BSD-3-Clause
"""Closed-loop simulations for comparison with the recording, of the drive as described and of the improved one.

The controller hides an effect from the currents, in the drive and in the simulation; the signal to compare is the
commanded voltage.  Speed, bus voltage and references are those of the recording; controller and plant are simulated
(loop.py) for at most 20,000 rows in stretches over the recording.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.nominal import Nominal, load_nominal
from fluxproof.diagnosis.ground.plant_section import Plant, errors_beyond, plant_of
from fluxproof.diagnosis.ground.recording import Recording, RecordingError
from fluxproof.diagnosis.overlay.inputs import SETTLING_ROWS, Stretch, dq, dq_currents, stretches
from fluxproof.diagnosis.overlay.loop import Controller, Errors, Inputs, run_loop
from fluxproof.plant import IMPOSED_SPEED, initial_state, plant_params
from golden_model.scaling import current_gains

MOST_POINTS = 4_000
SIGNALS = ("u_d_ref", "u_q_ref", "i_d", "i_q")
VOLTAGES = SIGNALS[:2]
RUN_IN = 200  # rows at the start of a stretch that are simulated but not shown
USUAL_BANDWIDTH = 0.05  # of the sampling frequency, if the drive file gives no bandwidth


def closed_loop(recording: Recording, nominal: Nominal, improved=None) -> dict:
    """Simulate and compare; ``improved``: a Nominal or the path of an improved drive file, or None.

    {"t": (m,) s, "recorded", "simulated_before", "simulated_after": {u_d_ref, u_q_ref [V], i_d, i_q [A]: (m,)},
    "rms_before", "rms_after": {the same: rms difference of the block means}, "rows": simulated rows, "block_rows":
    rows in a block}, m <= 4000; "simulated_after" and "rms_after" only with an improved drive.  Where the recording
    has duties, the recorded voltages are theirs, in the rotor frame of the middle of the period in which they act.
    RecordingError names a missing column.
    """
    parts = stretches(recording, nominal)
    recorded = _recorded(recording, nominal)
    shown, block = _shown(parts, recording.slow)
    result: dict[str, Any] = {
        "t": _blocks([recording["t"][p.rows[keep]] for p, keep in zip(parts, shown, strict=True)], block)
    }
    chosen = [recorded[p.rows[keep]] for p, keep in zip(parts, shown, strict=True)]
    result["recorded"] = _columns(chosen, block)
    drives = {"before": plant_of(nominal)}
    if improved is not None:
        drives["after"] = plant_of(improved if isinstance(improved, Nominal) else load_nominal(improved))
    for name, plant in drives.items():
        made = [_simulate(part, plant, nominal, recorded)[keep] for part, keep in zip(parts, shown, strict=True)]
        result[f"simulated_{name}"] = _columns(made, block)
        result[f"rms_{name}"] = {
            signal: float(np.sqrt(np.nanmean((values - result["recorded"][signal]) ** 2)))
            for signal, values in result[f"simulated_{name}"].items()
        }
    return result | {"rows": int(sum(len(p.rows) for p in parts)), "block_rows": block}


def is_worse(laid_over: dict | None, fit) -> bool:
    """Whether the improved drive leaves clearly more of the voltage than the nominal one; fit: of the balance, or None.

    What is within the noise of the balance is no difference.
    """
    if laid_over is None or "rms_after" not in laid_over or fit is None:
        return False
    before, after = (np.hypot(*(laid_over[f"rms_{when}"][x] for x in VOLTAGES)) for when in ("before", "after"))
    return bool(after > k.MUCH_WORSE * before + fit.noise_floor)


def _shown(parts: list[Stretch], slow: bool):
    """(rows of each stretch that are evaluated, rows per block)."""
    if slow:
        return [slice(2 * SETTLING_ROWS // 3, None)] * len(parts), SETTLING_ROWS - 2 * SETTLING_ROWS // 3
    total = sum(len(p.rows) - RUN_IN for p in parts)
    return [slice(RUN_IN, None)] * len(parts), max(1, -(-total // MOST_POINTS))


def _blocks(pieces, block):
    """Block means of each piece, concatenated; an incomplete last block is omitted."""
    means = [p[: len(p) // block * block].reshape(-1, block).mean(axis=1) for p in pieces]
    return np.concatenate(means)


def _columns(pieces, block) -> dict:
    """{signal: block means} of pieces (n, 4)."""
    return {name: _blocks([p[:, n] for p in pieces], block) for n, name in enumerate(SIGNALS)}


def _recorded(recording: Recording, nominal: Nominal) -> np.ndarray:
    """(n, 4) in the order of SIGNALS; voltages from the duties if these are recorded."""
    currents = dq_currents(recording)
    if recording.has("d_a", "d_b", "d_c", "u_dc", "theta_e"):
        turned = recording["theta_e"] + _ahead(recording, nominal)
        volts = dq(*(recording[f"d_{x}"] * recording["u_dc"] for x in "abc"), theta=turned)
    elif recording.has("u_d_ref", "u_q_ref"):
        volts = np.stack([recording["u_d_ref"], recording["u_q_ref"]], axis=1)
    else:
        raise RecordingError(f"{recording.source}: d_a, d_b, d_c with u_dc and theta_e, or u_d_ref, u_q_ref are needed")
    return np.hstack([volts, currents])


def _ahead(recording, nominal):
    """Angle [rad] from a row to the middle of the period in which its duties act."""
    if recording.has("omega_e"):
        omega = recording["omega_e"]
    else:
        omega = np.gradient(np.unwrap(recording["theta_e"]), nominal.sample_time_s)
    return (nominal.control.duty_applied_after_samples + 0.5) * nominal.sample_time_s * omega


def controller_of(nominal: Nominal) -> Controller:
    """The controller of the nominal drive; without a bandwidth, 1/20 of the sampling frequency is used."""
    c, m = nominal.control, nominal.machine
    if c.current_bandwidth_hz is None:
        c = dataclasses.replace(c, current_bandwidth_hz=USUAL_BANDWIDTH / nominal.sample_time_s)
    (kp_d, ki_d), (kp_q, ki_q) = (current_gains(dataclasses.replace(nominal, control=c), x) for x in "dq")
    return Controller(
        kp_d=kp_d,
        kp_q=kp_q,
        ki_d=ki_d,
        ki_q=ki_q,
        inductance_d=m.inductance_d_h,
        inductance_q=m.inductance_q_h,
        magnet_flux=m.magnet_flux_wb,
        delay_samples=float(c.delay_samples) - nominal.sampling.delay_s / nominal.sample_time_s,
        period_s=nominal.sample_time_s,
    )


def _errors(plant: Plant, nominal: Nominal) -> tuple[Errors, float]:
    """(Errors of the hardware relative to the nominal drive, angle offset [rad])."""
    beyond, timing = errors_beyond(plant.sensors, nominal), plant.timing
    delay = nominal.control.duty_applied_after_samples + timing.delay_s / nominal.sample_time_s
    errors = Errors(
        current_gain=np.asarray(beyond["current_gain"], float),
        current_offset=np.asarray(beyond["current_offset_a"], float),
        u_dc_gain=float(beyond["u_dc_gain"]),
        skew_s=float(timing.sampling_skew_s),
        delay_periods=max(0.0, float(delay)),
    )
    return errors, beyond["theta_offset"]


def _true_angle(theta, omega, plant: Plant, offset):
    """The true angle for the one that is read, unwrapped [rad]; omega: of the intervals [rad/s]; all electrical."""
    s, p = plant.sensors, plant.machine.pole_pairs
    theta = theta + plant.timing.angle_delay_s * np.append(omega, omega[-1])
    theta_m = (theta - offset) / p
    once = s.eccentricity_once_rad * np.sin(theta_m + s.eccentricity_once_phase_rad)
    twice = s.eccentricity_twice_rad * np.sin(2.0 * theta_m + s.eccentricity_twice_phase_rad)
    return theta - offset - p * s.position_direction * (once + twice)


def _simulate(part: Stretch, plant: Plant, nominal: Nominal, recorded) -> np.ndarray:
    """(n, 4) in the order of SIGNALS, of one stretch."""
    errors, offset = _errors(plant, nominal)
    controller, machine, inverter = controller_of(nominal), plant.machine, plant.inverter
    if machine.flux_map is not None and machine.flux_map.folds():
        machine = dataclasses.replace(machine, flux_map=machine.flux_map.mended())
    # A sign function would make currents near zero chatter by the step of half a dead time.
    ripple = 0.5 * inverter.dead_time_s * part.u_dc.max() / min(machine.inductance_d_h, machine.inductance_q_h)
    inverter = dataclasses.replace(inverter, zero_current_a=max(inverter.zero_current_a, ripple))
    params = plant_params(machine, inverter, mode=IMPOSED_SPEED)
    first = recorded[part.rows[0]]
    theta = _true_angle(part.theta, part.omega, plant, offset)
    i_d, i_q = part.i_ref[0]
    state = initial_state(
        machine, params, i_d=i_d, i_q=i_q, omega_m=part.omega[0] / machine.pole_pairs,
        theta_m=theta[0] / machine.pole_pairs,
    )  # fmt: skip
    c, omega = controller, part.omega[0]
    u_d, u_q = first[:2] if np.isfinite(first[:2]).all() else (0.0, omega * c.magnet_flux)
    integral = np.array([u_d + omega * c.inductance_q * i_q, u_q - omega * (c.inductance_d * i_d + c.magnet_flux)])
    hot = np.where(np.isfinite(part.temperature), part.temperature, machine.temperature_winding_c)
    out = np.zeros((len(part.rows), 4))
    i_ref, u_dc = (np.ascontiguousarray(values, float) for values in (part.i_ref, part.u_dc))
    run_loop(state, params, controller, errors, Inputs(part.theta, theta, part.omega, i_ref, u_dc, hot), integral, out)
    return out[:, [2, 3, 0, 1]]
