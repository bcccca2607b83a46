# SPDX-License-Identifier: BSD-3-Clause
"""The recording that a diagnosis requests, simulated with the same hidden drive, and whether it resolves the tie."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np

from studies.blind import cases, plans
from studies.blind.figures import named_right

DWELL_S = 0.6
MOST_REQUESTS = 3
SHARES = (1.0, 0.85, 0.7, 0.5, 0.3)  # of a requested current, tried in order until the drive reaches the point


def requested_plan(case: cases.Case, request: dict, share: float = 1.0) -> plans.Plan:
    """A plan at the requested point, limited to what the drive can reach.

    share: of the requested current.
    """
    n = case.build.nominal
    i_r = n.machine["rated_current_a"]
    i_d, i_q = float(request["i_d"]), float(request["i_q"])
    shrink = share * min(1.0, i_r / max(np.hypot(i_d, i_q), 1e-9))
    i_d, i_q, omega = i_d * shrink, i_q * shrink, float(request["omega_e"])
    bus = min(
        max(request.get("u_dc") or n.inverter["dc_bus_v"], 0.5 * n.inverter["dc_bus_v"]),
        1.2 * n.inverter["dc_bus_v"],
    )
    limit = 0.85 * n.voltage_limit * bus / n.inverter["dc_bus_v"]
    omega = float(np.clip(omega, -1.2 * n.omega_rated, 1.2 * n.omega_rated))
    while n.voltage(omega, i_d, i_q) > limit and abs(omega) > 1e-3 * n.omega_rated:
        omega *= 0.97
    return plans.Plan([(omega, i_d, i_q, int(DWELL_S / n.period_s))], bus_v=bus)


def further_recording(case: cases.Case, request: dict, seed: int, attempt: int, number: int) -> dict:
    """Columns {name: (n,)} of the same drive at {"omega_e", "i_d", "i_q", "u_dc", "temp_winding"} [SI].

    Drifts keep their final values of the case's recording, unless a winding temperature near the reference is
    requested: then the drive has cooled down.
    """
    build = copy.copy(case.build)
    wanted, reference = request.get("temp_winding"), build.nominal.machine["temperature_ref_c"]
    build.with_temp = build.with_temp or wanted is not None  # a requested temperature is also recorded
    cold = wanted is not None and wanted < reference + 10.0
    if cold:
        build.on_course = [_frozen(change, 0.0) for change in case.build.on_course]
        if case.build.temperature:
            build.temperature = lambda x: case.build.temperature(0.0 * x)
    for share in SHARES:
        plan = requested_plan(case, request, share)
        try:
            return build.record(cases.rng_of(seed, case.index, attempt, 2 + number), plan, x_start=1.0)[0]
        except ZeroDivisionError:  # the hidden flux map has no current for this flux
            continue
    raise RuntimeError(f"{request}: the drive of case {case.index} does not reach this point, nor one near it")


def _frozen(change, at):
    return lambda course, x: change(course, np.full_like(x, at))


def resolve(truth: dict, answer: dict, seed: int, folder: Path, scratch: Path, diagnose) -> dict:
    """Make the recordings that an ambiguous answer requests and diagnose all of them together.

    Returns {"case", "asked", "resolved", "verdict", "effects"}.
    """
    from studies.blind.generate import write_recording

    requests = answer.get("next_recording", [])[:MOST_REQUESTS]
    base = {"case": truth["case"], "asked": bool(requests), "resolved": False, "verdict": None, "effects": []}
    if not requests:
        return base
    case = cases.make(seed, truth["index"], truth["stratum"], truth["turn"], truth["attempt"])
    scratch.mkdir(parents=True, exist_ok=True)
    paths = [folder / truth["case"] / truth["recording"]]
    for number, request in enumerate(requests):
        columns = further_recording(case, request, seed, truth["attempt"], number)
        paths.append(write_recording(scratch / f"{truth['case']}_{number + 1}", columns, "parquet"))
    second = diagnose(paths, folder / truth["case"] / "drive.toml").to_json()
    return {
        **base,
        "resolved": named_right(truth, second),
        "verdict": second["verdict"],
        "effects": [e["name"] for e in second["effects"]],
    }
