# SPDX-License-Identifier: BSD-3-Clause
"""The core's drive from a file whose other sections are checked too: [plant.*], [columns] and [constants].

golden_model.drive.load knows the core's sections alone; the other ones belong to the diagnosis, but a mistake in them
is one of the file, so every command reports it.
"""

from __future__ import annotations

from pathlib import Path

from golden_model import torque_table
from golden_model.drive import Drive, load
from golden_model.drive_file import IGNORED, read_tables
from golden_model.drive_keys import DriveError


def load_drive(path) -> Drive:
    """The drive of a file; DriveError names file, section, key and what is allowed, in any of its sections."""
    drive = load(path)
    if set(read_tables(path)) & set(IGNORED):
        _check_others(path)
    return drive


def flux_of(path: str | None, drive: Drive) -> torque_table.Flux | None:
    """The flux linkage of a map's file; DriveError where the drive has no torque table or the map ends too early."""
    if path is None:
        return None
    if not drive.core.references:
        raise DriveError(
            "--flux-map makes a torque table, which the drive file does not ask for: [core] references = true"
        )
    from fluxproof.diagnosis.ground.plant_keys import read_flux_map  # with numpy, which most files do not need

    chart = read_flux_map(Path(path))
    reach = min(-chart.i_d_a[0], chart.i_q_a[-1])
    if reach < drive.current_limit_a * (1.0 - 1e-6):
        raise DriveError(
            f"{path}: the map ends at i_d = {chart.i_d_a[0]:g} A, i_q = {chart.i_q_a[-1]:g} A: expected is a map up to "
            f"the current limit, {drive.current_limit_a:g} A"
        )
    return torque_table.measured(chart.i_d_a, chart.i_q_a, chart.psi_d_wb, chart.psi_q_wb)


def stated_plant(path) -> list[str]:
    """The keys of [plant.*], "machine.cogging_order" for example, in the order of the file."""
    return [f"{section}.{key}" for section, table in read_tables(path).get("plant", {}).items() for key in table]


def _check_others(path) -> None:
    """DriveError for the first mistake in [columns], [constants] or [plant.*]."""
    from fluxproof.diagnosis.ground.nominal import load_nominal
    from fluxproof.diagnosis.ground.plant_section import plant_of  # these take a second, which most files do not need
    from fluxproof.diagnosis.ground.recording import RecordingError
    from fluxproof.diagnosis.ingest.entries import entry_of
    from fluxproof.diagnosis.ingest.stated import constants_of

    nominal = load_nominal(path)
    try:
        for key, value in nominal.columns.items():
            entry_of(key, value, nominal)
        constants_of(nominal)
    except RecordingError as error:
        raise DriveError(str(error)) from None
    plant_of(nominal)
