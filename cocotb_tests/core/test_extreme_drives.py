# SPDX-License-Identifier: BSD-3-Clause
"""Drive files with keys at the ends of their ranges and beyond: every command works or refuses in one line."""

import random

import pytest

from cocotb_tests.support.drives import DRIVE_FILES
from cocotb_tests.support.extreme_drives import KEYS, beyond, changed_drives, derived, drawn, ends, written
from cocotb_tests.support.slow import slowly
from golden_model.drive import load
from golden_model.drive_file import read_tables
from golden_model.drive_keys import RANGES, DriveError


def tried(path, files, scene=False) -> int:
    """How many of the drive files are accepted by all; each message is one line of reasonable length."""
    accepted = 0
    for tables, changes in files:
        try:
            refused = derived(written(path, tables, changes), scene)
        except Exception as error:
            raise AssertionError(f"{changes}: {type(error).__name__}: {error}") from error
        assert all(line.isprintable() and len(line) < 700 for line in refused), refused
        accepted += not refused
    return accepted


@pytest.mark.parametrize("count", [60, slowly(3000)])
@pytest.mark.parametrize("most", [1, 2, 6])
def test_values_within_the_ranges_are_taken_or_refused(tmp_path, count, most):
    accepted = tried(tmp_path / "drive.toml", changed_drives(DRIVE_FILES, count, most, drawn, most))
    assert accepted > 0.04 * count, "the drawn values no longer reach the commands"


@pytest.mark.parametrize("count", [60, slowly(3000)])
def test_values_beyond_the_ranges_are_refused_or_harmless(tmp_path, count):
    tried(tmp_path / "drive.toml", changed_drives(DRIVE_FILES, count, 7, beyond, 3))


@pytest.mark.parametrize("count", [80, slowly(20000)])
def test_pairs_of_extremes(tmp_path, count):
    rng, files = random.Random(11), [read_tables(path) for path in DRIVE_FILES]

    def pairs():
        for _ in range(count):
            two = rng.sample(KEYS, 2)
            values = [rng.choice(ends(key)) for *_, key in two]
            values = [[value] * key.count if key.count else value for value, (*_, key) in zip(values, two, strict=True)]
            yield rng.choice(files), [(s, name, value) for (s, name, _), value in zip(two, values, strict=True)]

    assert tried(tmp_path / "drive.toml", pairs())


@pytest.mark.parametrize("count", [5, slowly(200)])
def test_scenes_of_extreme_drives(tmp_path, count):
    tried(tmp_path / "drive.toml", changed_drives(DRIVE_FILES, count, 3), scene=True)


@pytest.mark.parametrize(("section", "name", "key"), KEYS, ids=lambda part: part if isinstance(part, str) else "")
def test_every_number_has_a_range_and_its_ends_are_refused_beyond(tmp_path, section, name, key):
    """One number beyond an end is refused with section, key and range."""
    if key.kind == "float":
        assert abs(key.lo) <= 2.0**32 and 0.0 < key.hi <= RANGES[key.unit][1]
    if key.kind not in ("float", "int"):
        return
    tables = read_tables(DRIVE_FILES[0])
    for value in (key.lo - 1, key.hi * 2 + 1):
        value = [value] * key.count if key.count else value
        with pytest.raises(DriveError) as caught:
            load(written(tmp_path / "drive.toml", tables, [(section, name, value)]))
        message = str(caught.value)
        assert f"[{section}] {name} = " in message and f"out of range: allowed is {key.allowed}" in message
