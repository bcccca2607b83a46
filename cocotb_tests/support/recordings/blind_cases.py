# SPDX-License-Identifier: BSD-3-Clause
"""Cases of the blind study as files."""

from studies.blind.generate import generate_case, listing

SEED, LATER, LAST, FOURTH, FIFTH, COUNT = 25112032, 26112026, 27112026, 29112026, 30112026, 60


def files_of(number, tmp_path, seed=SEED, generator="sealed", count=COUNT):
    """Recording and drive file of a case; count: cases of the run that it is of."""
    number, stratum, turn = listing(seed, count, None, generator)[number - 1]
    entry = generate_case((generator, seed, number, stratum, turn, tmp_path))
    folder = tmp_path / entry["case"]
    return folder / entry["recording"], folder / "drive.toml"
