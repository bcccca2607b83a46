# SPDX-License-Identifier: BSD-3-Clause
"""Canonical columns of a telemetry dump: the converters' codes in SI units.

Currents, bus voltage and angle are computed from the raw codes with the registers' offsets and gains, without rounding
to the core's formats.  The speed is that of the core if it is recorded, else the difference quotient of the angle.
"""

from __future__ import annotations

import math

import numpy as np

from golden_model.fluxproof import REGISTERS, Sample
from golden_model.formats import CODE, TURN
from golden_model.units import TURN_RAD


def columns_of(meta: dict) -> dict[str, np.ndarray]:
    """Canonical columns, float64, (n,), of the ``meta`` of read_dump; the winding temperature is NaN in rows where the
    core had none, and omitted if it never had one."""
    header, regs, config = meta["telemetry"], meta["registers"], meta["config"]
    bases, t_s, observed, scales = header["bases"], header["sample_time_s"], meta["observed"], meta["scales"]
    code = {name: meta["samples"][:, k] for k, name in enumerate(Sample._fields)}
    left = 2 ** (16 - config["adc_bits"])  # codes are left-aligned in 16 bits

    def read(raw, offset, gain, base):
        lsb = CODE.lsb * REGISTERS[gain].fmt.lsb * base
        return (raw * left - regs[offset]) * (regs[gain] * lsb)

    columns = {"t": (meta["counter"] - meta["counter"][0]) * t_s}
    for x in "abc":
        columns[f"i_{x}"] = read(code[f"adc_{x}"], f"offset_{x}", f"gain_{x}", bases["current_a"])
    columns["theta_e"] = electrical_angle(code["position_code"], regs, config["position_bits"]) * TURN.lsb * TURN_RAD
    if "omega_me" in observed:
        columns["omega_e"] = observed["omega_me"] * scales["omega_me"]
    else:
        columns["omega_e"] = _chord(columns["theta_e"], columns["t"])
    columns["u_dc"] = np.maximum(read(code["adc_u_dc"], "u_dc_offset", "u_dc_gain", bases["voltage_v"]), 0.0)
    for x in "abc":
        if f"compare_{x}" in observed:
            columns[f"d_{x}"] = observed[f"compare_{x}"] / config["carrier_half"]
    for x in "dq":
        if f"u_{x}" in observed:
            columns[f"u_{x}_ref"] = observed[f"u_{x}"] * scales[f"u_{x}"]
    columns["i_d_ref"] = code["i_d_ref"] * scales["i_d_ref"]
    if "i_q_ref" in observed:
        columns["i_q_ref"] = observed["i_q_ref"] * scales["i_q_ref"]
    elif not code["speed_mode"].any():
        columns["i_q_ref"] = code["i_q_ext"] * scales["i_q_ext"]
    if code["temp_valid"].any():
        columns["temp_winding"] = np.where(code["temp_valid"], code["temp_winding"] * scales["temp_winding"], np.nan)
    return {name: np.ascontiguousarray(values, float) for name, values in columns.items()}


def electrical_angle(code, regs, position_bits):
    """io/position for arrays: integers in the TURN format."""
    turn = (regs["pole_pairs"] * code) << (TURN.width - position_bits)
    return (regs["theta_offset"] + (-turn if regs["reverse"] else turn)) % 2**TURN.width


def _chord(theta, t):
    """Speed [rad/s] from each row's angle to the next row's; the last row repeats the previous value."""
    if len(t) < 2:
        return np.zeros(len(t))
    turned = (np.diff(theta) + math.pi) % TURN_RAD - math.pi
    speed = turned / np.maximum(np.diff(t), 1e-12)
    return np.append(speed, speed[-1])
