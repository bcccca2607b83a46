# SPDX-License-Identifier: BSD-3-Clause
"""A free shaft: its acceleration is a second difference of the angle, whose noise is small at low speed only."""

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.blind_cases import files_of
from fluxproof.diagnosis.balance.cells import _steep_variance
from fluxproof.diagnosis.balance.shaft import airgap, bend_gain, shaft_kind
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.physics import rows_of, view_and_held

NOMINAL = load_nominal(PAPER)


@pytest.mark.parametrize(
    ("kind", "share"),
    [("loaded", 0.0), ("driving", 1.0), ("loaded", 0.2), ("driving", 0.8)],  # of the inertia behind it
)
def test_what_the_transducer_measures_is_seen(kind, share):
    """In front of load and inertia it shows the torque that accelerates; this had been subtracted once more."""
    machine = SimpleNamespace(**vars(NOMINAL.machine) | {"inertia_kgm2": 1e-3})
    nominal = SimpleNamespace(machine=machine, sample_time_s=1e-4)
    t = np.arange(40000) * nominal.sample_time_s
    i = 1j * machine.rated_current_a * np.sin(2 * np.pi * 3.0 * t)
    load = 0.1 * airgap(nominal, 1j * machine.rated_current_a) * (t > 2.0)
    inertial = airgap(nominal, i) - load
    omega = np.cumsum(inertial) * nominal.sample_time_s / machine.inertia_kgm2
    theta = machine.pole_pairs * np.cumsum(omega) * nominal.sample_time_s
    recording = from_columns({"t": t, "torque": load + share * inertial}, nominal.sample_time_s)
    assert shaft_kind(recording, nominal, i, theta, np.ones(len(t) - 1, bool)) == kind


def test_the_noise_of_an_acceleration_follows_the_gain_of_the_second_difference(tmp_path):
    recording, drive = files_of(6, tmp_path, 26112026, "own", 80)
    nominal = load_nominal(drive)
    rows = rows_of(*view_and_held([load_recording(recording, nominal)], nominal))
    cells, order = rows.cells, 36.0  # not of the cogging
    mine = (cells.channel == "torque") & (cells.order == order) & cells.ok
    gain = bend_gain(rows.view, order)[cells.block[mine]]
    for part in np.array_split(np.argsort(gain), 6):
        power = np.mean((cells.y[mine][part] / rows.noise[mine][part]) ** 2)
        assert 0.5 < power < 1.8, (gain[part].min(), gain[part].max())


@pytest.mark.parametrize(("constant", "growing"), [(0.0, 1.0), (1.0, 0.0), (1e-4, 1.0)])
def test_the_variance_of_a_part_is_found_at_any_size(constant, growing):
    rng, n = np.random.default_rng(5), 400
    grows = np.linspace(0.0, 1.0, n) ** 4
    shape = np.stack([np.ones(n), grows], axis=1)
    true = constant + growing * grows
    found = _steep_variance(rng.normal(size=n) * np.sqrt(true), np.ones(n, bool), np.arange(n - 1), shape)
    seen = true > 1e-6
    assert np.all(np.abs(np.log(found[seen] / true[seen])) < np.log(3.0))
