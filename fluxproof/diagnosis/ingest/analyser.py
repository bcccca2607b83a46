# SPDX-License-Identifier: BSD-3-Clause
"""The table of a power analyser as dq values: a row per operating point, without an angle.

    u_line p_el          line-to-line voltage (fundamental) and electric power of the machine
    i_d_ref i_q_ref      the references of the drive, or i_d i_q
    i_line               line current (fundamental), which then replaces the magnitude of the references

All values are amplitudes; the units "V rms" and "A rms" are converted.  With P = 3/2 Re(u conj(i)) the voltage lies

    u = U / sqrt(3) exp(j (arg i +- phi)),  cos phi = P / (3/2 |u| |i|)

and of the two the one counts that is nearer to what the machine needs.  Without current it has the direction that the
machine needs, and only its magnitude is a measurement.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.machine import flux_terms
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.ingest.demand import is_analysed

LEAST_CURRENT = 0.01  # of rated current: with less the power does not tell the angle of the voltage
STEPS = 20  # most, in which the choice of one of two angles is repeated
MORE_POWER = 1.05  # of the apparent power: a larger power is of other quantities


def dq_of_analyser(path, columns: dict, nominal, notes: list) -> dict:
    """The columns (n,) with i_d i_q u_d_ref u_q_ref in place of an analyser's; the same ones of other recordings."""
    if not is_analysed(columns):
        return columns
    m, measured = nominal.machine, {"i_d", "i_q"} <= set(columns)
    names = ("i_d", "i_q") if measured else ("i_d_ref", "i_q_ref")
    i: Complex = columns[names[0]] + 1j * columns[names[1]]
    told = np.abs(i) > LEAST_CURRENT * m.rated_current_a
    if not measured and "i_line" in columns:
        i = np.where(told, i / np.maximum(np.abs(i), 1e-30) * columns["i_line"], i)
    u, omega = columns["u_line"] / np.sqrt(3.0), columns["omega_e"]
    cosine = columns["p_el"] / np.where(told, 1.5 * u * np.abs(i), np.inf)
    usual = float(np.nanmedian(np.abs(cosine[told]))) if told.any() else 0.0
    if usual > MORE_POWER:
        raise RecordingError(
            f"{path}: p_el is {usual:.3g} times the apparent power of u_line and the current: expected are the "
            "line-to-line voltage and the line current, as amplitudes or with the units V rms and A rms"
        )
    found = _voltage(u, np.arccos(np.clip(cosine, -1.0, 1.0)), i, omega, told, m)
    source = "i_d, i_q" if measured else "the current references" + (" and i_line" if "i_line" in columns else "")
    notes.append(f"dq voltages are computed from u_line and p_el, dq currents are {source}")
    kept = {k: x for k, x in columns.items() if k not in ("u_line", "i_line", "p_el")}
    return kept | {"i_d": i.real, "i_q": i.imag, "u_d_ref": found.real, "u_q_ref": found.imag}


def _voltage(u, phi, i: Complex, omega, told, machine) -> Complex:
    """Complex dq voltages (n,) [V] of the magnitudes u, by the angle phi ahead of the current or behind it.

    Where the two are close, the machine that fits best to all points decides, which starts as the nominal one.
    """
    ahead, behind = (u * np.exp(1j * (np.angle(i) + sign * phi)) for sign in (1.0, -1.0))
    emf = [1j * omega * psi for psi in flux_terms(machine, i)]
    terms: Complex = np.stack([machine.resistance_ohm * i, *emf], axis=1)
    share = np.ones(4)
    found: Complex | None = None
    for _ in range(STEPS):
        needed = terms @ share
        chosen = np.where(np.abs(ahead - needed) < np.abs(behind - needed), ahead, behind)
        chosen = np.where(told, chosen, u * np.exp(1j * np.angle(needed)))
        if found is not None and np.array_equal(chosen, found):
            break
        found = chosen
        known = np.isfinite(found) & np.isfinite(needed)
        left: Complex = (found - needed)[known]
        rows = np.concatenate([terms[known].real, terms[known].imag])
        share = share + np.linalg.lstsq(rows, np.concatenate([left.real, left.imag]), rcond=1e-6)[0]
    assert found is not None  # STEPS is positive
    return found
